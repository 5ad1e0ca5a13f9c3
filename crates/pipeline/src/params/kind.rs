//! Choices that a user makes: which axis is up, which features, which terrain, which formats.

use gable_parameters::choices;

choices! {
    /// Which axis of the input points up.
    pub enum Up {
        /// z, unless the input is clearly y-up: that is an error which says so.
        Auto = "auto",
        /// z points up.
        Z = "z",
        /// y points up: the input is turned.
        Y = "y",
        /// z points down: the input is turned.
        MinusZ = "-z",
        /// y points down: the input is turned.
        MinusY = "-y",
    }
}

choices! {
    /// What the tree classifier looks at.
    pub enum Features {
        /// Colour and geometry where the input has textures or colours, else geometry alone.
        Auto = "auto",
        /// Colour and geometry.
        Full = "full",
        /// The 27 of Zhu 2018 (§4.1): colour and its texture.
        Zhu27 = "zhu27",
        /// Geometry alone.
        Geometric = "geometric",
    }
}

choices! {
    /// How the ground is found.
    pub enum TerrainModel {
        /// One surface for the city that follows slopes.
        Surface = "surface",
        /// One height for each segmentation patch (Zhu 2018, §4.2).
        Constant = "constant",
    }
}

choices! {
    /// An output format.
    pub enum Format {
        /// CityJSON 2.0, one file for each tile.
        CityJson = "cityjson",
        /// CityJSONSeq 2.0, one file for the city.
        CityJsonSeq = "cityjsonseq",
        /// CityGML 2.0, one file for each tile.
        CityGml = "citygml",
        /// 3D Tiles 1.1, contents for each tile and tilesets for the city.
        Tiles3d = "3dtiles",
        /// 3D Tiles 1.1 of the mesh itself, thinned out and coloured, to compare.
        MeshTiles3d = "mesh-3dtiles",
        /// CityGML 3.0, one file for each tile.
        CityGml3 = "citygml3",
        /// Wavefront OBJ of the models, one file for each tile.
        Obj = "obj",
        /// GLB (glTF 2.0) of the models, one file for each tile.
        Glb = "glb",
        /// Cloud-optimised GeoTIFF of the city from above: orthophoto, DSM, DTM, nDSM, labels.
        GeoTiff = "geotiff",
        /// GeoPackage of footprints and roof surfaces, one for the city.
        GeoPackage = "geopackage",
        /// FlatGeobuf of footprints and of roof surfaces.
        FlatGeobuf = "flatgeobuf",
        /// GeoJSON of footprints and of roof surfaces, in longitude and latitude.
        GeoJson = "geojson",
    }
}
