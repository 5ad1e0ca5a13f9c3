//! The one list of parameters: name, unit, default, range and help of each.
//!
//! To add one, write its line here. The typed field of [`Params`](super::Params), `gable params`, `--set`,
//! the config file, the checks and the hash all come from it. A default that belongs to a method is the one of the
//! method's crate.

use super::kind::{ANY, Bounds, Features, Format, Kind, Method, TerrainModel, Up, within};
use gable_segmentation::{RegionParams, SegmentParams};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// One parameter, as it is declared.
#[derive(Debug)]
pub struct Parameter {
    /// Full name, `group.name`.
    pub name: &'static str,
    /// Group: the stage that it belongs to.
    pub group: &'static str,
    /// `number`, `integer`, `switch`, `choice`, `list`, `text` or `file`.
    pub kind: &'static str,
    /// Unit, empty for bare numbers.
    pub unit: &'static str,
    /// Limits, for numbers.
    pub bounds: Option<Bounds>,
    /// What can be chosen, for switches, choices and lists.
    pub choices: &'static [&'static str],
    /// One line of help.
    pub help: &'static str,
    /// The value as text.
    pub(super) get: fn(&Params) -> String,
    /// The value as a number, to be held against the limits.
    pub(super) number: fn(&Params) -> Option<f64>,
    /// Sets the value from text; the error says what was expected.
    pub(super) set: fn(&mut Params, &str) -> Result<(), String>,
}

macro_rules! parameters {
    ($(
        #[doc = $group_help:literal]
        $group:ident: $Group:ident {
            $(#[doc = $help:literal] $name:ident: $Type:ty = $default:expr, $unit:literal, $bounds:expr;)+
        }
    )+) => {
        /// Every parameter of a run, by group.
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct Params {
            $(#[doc = $group_help] pub $group: $Group,)+
        }

        $(
            #[doc = $group_help]
            #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
            #[serde(default, deny_unknown_fields)]
            pub struct $Group {
                $(#[doc = $help] pub $name: $Type,)+
            }

            impl Default for $Group {
                fn default() -> Self {
                    Self { $($name: $default,)+ }
                }
            }
        )+

        /// The groups in the order of the work, each with one line of help.
        pub const GROUPS: &[(&str, &str)] = &[$((stringify!($group), $group_help.trim_ascii())),+];

        /// Every parameter, in the order of declaration.
        pub static PARAMETERS: &[Parameter] = &[$($(
            Parameter {
                name: concat!(stringify!($group), ".", stringify!($name)),
                group: stringify!($group),
                kind: <$Type as Kind>::NAME,
                unit: $unit,
                bounds: $bounds,
                choices: <$Type as Kind>::CHOICES,
                help: $help.trim_ascii(),
                get: |params| Kind::show(&params.$group.$name),
                number: |params| Kind::number(&params.$group.$name),
                set: |params, text| {
                    params.$group.$name = Kind::parse(text)?;
                    Ok(())
                },
            },
        )+)+];
    };
}

parameters! {
    /// How the mesh is read.
    input: InputParams {
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
    /// How the city is cut into blocks, which become the tiles of the output.
    grid: GridParams {
        /// Blocks from west to east; 0 for a number that fits: blocks of 100 m or more, at most 16.
        columns: usize = 0, "", within(0.0, 1024.0);
        /// Blocks from south to north; 0 for a number that fits: blocks of 100 m or more, at most 16.
        rows: usize = 0, "", within(0.0, 1024.0);
        /// Edge of a block instead of columns and rows; 0 for columns and rows.
        block_size: f64 = 0.0, "m", within(0.0, 100_000.0);
    }
    /// How the mesh is turned into rasters.
    sampling: SamplingParams {
        /// Edge of a pixel.
        step: f64 = 0.2, "m", within(0.02, 5.0);
    }
    /// How pixels get their labels: ground, grass, tree, building.
    segmentation: SegmentationParams {
        /// Whose data term: gable (likelihoods) or zhu2018 (Eq. 4).
        method: Method = Method::Gable, "", ANY;
        /// What the tree classifier looks at.
        features: Features = Features::Auto, "", ANY;
        /// Weights of the tree classifier made by gable train; empty for those that are built in.
        weights: Option<PathBuf> = None, "", ANY;
        /// Folder of label pictures, as gable run and gable synth write them, that hold where they say something.
        labels: Option<PathBuf> = None, "", ANY;
        /// CityJSON file whose footprints are the buildings, each by itself and under its name.
        footprints: Option<PathBuf> = None, "", ANY;
        /// How the ground is found.
        terrain: TerrainModel = TerrainModel::Surface, "", ANY;
        /// Cell of the ground surface.
        terrain_cell: f64 = 2.0, "m", within(0.5, 20.0);
        /// Weight of smoothness against data (Zhu 2018, Eq. 6).
        mu: f64 = SegmentParams::default().smoothness, "", within(0.0, 100.0);
        /// Share of the smoothness that is left across steps of a metre and more.
        step_smoothness: f64 = SegmentParams::default().step_smoothness, "", within(0.0, 1.0);
        /// Height above ground at which a pixel is as likely low as high (Zhu 2018, Eq. 3).
        h_trunc: f64 = SegmentParams::default().height, "m", within(0.5, 20.0);
        /// Steepness of the logistic function of height (Zhu 2018, Eq. 3).
        steepness: f64 = SegmentParams::default().steepness, "1/m", within(0.1, 20.0);
        /// Weight of the tree probability against that of height, for the method gable.
        tree_weight: f64 = SegmentParams::default().tree_weight, "", within(0.0, 10.0);
        /// Share of plants in the scene, for the method gable.
        tree_share: f64 = SegmentParams::default().tree_share, "", within(0.01, 0.99);
        /// Least likelihood of anything, for the method gable.
        doubt: f64 = SegmentParams::default().doubt, "", within(0.0, 0.5);
        /// Radius of the opening that removes specks and spikes of buildings.
        opening: f64 = SegmentParams::default().cleanup.opening, "m", within(0.0, 10.0);
        /// Radius of the closing that fills gaps in buildings.
        closing: f64 = SegmentParams::default().cleanup.closing, "m", within(0.0, 10.0);
        /// Holes in a building up to this area become building.
        hole_area: f64 = SegmentParams::default().cleanup.hole_area, "m²", within(0.0, 1000.0);
        /// Trees up to this area that a building encloses on most sides become building.
        roof_tree_area: f64 = SegmentParams::default().cleanup.roof_tree_area, "m²", within(0.0, 1000.0);
        /// Buildings within one patch whose mean tree probability exceeds this are trees.
        building_tree_share: f64 = SegmentParams::default().cleanup.building_tree_share, "", within(0.0, 1.0);
        /// Buildings whose mean drop at the border to open ground is a smaller share of their mean height than this are none.
        wall_share: f64 = RegionParams::default().wall_share, "", within(0.0, 1.0);
        /// Buildings of a smaller probability are trees: it falls with plants seen on them and trees around that they do not stand off.
        probability: f64 = RegionParams::default().probability, "", within(0.0, 1.0);
        /// Buildings of 29 m² and more are none if a smaller share of them is as wide as the least width: lorries, containers, walls.
        narrow_share: f64 = RegionParams::default().long_core_share, "", within(0.0, 1.0);
        /// Buildings that are hardly anywhere as wide as this are none.
        min_width: f64 = 2.0 * RegionParams::default().half_width, "m", within(0.0, 20.0);
        /// Smallest area of a building.
        min_area: f64 = 8.0, "m²", within(0.0, 1000.0);
        /// Smallest height of a building above the ground, as the median over its pixels.
        min_height: f64 = 2.0, "m", within(0.0, 50.0);
        /// Edge of the patches that are labelled at once, on a lattice that does not depend on the grid.
        patch: usize = 512, "px", within(64.0, 4096.0);
        /// Overlap of a patch with its neighbours on every side.
        margin: usize = 64, "px", within(0.0, 1024.0);
    }
    /// How a building gets its shape.
    modeling: ModelingParams {
        /// Whose rules: gable or zhu2018.
        method: Method = Method::Gable, "", ANY;
        /// Faces within this angle of the vertical are facades.
        facade_angle: f64 = gable_modeling::Params::default().facade_angle, "°", within(1.0, 60.0);
        /// CityJSON file whose LOD2 roof planes are used in place of those that would be found, for the method gable.
        roofs: Option<PathBuf> = None, "", ANY;
        /// How far a roof point may lie from its plane.
        plane_distance: f64 = gable_modeling::Params::default().plane_distance, "m", within(0.02, 5.0);
        /// How far a roof point's normal may turn from its plane's.
        plane_angle: f64 = gable_modeling::Params::default().plane_angle, "°", within(1.0, 60.0);
        /// Smallest area of a roof plane.
        plane_area: f64 = gable_modeling::Params::default().plane_area, "m²", within(0.1, 100.0);
        /// Most planes of one building.
        max_planes: usize = gable_modeling::Params::default().max_planes, "", within(1.0, 10_000.0);
        /// Shortest line segment that is kept.
        line_length: f64 = gable_modeling::Params::default().line_length, "m", within(0.1, 50.0);
        /// Parallel segments closer than this become one (Zhu 2018, §5.2).
        collinear: f64 = gable_modeling::Params::default().collinear, "m", within(0.0, 5.0);
        /// Segments grow by this times their length at most before they slice the plane.
        extension: f64 = gable_modeling::Params::default().extension, "", within(0.0, 20.0);
        /// Cells smaller than this join a neighbour.
        min_cell_area: f64 = gable_modeling::Params::default().min_cell_area, "m²", within(0.0, 50.0);
        /// Parts on a roof that are smaller than this, and set off from it by steps, are left out, by the method gable.
        superstructure_area: f64 = gable_modeling::Params::default().superstructure_area, "m²", within(0.0, 1000.0);
        /// Weight of smoothness against data (Zhu 2018, Eq. 11) for the method gable: of a metre of border, against cubic metres.
        beta: f64 = gable_modeling::Params::default().beta, "m³/m", within(0.0, 1000.0);
        /// The same for the method zhu2018, where data is summed over pixels and not over area.
        beta_pixel: f64 = gable_modeling::Params::default().beta_pixel, "m/m", within(0.0, 100_000.0);
        /// A step in the roof of at least this height may be a party wall between two buildings; 0 leaves what hangs together whole.
        party_wall_step: f64 = gable_modeling::Params::default().party_wall_step, "m", within(0.0, 100.0);
        /// Counted work for each pixel of a building, after which it gets a simpler model with its reason: fewer planes, or blocks.
        work: usize = gable_modeling::Params::default().work, "1/px", within(1.0, 1e9);
    }
    /// What is written.
    output: OutputParams {
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
    /// What passes as valid (ISO 19107).
    validation: ValidationParams {
        /// Vertices closer than this are one.
        snap: f64 = 0.001, "m", within(0.0, 0.1);
        /// How far a vertex may lie from the plane of its face.
        planarity: f64 = 0.01, "m", within(1e-6, 1.0);
        /// How far the normals of a face's triangles may turn from the face's.
        normals: f64 = 20.0, "°", within(0.1, 90.0);
    }
    /// What the run may use; nothing of the result depends on it.
    resources: ResourceParams {
        /// Threads; 0 for one on each core.
        threads: usize = 0, "", within(0.0, 1024.0);
        /// Memory that the run aims to stay under.
        memory: usize = 2048, "MB", within(256.0, 1_048_576.0);
        /// Decoded textures that are kept.
        texture_cache: usize = 256, "MB", within(16.0, 65_536.0);
    }
}
