//! The command line: arguments, help and examples.

mod city;
mod remote;
mod schedule;
mod sign_in;
mod token;

pub(crate) use city::{AuditArgs, CityAction, CityArgs, OneCityArgs, UploadAction, UploadArgs};
pub(crate) use remote::{
    CancelArgs, DeleteArgs, DownloadArgs, JobArgs, RemoteArgs, RetryArgs, Send, StatusArgs, SubmitArgs,
};
pub(crate) use schedule::{CreateArgs, ListArgs, NameArgs, ScheduleAction, ScheduleArgs};
pub(crate) use sign_in::SignInArgs;
pub(crate) use token::{NewTokenArgs, TokenAction, TokenArgs};

use clap::builder::styling::{AnsiColor, Styles};
use clap::{Args, Parser, Subcommand};
use std::path::PathBuf;

const STYLES: Styles = Styles::styled()
    .header(AnsiColor::Green.on_default().bold())
    .usage(AnsiColor::Green.on_default().bold())
    .literal(AnsiColor::Cyan.on_default().bold())
    .placeholder(AnsiColor::Cyan.on_default());

const MAIN_HELP: &str = "\
Examples:
  gable demo                                        make a small city, model it, measure the result
  gable run mesh.obj --out city                     one OBJ file with its MTL and textures
  gable run Production_1 --out city --grid 32x32    a folder of OBJ tiles with metadata.xml
  gable run scan.ply --out city --crs EPSG:25832    a mesh whose file does not tell its reference system
  gable params                                      every parameter with unit, default and range

Exit codes:
  0 success   1 failure   2 wrong usage or bad input   3 partial result   130 interrupted

Logs go to standard error; RUST_LOG (such as RUST_LOG=gable=debug) says which.";

/// From the textured photogrammetry mesh of a city to CityGML and CityJSON buildings.
#[derive(Debug, Parser)]
#[command(name = "gable", version, styles = STYLES, after_help = MAIN_HELP, arg_required_else_help = true)]
pub(crate) struct Cli {
    #[command(flatten)]
    pub(crate) global: GlobalArgs,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Arguments of every command.
#[derive(Debug, Args)]
pub(crate) struct GlobalArgs {
    /// Tell more: -v what is done, -vv details, -vvv everything
    #[arg(short, long, global = true, action = clap::ArgAction::Count, conflicts_with = "quiet")]
    pub(crate) verbose: u8,
    /// Errors only: no progress, no warnings, no summary (figures of demo, eval and params are still printed)
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Turn a city mesh into a city model
    Run(RunArgs),
    /// Make a small city with known truth, model it, and measure the result
    Demo(DemoArgs),
    /// Measure a result against the truth
    Eval(EvalArgs),
    /// Make a city mesh with known truth, with the defects of photogrammetry
    Synth(SynthArgs),
    /// Make, model and measure named scenes, and write one table
    Bench(BenchArgs),
    /// Train the tree classifier on labelled rasters
    Train(TrainArgs),
    /// List every parameter with unit, default and range
    Params(ParamsArgs),
    /// Take jobs over REST, and with --all do them too
    Serve(ServeArgs),
    /// Do the tasks of jobs
    Work(WorkArgs),
    /// Make, list, rotate and revoke the tokens that open the service
    Token(TokenArgs),
    /// Submit a job to a service
    Submit(SubmitArgs),
    /// Show a job of a service, or list jobs
    Status(StatusArgs),
    /// Cancel a job of a service
    Cancel(CancelArgs),
    /// Do what failed of a job again
    Retry(RetryArgs),
    /// Fetch the files of a job or of a city from a service
    Download(DownloadArgs),
    /// Show cities, say who their members are, roll them back
    City(CityArgs),
    /// List and delete the meshes that were sent to a service
    Upload(UploadArgs),
    /// Delete a job of a service that is over
    Delete(DeleteArgs),
    /// Show who did what with a service
    Audit(AuditArgs),
    /// Submit jobs by the clock
    Schedule(ScheduleArgs),
    /// Do one task, as a worker asks on standard input
    #[command(hide = true)]
    Task(TaskArgs),
}

impl Command {
    /// How log lines look, for the commands of the service; others log for people.
    pub(crate) fn log_format(&self) -> Option<LogFormat> {
        match self {
            Self::Serve(args) => Some(args.keep.log_format),
            Self::Work(args) => Some(args.keep.log_format),
            _ => None,
        }
    }

    /// Whether the result goes to standard output as JSON.
    pub(crate) fn json(&self) -> bool {
        match self {
            Self::Run(args) => args.json,
            Self::City(args) => args.json,
            Self::Upload(args) => args.json,
            Self::Delete(args) => args.of.json,
            Self::Audit(args) => args.json,
            Self::Demo(args) => args.json,
            Self::Eval(args) => args.json,
            Self::Synth(args) => args.json,
            Self::Bench(args) => args.json,
            Self::Train(args) => args.json,
            Self::Params(args) => args.json,
            Self::Token(args) => args.json,
            Self::Submit(args) => args.json,
            Self::Status(args) => args.json,
            Self::Cancel(args) => args.of.json,
            Self::Retry(args) => args.of.json,
            Self::Download(args) => args.json,
            Self::Schedule(args) => args.json(),
            Self::Serve(_) | Self::Work(_) | Self::Task(_) => false,
        }
    }
}

const RUN_HELP: &str = "\
Examples:
  gable run mesh.obj --out city
  gable run Production_1 --out city --block-size 200 --preset fast
  gable run scan.off --out city --grid 1x1 --step 0.1 --set modeling.plane_distance=0.2
  gable run mesh.glb --out city --up y --crs EPSG:7415 --json > summary.json
  gable run mesh.obj --out baseline --preset zhu2018

INPUT is an OBJ, PLY, OFF, GLB or glTF file, a tileset.json, or a folder of tiles as photogrammetry programs
write it, with or without metadata.xml.

DIR gets city.city.jsonl, tiles/*.city.json, tiles/*.gml, index.json, report.html and report.json.
After an interruption the same command goes on where it was.";

/// Arguments of `gable run`.
#[derive(Debug, Args)]
#[command(after_help = RUN_HELP)]
pub(crate) struct RunArgs {
    /// Mesh file, or folder of mesh tiles
    pub(crate) input: PathBuf,
    /// Folder for the result; made if it is not there
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Folder in which the mesh, and all that it names, has to lie; may be given many times. By default a mesh may name any
    /// file that you may read: give this for a mesh from somebody whom you do not trust
    #[arg(long = "source-root", value_name = "DIR")]
    pub(crate) source_roots: Vec<PathBuf>,
    /// Print the summary as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) params: ParamArgs,
}

/// Arguments that set parameters.
#[derive(Debug, Args, Default)]
#[command(next_help_heading = "Parameters (gable params lists all)")]
pub(crate) struct ParamArgs {
    /// Values from a TOML file
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// A named set of values: default, zhu2018, fast, fine
    #[arg(long, value_name = "NAME")]
    pub(crate) preset: Option<String>,
    /// Set any parameter; may be given many times
    #[arg(long = "set", value_name = "NAME=VALUE")]
    pub(crate) settings: Vec<String>,
    /// Edge of a pixel, metres
    #[arg(long, value_name = "M")]
    pub(crate) step: Option<String>,
    /// Blocks, as columns x rows, or auto: at least 100 m along each edge, at most 16x16 [default: auto]
    #[arg(long, value_name = "CxR", conflicts_with = "block_size")]
    pub(crate) grid: Option<String>,
    /// Edge of a block, metres, instead of --grid
    #[arg(long, value_name = "M")]
    pub(crate) block_size: Option<String>,
    /// Whose rules every stage follows that has a method of this name, such as zhu2018; gable params lists all
    #[arg(long, value_name = "NAME")]
    pub(crate) method: Option<String>,
    /// Which axis of the input points up: auto, z, y, -z, -y
    #[arg(long, value_name = "AXIS", allow_hyphen_values = true)]
    pub(crate) up: Option<String>,
    /// Reference system: EPSG:code, EPSG:code+code of heights, or ENU:latitude,longitude
    #[arg(long, value_name = "CRS")]
    pub(crate) crs: Option<String>,
    /// What is added to the coordinates, in the units of the reference system [default: what files beside the mesh say]
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true)]
    pub(crate) origin: Option<String>,
    /// Of 3D Tiles, how far from the finest shape the tiles that are read may be, metres [default: 0, the finest]
    #[arg(long, value_name = "M")]
    pub(crate) error: Option<String>,
    /// Refuse a mesh with damage that else is left out and counted: vertices that are no numbers, damaged files among others
    #[arg(long)]
    pub(crate) strict: bool,
    /// Output formats, joined by commas: cityjson, cityjsonseq, citygml, 3dtiles, mesh-3dtiles, citygml3, obj,
    /// glb, geotiff, geopackage, flatgeobuf, geojson
    #[arg(long, value_name = "LIST")]
    pub(crate) formats: Option<String>,
    /// Threads; 0 for one on each core
    #[arg(long, value_name = "N")]
    pub(crate) threads: Option<String>,
    /// Memory to stay under, MB
    #[arg(long, value_name = "MB")]
    pub(crate) memory: Option<String>,
}

const DEMO_HELP: &str = "\
Examples:
  gable demo
  gable demo --out demo --seed 7 --area 0.05
  gable demo --preset zhu2018 --json

Makes a city of gabled, hipped, flat and L-shaped houses on sloping ground as a textured mesh with the
defects of photogrammetry (DIR/city), models it (DIR/result), and measures the models against the truth.";

/// Arguments of `gable demo`.
#[derive(Debug, Args)]
#[command(after_help = DEMO_HELP)]
pub(crate) struct DemoArgs {
    /// Folder for the city, the result and the report
    #[arg(short, long, value_name = "DIR", default_value = "gable-demo")]
    pub(crate) out: PathBuf,
    /// Seed of the city
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Area of the city, km²
    #[arg(long, value_name = "KM2", default_value_t = 0.03)]
    pub(crate) area: f64,
    /// Print the figures as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) params: ParamArgs,
}

const EVAL_HELP: &str = "\
Examples:
  gable eval --truth city/truth --result result
  gable eval --truth delft.city.jsonl --result result --mesh delft/mesh --json > figures.json
  gable eval --truth city/truth --result result --again result-16x16
  gable eval --result result --mesh scan.off

A truth or a result is a CityJSON or CityJSONSeq file, or a folder that gable synth or gable run has made.
Completeness, correctness, footprint IoU, roof errors, distances, complexity, validity, regularity; and the
labels, where both are folders with labels (gable run --set output.labels=true). Without --truth: complexity,
validity, regularity, and distances to the mesh.";

/// Arguments of `gable eval`.
#[derive(Debug, Args)]
#[command(after_help = EVAL_HELP)]
pub(crate) struct EvalArgs {
    /// The truth: a file, or the folder truth of gable synth; without it, what can be said of the result alone
    #[arg(long, value_name = "PATH")]
    pub(crate) truth: Option<PathBuf>,
    /// The result to judge: a file, or the folder of gable run
    #[arg(long, value_name = "PATH")]
    pub(crate) result: PathBuf,
    /// The mesh that the result was made from, for distances to it
    #[arg(long, value_name = "PATH")]
    pub(crate) mesh: Option<PathBuf>,
    /// Another result of the same city, to be compared building by building
    #[arg(long, value_name = "PATH", requires = "truth")]
    pub(crate) again: Option<PathBuf>,
    /// Where the report with pictures goes; by default evaluation.html in the folder of the result
    #[arg(long, value_name = "FILE", requires = "truth")]
    pub(crate) report: Option<PathBuf>,
    /// Print the figures as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

const SYNTH_HELP: &str = "\
Examples:
  gable synth --procedural --seed 1 --area 0.05 --out city
  gable synth --truth delft.city.jsonl --out delft --density 7.5 --slope 0.05
  gable synth --truth delft.city.jsonl --repeat 3 --out large
  gable synth --case cross-gable --noise 0 --out case

DIR gets mesh/ (OBJ tiles with textures and metadata.xml) and truth/ (models, labels, terrain, trees).
The same arguments give the same bytes.";

/// Arguments of `gable synth`.
#[derive(Debug, Args)]
#[command(after_help = SYNTH_HELP)]
#[command(group(clap::ArgGroup::new("source").required(true).args(["procedural", "truth", "case", "place"])))]
pub(crate) struct SynthArgs {
    /// A town of procedural houses
    #[arg(long)]
    pub(crate) procedural: bool,
    /// Buildings of a CityJSON or CityJSONSeq file with LOD2 solids
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// One small scene with a roof of a certain kind, such as hip or l-shape
    #[arg(long, value_name = "NAME")]
    pub(crate) case: Option<String>,
    /// A place as real ones are: town, village, farm, campus, industry, high-rise, open; or any, of which everything is drawn, its look too
    #[arg(long, value_name = "NAME")]
    pub(crate) place: Option<String>,
    /// What a place has besides, joined by commas, such as terraces, grove or rim
    #[arg(long, value_name = "LIST", value_delimiter = ',', requires = "place")]
    pub(crate) with: Vec<String>,
    /// Side of the square of a place, metres
    #[arg(long, value_name = "M", default_value_t = 160.0)]
    pub(crate) side: f64,
    /// Folder for the mesh and its truth
    #[arg(short, long, value_name = "DIR")]
    pub(crate) out: PathBuf,
    /// Seed of everything that is drawn
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// Area of a procedural town, km²
    #[arg(long, value_name = "KM2", default_value_t = 0.05)]
    pub(crate) area: f64,
    /// Copies of the truth in each direction, each turned or mirrored
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) repeat: u32,
    /// Faces for each m² of ground
    #[arg(long, value_name = "N", default_value_t = 7.5)]
    pub(crate) density: f64,
    /// Slope of the ground, metres per metre
    #[arg(long, value_name = "S", default_value_t = 0.05)]
    pub(crate) slope: f64,
    /// Strength of the defects: 0 none, 1 as measured on a real mesh
    #[arg(long, value_name = "N", default_value_t = 1.0)]
    pub(crate) noise: f64,
    /// Edge of a mesh tile, metres
    #[arg(long, value_name = "M", default_value_t = 80.0)]
    pub(crate) tile_size: f64,
    /// Write no textures
    #[arg(long)]
    pub(crate) no_texture: bool,
    /// Edge of a texel, metres
    #[arg(long, value_name = "M", default_value_t = 0.1)]
    pub(crate) texel: f64,
    /// Colour cast: gains of red, green and blue, joined by commas
    #[arg(long, value_name = "R,G,B", value_delimiter = ',', default_values_t = [1.0, 1.0, 1.0])]
    pub(crate) cast: Vec<f64>,
    /// Season: spring, summer, drought, autumn, winter, snow
    #[arg(long, value_name = "NAME", default_value = "summer")]
    pub(crate) season: String,
    /// Print what was made as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

const BENCH_HELP: &str = "\
Examples:
  gable bench house block
  gable bench district --truth delft.city.jsonl --write tests/benchmarks
  gable bench block --rows default,planes --tuning --json
  gable bench block --variants --grids --one-thread
  gable bench district --leave-out \"district:zhu2018=an hour of modelling\" --write tests/benchmarks
  gable bench places --write tests/benchmarks
  gable bench places --only terraces,rim --keep
  gable bench real --write tests/benchmarks
  gable bench real --only yard,farm --keep
  gable bench real --tuning --set segmentation.tree_weight=2

Scenes: house 0.01, block 0.048, district 1.38, city 12.2 km². Rows: default, zhu2018 (the published method), and the
oracles, which are fed with truth: labels; footprints; planes (with footprints). What a stage loses is the
difference between two rows. Every step is a process of its own, whose time and peak memory are told.

The scene `places` stands for small places with what real ones have and the town has not, one row for each quarter, landform, kind of
plants, material and fault of the mesh; a picture of each shows what is true and what was found.

The scene `real` stands for all real meshes that scenes.json in the folder of --outlines names, as far as they are among the
test data, against outlines drawn by hand; a picture of each shows what was drawn and what was found.";

/// Arguments of `gable bench`.
#[derive(Debug, Args)]
#[command(after_help = BENCH_HELP)]
pub(crate) struct BenchArgs {
    /// Scenes: house, block, district, city; give at least one. Or places or real, which stand by themselves
    #[arg(required = true)]
    pub(crate) scenes: Vec<String>,
    /// Rows, joined by commas; all if not given
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) rows: Vec<String>,
    /// Folder for scenes and results
    #[arg(short, long, value_name = "DIR", default_value = "gable-bench")]
    pub(crate) out: PathBuf,
    /// Buildings of district and city from a CityJSON file, instead of procedural ones
    #[arg(long, value_name = "FILE")]
    pub(crate) truth: Option<PathBuf>,
    /// A row of a scene that is not run; the reason stands in the table; may be given many times
    #[arg(long, value_name = "SCENE:ROW=REASON")]
    pub(crate) leave_out: Vec<String>,
    /// Besides, the default row on harder scenes: slope 15 %, 3 and 15 faces per m², no texture, noise × 2
    #[arg(long)]
    pub(crate) variants: bool,
    /// Besides, the default row in 1x1 and 16x16 blocks, compared building by building
    #[arg(long)]
    pub(crate) grids: bool,
    /// Besides, the default row on one thread
    #[arg(long)]
    pub(crate) one_thread: bool,
    /// Other seeds: those that may be tuned on; of real, the half that may be tuned on
    #[arg(long)]
    pub(crate) tuning: bool,
    /// Faces for each m² of ground
    #[arg(long, value_name = "N", default_value_t = 7.5)]
    pub(crate) density: f64,
    /// Slope of the ground, metres per metre
    #[arg(long, value_name = "S", default_value_t = 0.05)]
    pub(crate) slope: f64,
    /// Set any parameter of the runs; may be given many times
    #[arg(long = "set", value_name = "NAME=VALUE", conflicts_with = "write")]
    pub(crate) settings: Vec<String>,
    /// Folder whose README.md gets the table
    #[arg(long, value_name = "DIR")]
    pub(crate) write: Option<PathBuf>,
    /// Keep scenes and results
    #[arg(long)]
    pub(crate) keep: bool,
    /// Of real and places: these meshes or rows, joined by commas; all if not given
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub(crate) only: Vec<String>,
    /// Of real: the folder of the meshes
    #[arg(long, value_name = "DIR", env = "GABLE_TEST_DATA", default_value = "../shared/data")]
    pub(crate) data: PathBuf,
    /// Of real: the folder of scenes.json and the outlines
    #[arg(long, value_name = "DIR", default_value = "tests/real")]
    pub(crate) outlines: PathBuf,
    /// Of real: the name of the row, under which the table keeps it
    #[arg(long, value_name = "NAME", default_value = "today")]
    pub(crate) row: String,
    /// Of real: measure the meshes thinned to so many faces for each m² and without texture; the row is named by it
    #[arg(long, value_name = "N", value_parser = positive, conflicts_with = "row")]
    pub(crate) thin: Option<f64>,
    /// Print the records as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

/// A number above 0.
fn positive(text: &str) -> Result<f64, String> {
    text.trim()
        .parse()
        .ok()
        .filter(|n: &f64| n.is_finite() && *n > 0.0)
        .ok_or_else(|| "give a number above 0".to_owned())
}

const TRAIN_HELP: &str = "\
Examples:
  gable train --images ortho --masks trees --step 0.25 --out weights.json
  gable train --city spring --city summer --features full --out weights.json
  gable train --mesh real.obj --labels corrected --city spring --features full --out weights.json
  gable train --mesh real.obj --labels real.geojson --thin 0.7,0.1 --features geometric --out weights.json
  gable run mesh.obj --out city --set segmentation.weights=weights.json --set segmentation.features=full

Images and masks are PNG or JPEG of the same name and size: in a mask black is no tree, white tree, grey not
looked at. The part of a name before the first _ or - is its source; figures are given for each source by a
model that did not see it. A city is a folder that gable synth has made. Labels are the pictures that
gable run --set output.labels=true writes, corrected by hand, or outlines as in tests/real: GeoJSON polygons in
the frame of the mesh with a property class of building, tree, grass, ground or others.";

/// Arguments of `gable train`.
#[derive(Debug, Args)]
#[command(after_help = TRAIN_HELP)]
#[command(group(clap::ArgGroup::new("samples").required(true).multiple(true).args(["images", "cities", "meshes"])))]
pub(crate) struct TrainArgs {
    /// Folder of orthophotos
    #[arg(long, value_name = "DIR", requires = "masks")]
    pub(crate) images: Option<PathBuf>,
    /// Folder of masks for them
    #[arg(long, value_name = "DIR", requires = "images")]
    pub(crate) masks: Option<PathBuf>,
    /// City with truth; may be given many times
    #[arg(long = "city", value_name = "DIR")]
    pub(crate) cities: Vec<PathBuf>,
    /// Mesh whose labels were corrected; may be given many times, each with --labels
    #[arg(long = "mesh", value_name = "PATH", requires = "labels")]
    pub(crate) meshes: Vec<PathBuf>,
    /// Result folder with the labels of that mesh, or a .geojson file with outlines in it
    #[arg(long, value_name = "PATH", requires = "meshes")]
    pub(crate) labels: Vec<PathBuf>,
    /// Learn from each --mesh also thinned to so many faces for each m² and without its texture, joined by commas; for geometric
    #[arg(long, value_name = "LIST", value_delimiter = ',', value_parser = positive, requires = "meshes")]
    pub(crate) thin: Vec<f64>,
    /// Edge of a pixel, metres
    #[arg(long, value_name = "M", default_value_t = 0.2)]
    pub(crate) step: f64,
    /// What the classifier looks at: zhu27 (colour), full (colour and geometry) or geometric
    #[arg(long, value_name = "SET", default_value = "zhu27")]
    pub(crate) features: String,
    /// Stumps
    #[arg(long, value_name = "N")]
    pub(crate) rounds: Option<usize>,
    /// Seed of the samples
    #[arg(long, value_name = "N")]
    pub(crate) seed: Option<u64>,
    /// File for the weights
    #[arg(short, long, value_name = "FILE")]
    pub(crate) out: PathBuf,
    /// Print the scores as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

const PARAMS_HELP: &str = "\
Examples:
  gable params
  gable params modeling
  gable params --preset fine --json

Set a parameter by --set NAME=VALUE, or in the file of --config:
  preset = \"fast\"
  [sampling]
  step = 0.3

NAME may be short (step) where that is unique. Later ones win: defaults, preset, config file, flags.";

/// Arguments of `gable params`.
#[derive(Debug, Args)]
#[command(after_help = PARAMS_HELP)]
pub(crate) struct ParamsArgs {
    /// Only parameters whose name contains this
    pub(crate) filter: Option<String>,
    /// Print the list as JSON
    #[arg(long)]
    pub(crate) json: bool,
    /// Print the list as the page docs/parameters.md
    #[arg(long, conflicts_with_all = ["json", "filter"])]
    pub(crate) markdown: bool,
    #[command(flatten)]
    pub(crate) params: ParamArgs,
}

/// How log lines look.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum LogFormat {
    /// For people
    #[default]
    Text,
    /// For programs: one JSON object a line
    Json,
}

/// Where the database is.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Where things are kept")]
pub(crate) struct DatabaseArgs {
    /// Folder for what is kept on this machine
    #[arg(long, value_name = "DIR", default_value = "gable-data", global = true)]
    pub(crate) data: PathBuf,
    /// Database of jobs: sqlite:FILE or postgres://USER:PASSWORD@HOST/NAME; by default SQLite in DIR
    #[arg(long, value_name = "ADDRESS", env = "GABLE_DATABASE", hide_env_values = true, global = true)]
    pub(crate) database: Option<String>,
}

/// Where jobs and artefacts are kept.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "Where things are kept")]
pub(crate) struct KeepArgs {
    #[command(flatten)]
    pub(crate) at: DatabaseArgs,
    /// Store of artefacts: a folder, or s3://BUCKET/PREFIX; by default a folder in DIR
    #[arg(long, value_name = "PLACE", env = "GABLE_STORE")]
    pub(crate) store: Option<String>,
    /// Folder, or s3://BUCKET/PREFIX, whose meshes may be sources of jobs; with a group, of its members only; may be given many times, by
    /// default the current folder
    #[arg(long = "source-root", value_name = "[GROUP=]PLACE")]
    pub(crate) source_roots: Vec<String>,
    /// How log lines look
    #[arg(long, value_name = "FORMAT", default_value = "text")]
    pub(crate) log_format: LogFormat,
}

/// How tasks are done.
#[derive(Args, Clone, Debug)]
#[command(next_help_heading = "How tasks are done")]
pub(crate) struct SlotArgs {
    /// Tasks at a time; 0 for one on each core, as far as --task-memory for each fits into the memory of the machine
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub(crate) slots: usize,
    /// Most memory of one task, MB; what uses more is stopped
    #[arg(long, value_name = "MB", default_value_t = 4096)]
    pub(crate) task_memory: u64,
    /// Longest time of one task, seconds
    #[arg(long, value_name = "S", default_value_t = 3600.0)]
    pub(crate) task_time: f64,
    /// How long a task is held without a sign of life, seconds; then another worker takes it
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    pub(crate) lease: f64,
    /// How long tasks under way may go on after SIGTERM, seconds; those that are left are handed back
    #[arg(long, value_name = "S", default_value_t = 30.0)]
    pub(crate) grace: f64,
    /// Program that starts each task, with the command of the task as its arguments, such as nice
    #[arg(long, value_name = "PROGRAM")]
    pub(crate) task_wrapper: Option<PathBuf>,
    /// Fetched artefacts that are kept on the local disk, MB
    #[arg(long, value_name = "MB", default_value_t = 8192)]
    pub(crate) cache: u64,
}

const SERVE_HELP: &str = "\
Examples:
  gable serve --all                                         this machine: SQLite and a folder, no set-up
  gable serve --all --data /srv/gable --source-root /meshes
  gable serve --database postgres://gable@db/gable --store s3://gable --listen 0.0.0.0:8080
  gable serve --oidc-issuer https://id.example/realms/city --oidc-client gable --oidc-role operator=admins --oidc-role 'viewer=*'
  curl localhost:8080/api/v1/jobs -H \"authorization: Bearer $GABLE_TOKEN\" -H 'content-type: application/json' \\
    -d '{\"source\": \"mesh.obj\", \"city\": \"delft\"}'

Every request shows a token. Where none was made yet, the first start makes an operator's and tells it on standard error, once;
gable token create makes others, also before the first start.

The address /docs has the API. SIGTERM and Ctrl-C stop it; jobs go on when it is started again.";

/// Arguments of `gable serve`.
#[derive(Args, Debug)]
#[command(after_help = SERVE_HELP)]
pub(crate) struct ServeArgs {
    /// Do the tasks of jobs as well
    #[arg(long)]
    pub(crate) all: bool,
    /// Address to listen on
    #[arg(long, value_name = "HOST:PORT", default_value = "127.0.0.1:8080")]
    pub(crate) listen: std::net::SocketAddr,
    /// As long as no token was made, let whoever asks from this machine do everything, without one: people behind a proxy on this
    /// machine too
    #[arg(long)]
    pub(crate) open: bool,
    /// Age from which artefacts that nothing refers to are removed, hours
    #[arg(long, value_name = "H", default_value_t = 24.0)]
    pub(crate) collect_age: f64,
    /// Age from which jobs that are over keep their results only, and cannot be retried, and results of blocks that no job has taken over since are
    /// forgotten, hours
    #[arg(long, value_name = "H", default_value_t = 720.0)]
    pub(crate) keep_age: f64,
    /// Generations of a city that are kept, with the one that readers see; 0 for all
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(i64).range(0..))]
    pub(crate) keep_generations: i64,
    /// Age from which generations go that readers do not see, days; 0 for never
    #[arg(long, value_name = "D", default_value_t = 0.0)]
    pub(crate) keep_generations_age: f64,
    /// Age from which jobs that are over go, with their events, logs and results, days; what they published stays; 0 for never
    #[arg(long, value_name = "D", default_value_t = 365.0)]
    pub(crate) keep_jobs: f64,
    /// Age from which entries of the audit log go, days; 0 for never
    #[arg(long, value_name = "D", default_value_t = 730.0)]
    pub(crate) keep_audit: f64,
    /// Largest mesh that may be uploaded, MB; unpacked it may have four times as much
    #[arg(long, value_name = "MB", default_value_t = 16_384)]
    pub(crate) upload_size: u64,
    /// Most that the uploads of one token may take together, MB
    #[arg(long, value_name = "MB", default_value_t = 65_536)]
    pub(crate) upload_quota: u64,
    /// Address or network, such as 10.0.0.0/8, of proxies that are believed when they say by X-Forwarded-For, -Proto, -Host and -Prefix
    /// from where a request comes and where it was sent to; may be given many times
    #[arg(long, value_name = "ADDRESS")]
    pub(crate) trusted_proxy: Vec<gable_coordinator::TrustedProxy>,
    /// Site, such as https://viewer.example, whose pages may use the service; may be given many times
    #[arg(long, value_name = "ORIGIN", value_parser = gable_coordinator::checked_origin)]
    pub(crate) allow_origin: Vec<gable_coordinator::Origin>,
    /// Address of a second listener, for /healthz, /readyz and /metrics alone, without a token: it answers however many clients the first one
    /// has. Let nobody but supervisors reach it
    #[arg(long, value_name = "HOST:PORT")]
    pub(crate) probes: Option<std::net::SocketAddr>,
    /// Most connections of one address at a time; those of --trusted-proxy are not counted
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u32).range(1..))]
    pub(crate) connections: u32,
    /// Let webhooks be at addresses of this machine and of private networks
    #[arg(long)]
    pub(crate) private_webhooks: bool,
    #[command(flatten)]
    pub(crate) sign_in: SignInArgs,
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
    #[command(flatten)]
    pub(crate) slots: SlotArgs,
}

const WORK_HELP: &str = "\
Examples:
  gable work                                                beside gable serve on the same machine
  gable work --database postgres://gable@db/gable --store s3://gable --slots 8

Any number of workers on any number of machines may serve one database and one store. The split of a job reads its source,
so at least one worker has to see the source roots. SIGTERM and Ctrl-C stop it after the tasks under way.";

/// Arguments of `gable work`.
#[derive(Args, Debug)]
#[command(after_help = WORK_HELP)]
pub(crate) struct WorkArgs {
    #[command(flatten)]
    pub(crate) keep: KeepArgs,
    #[command(flatten)]
    pub(crate) slots: SlotArgs,
}

/// Arguments of the child process that does one task.
#[derive(Args, Debug)]
pub(crate) struct TaskArgs {
    /// Folder whose meshes may be sources of jobs
    #[arg(long = "source-root")]
    pub(crate) source_roots: Vec<PathBuf>,
    /// What the service keeps for itself, wherever it lies
    #[arg(long)]
    pub(crate) own: Vec<PathBuf>,
    /// Threads of tasks that are alone in their stage
    #[arg(long, default_value_t = 1)]
    pub(crate) threads: usize,
    /// Memory of the task, MB
    #[arg(long)]
    pub(crate) memory: u64,
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_command_line_is_consistent() {
        Cli::command().debug_assert();
    }

    #[test]
    fn presets_and_formats_are_named_in_the_help() {
        let mut command = Cli::command();
        let help = command.find_subcommand_mut("run").unwrap().render_long_help().to_string();
        for preset in gable_pipeline::params::PRESETS {
            assert!(help.contains(preset.name), "{} is missing in the help", preset.name);
        }
    }
}
