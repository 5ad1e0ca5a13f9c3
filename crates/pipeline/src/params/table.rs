//! The parameters of the stages: name, unit, default, range and help of each.
//!
//! To add one, write its line here. The typed field of [`Params`](super::Params), `gable params`, `--set`,
//! the config file, the checks and the hash all come from it. What a method alone reads is declared with the method.

use super::kind::{Features, Format, TerrainModel, Up};
use super::registry::Registry;
use gable_parameters::{ANY, Parameters, parameters, within};
use std::path::PathBuf;

parameters! {
    /// How the mesh is read.
    pub struct InputParams {
        /// Which axis of the input points up, -z and -y down; auto takes z, for glTF y, and refuses a mesh that clearly lies on its side.
        up: Up = Up::Auto, "", ANY;
        /// Reference system, EPSG:code, EPSG:code+code of heights, or ENU:latitude,longitude; auto takes what the input says.
        crs: String = "auto".to_owned(), "", ANY;
        /// What is added to the coordinates, x,y,z in the units of the reference system; auto takes what files beside the mesh say.
        origin: String = "auto".to_owned(), "", ANY;
        /// Of 3D Tiles, how far from the finest shape the tiles that are read may be; 0 for the finest.
        error: f64 = 0.0, "m", within(0.0, 1000.0);
        /// Whether vertices that are no numbers, faces of vertices that are not there, and damaged files among others are refused, not left out.
        strict: bool = false, "", ANY;
    }
}

parameters! {
    /// How the city is cut into blocks, which become the tiles of the output.
    pub struct GridParams {
        /// Blocks from west to east; 0 for a number that fits: blocks of 100 m or more, at most 16.
        columns: usize = 0, "", within(0.0, 1024.0);
        /// Blocks from south to north; 0 for a number that fits: blocks of 100 m or more, at most 16.
        rows: usize = 0, "", within(0.0, 1024.0);
        /// Edge of a block instead of columns and rows; 0 for columns and rows.
        block_size: f64 = 0.0, "m", within(0.0, 100_000.0);
    }
}

parameters! {
    /// How the mesh is turned into rasters.
    pub struct SamplingParams {
        /// Edge of a pixel.
        step: f64 = 0.2, "m", within(0.02, 5.0);
    }
}

parameters! {
    /// How pixels get their labels: ground, grass, tree, building.
    pub struct SegmentationParams {
        /// Whose rules tell the classes apart.
        method: String = Registry::get().labellers()[0].name().to_owned(), "", ANY;
        /// What the tree classifier looks at.
        features: Features = Features::Auto, "", ANY;
        /// Weights of the tree classifier made by gable train; empty for those that are built in.
        weights: Option<PathBuf> = None, "", ANY;
        /// Folder that holds labels/, with pictures as gable run and gable synth write them; they hold where they say something.
        labels: Option<PathBuf> = None, "", ANY;
        /// CityJSON file whose footprints are the buildings, each by itself and under its name.
        footprints: Option<PathBuf> = None, "", ANY;
        /// How the ground is found.
        terrain: TerrainModel = TerrainModel::Surface, "", ANY;
        /// Cell of the ground surface.
        terrain_cell: f64 = 2.0, "m", within(0.5, 20.0);
        /// Smallest area of a building.
        min_area: f64 = 8.0, "m²", within(0.0, 1000.0);
        /// Smallest mean height of a building above the ground; what is lower is ground. 0 for no limit.
        min_height: f64 = 0.0, "m", within(0.0, 50.0);
        /// Edge of the patches that are labelled at once, on a lattice that does not depend on the grid.
        patch: usize = 512, "px", within(64.0, 4096.0);
        /// Overlap of a patch with its neighbours on every side.
        margin: usize = 64, "px", within(0.0, 1024.0);
    }
}

parameters! {
    /// How a building gets its shape.
    pub struct ModelingParams {
        /// Whose rules find the roof.
        method: String = Registry::get().reconstructions()[0].name().to_owned(), "", ANY;
        /// CityJSON file whose LOD2 roof planes are used in place of those that would be found, where the method can.
        roofs: Option<PathBuf> = None, "", ANY;
        /// A step in the roof of at least this height may be a party wall between two buildings; 0 leaves a connected component whole.
        party_wall_step: f64 = gable_modeling::ModelParams::default().party_wall_step, "m", within(0.0, 100.0);
        /// Counted work for each pixel of a building, after which it gets a simpler model with its reason: fewer planes, or blocks.
        work: usize = gable_modeling::ModelParams::default().work, "1/px", within(1.0, 1e9);
    }
}

parameters! {
    /// What is written.
    pub struct OutputParams {
        /// Formats, joined by commas.
        formats: Vec<Format> = vec![Format::CityJson, Format::CityJsonSeq, Format::CityGml], "", ANY;
        /// Title of the data set; empty for the name of the input.
        title: String = String::new(), "", ANY;
        /// Identifier of the data set.
        identifier: String = String::new(), "", ANY;
        /// Day that the data stand for, such as that of the flight: YYYY-MM-DD.
        reference_date: String = String::new(), "", ANY;
        /// Name of the person or organisation to ask about the data set.
        contact_name: String = String::new(), "", ANY;
        /// Its address for electronic mail.
        contact_email: String = String::new(), "", ANY;
        /// Where the data come from, and what was done to them, in a sentence or two.
        lineage: String = String::new(), "", ANY;
        /// Height of the zero of heights above the ellipsoid, for 3D Tiles; auto takes the geoid of EGM96 where the system names heights above the sea, else 0.
        geoid: String = "auto".to_owned(), "m", ANY;
        /// Whether the terrain is written.
        terrain: bool = true, "", ANY;
        /// How far the written terrain may lie from the ground surface.
        terrain_tolerance: f64 = 0.25, "m", within(0.01, 10.0);
        /// Whether the labels are written as pictures, for training and for measuring.
        labels: bool = false, "", ANY;
        /// Whether report.html and report.json are written.
        report: bool = true, "", ANY;
    }
}

parameters! {
    /// What passes as valid (ISO 19107).
    pub struct ValidationParams {
        /// Vertices closer than this are one.
        snap: f64 = 0.001, "m", within(0.0, 0.1);
        /// How far a vertex may lie from the plane of its face.
        planarity: f64 = 0.01, "m", within(1e-6, 1.0);
        /// How far the normals of a face's triangles may turn from the face's.
        normals: f64 = 20.0, "°", within(0.1, 90.0);
    }
}

parameters! {
    /// What the run may use; nothing of the result depends on it.
    pub struct ResourceParams {
        /// Threads; 0 for one on each core.
        threads: usize = 0, "", within(0.0, 1024.0);
        /// Memory that the run aims to stay under.
        memory: usize = 2048, "MB", within(256.0, 1_048_576.0);
        /// Decoded textures that are kept.
        texture_cache: usize = 256, "MB", within(16.0, 65_536.0);
    }
}

/// Makes [`Params`] of its groups.
macro_rules! groups {
    ($($group:ident: $Group:ident, $help:literal;)+) => {
        /// Every parameter of a run, by group; values of methods' own parameters are behind [`Params::value`].
        #[derive(Clone, Debug, Default, PartialEq)]
        pub struct Params {
            $(#[doc = $help] pub $group: $Group,)+
            /// What was set of the parameters that methods declare.
            pub(super) own: super::own::OwnSettings,
        }

        /// The groups in the order of the work, each with one line of help.
        pub const GROUPS: &[(&str, &str)] = &[$((stringify!($group), $help)),+];

        /// The parameters that a group's stage declares.
        pub(super) fn declarations(group: &str) -> &'static [gable_parameters::Declaration] {
            match group {
                $(stringify!($group) => <$Group>::declarations(),)+
                _ => &[],
            }
        }

        impl Params {
            /// The value of a stage's parameter.
            pub(super) fn stage_value(&self, group: &str, name: &str) -> Option<String> {
                match group {
                    $(stringify!($group) => self.$group.value(name),)+
                    _ => None,
                }
            }

            /// Sets a stage's parameter.
            pub(super) fn set_stage_value(&mut self, group: &str, name: &str, text: &str) -> Result<(), String> {
                match group {
                    $(stringify!($group) => self.$group.set(name, text),)+
                    _ => Err(format!("a group that there is, not {group}")),
                }
            }
        }
    };
}

groups! {
    input: InputParams, "How the mesh is read.";
    grid: GridParams, "How the city is cut into blocks, which become the tiles of the output.";
    sampling: SamplingParams, "How the mesh is turned into rasters.";
    segmentation: SegmentationParams, "How pixels get their labels: ground, grass, tree, building.";
    modeling: ModelingParams, "How a building gets its shape.";
    output: OutputParams, "What is written.";
    validation: ValidationParams, "What passes as valid (ISO 19107).";
    resources: ResourceParams, "What the run may use; nothing of the result depends on it.";
}
