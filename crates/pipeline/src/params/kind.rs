//! What a parameter can be: numbers, switches, choices, lists of choices, texts.

use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// The limits of a number, both included. Meaningless for other kinds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Bounds {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
}

/// Limits of a number.
pub(super) const fn within(min: f64, max: f64) -> Option<Bounds> {
    Some(Bounds { min, max })
}

/// For parameters that are not numbers.
pub(super) const ANY: Option<Bounds> = None;

/// A type that a parameter can have.
pub(super) trait Kind: Sized {
    /// What a user calls it: `number`, `integer`, `switch`, `choice`, `list`, `text`.
    const NAME: &'static str;

    /// The names to choose from, for choices and lists.
    const CHOICES: &'static [&'static str] = &[];

    /// Reads it; the error says what was expected.
    fn parse(text: &str) -> Result<Self, String>;

    /// Writes it so that [`Kind::parse`] reads the same value.
    fn show(&self) -> String;

    /// The number to hold against the limits.
    fn number(&self) -> Option<f64> {
        None
    }
}

impl Kind for f64 {
    const NAME: &'static str = "number";

    fn parse(text: &str) -> Result<Self, String> {
        text.parse().ok().filter(|v: &Self| v.is_finite()).ok_or_else(|| "a number such as 0.25".to_owned())
    }

    fn show(&self) -> String {
        self.to_string()
    }

    fn number(&self) -> Option<f64> {
        Some(*self)
    }
}

impl Kind for usize {
    const NAME: &'static str = "integer";

    fn parse(text: &str) -> Result<Self, String> {
        text.parse().map_err(|_| "a whole number such as 16".to_owned())
    }

    fn show(&self) -> String {
        self.to_string()
    }

    fn number(&self) -> Option<f64> {
        Some(*self as f64)
    }
}

impl Kind for bool {
    const NAME: &'static str = "switch";
    const CHOICES: &'static [&'static str] = &["true", "false"];

    fn parse(text: &str) -> Result<Self, String> {
        match text {
            "true" | "on" | "yes" => Ok(true),
            "false" | "off" | "no" => Ok(false),
            _ => Err("true or false".to_owned()),
        }
    }

    fn show(&self) -> String {
        self.to_string()
    }
}

impl Kind for String {
    const NAME: &'static str = "text";

    fn parse(text: &str) -> Result<Self, String> {
        Ok(text.trim().to_owned())
    }

    fn show(&self) -> String {
        self.clone()
    }
}

/// A file that may be left out; the empty text stands for none.
impl Kind for Option<PathBuf> {
    const NAME: &'static str = "file";

    fn parse(text: &str) -> Result<Self, String> {
        let text = text.trim();
        Ok((!text.is_empty()).then(|| PathBuf::from(text)))
    }

    fn show(&self) -> String {
        self.as_ref().map(|p| p.display().to_string()).unwrap_or_default()
    }
}

/// Declares an enum whose variants a user chooses by name.
macro_rules! choices {
    ($(#[$meta:meta])* $Type:ident { $($(#[$variant_meta:meta])* $Variant:ident = $name:literal,)+ }) => {
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum $Type {
            $($(#[$variant_meta])* #[serde(rename = $name)] $Variant,)+
        }

        impl $Type {
            /// The name by which a user chooses it.
            #[must_use]
            pub fn name(self) -> &'static str {
                match self { $(Self::$Variant => $name,)+ }
            }
        }

        impl Kind for $Type {
            const NAME: &'static str = "choice";
            const CHOICES: &'static [&'static str] = &[$($name),+];

            fn parse(text: &str) -> Result<Self, String> {
                match text.trim().to_ascii_lowercase().as_str() {
                    $($name => Ok(Self::$Variant),)+
                    _ => Err(format!("one of {}", Self::CHOICES.join(", "))),
                }
            }

            fn show(&self) -> String {
                self.name().to_owned()
            }
        }
    };
}

choices! {
    /// Which axis of the input points up.
    Up {
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
    /// Whose rules a stage follows.
    Method {
        /// The rules of this program.
        Gable = "gable",
        /// The rules published by Zhu et al. 2018, as a baseline.
        Zhu2018 = "zhu2018",
    }
}

choices! {
    /// What the tree classifier looks at.
    Features {
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
    TerrainModel {
        /// One surface for the city that follows slopes.
        Surface = "surface",
        /// One height for each segmentation patch (Zhu 2018, §4.2).
        Constant = "constant",
    }
}

choices! {
    /// An output format.
    Format {
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

/// A list of output formats, without repetition, in the order of [`Format`].
impl Kind for Vec<Format> {
    const NAME: &'static str = "list";
    const CHOICES: &'static [&'static str] = Format::CHOICES;

    fn parse(text: &str) -> Result<Self, String> {
        let parts = text.split(',').map(str::trim).filter(|p| !p.is_empty());
        let mut formats: Self = parts
            .map(Format::parse)
            .collect::<Result<_, _>>()
            .map_err(|expected| format!("{expected}, several joined by commas"))?;
        formats.sort_unstable();
        formats.dedup();
        if formats.is_empty() { Err(format!("at least one of {}", Self::CHOICES.join(", "))) } else { Ok(formats) }
    }

    fn show(&self) -> String {
        self.iter().map(|f| f.name()).collect::<Vec<_>>().join(",")
    }
}
