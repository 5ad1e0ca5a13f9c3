#![doc = include_str!("../README.md")]

mod boosting;
mod cell_plane;
mod cleanup;
mod coarse_heights;
mod colour;
mod energy;
mod entropy;
mod error;
mod evidence;
mod features;
mod flatness;
mod gaussian_derivatives;
mod image_folder;
mod label;
mod methods;
mod noise;
mod orthograph;
mod patches;
mod saturation;
mod slots;
mod stumps;
mod terrain;
mod training;

pub use boosting::{Boosting, Samples, boost, calibrate};
pub use cleanup::{CleanupParams, clean_buildings};
pub use coarse_heights::CoarseHeights;
pub use colour::colour_features;
pub use error::Error;
pub use evidence::{Evidence, RegionParams};
pub use features::{FeatureSet, for_each_feature};
pub use image_folder::read_labelled_images;
pub use label::Label;
pub use methods::{LABELLERS, LabelInput, Labeller, Likelihood, Segmentation, Zhu2018};
pub use noise::noise;
pub use orthograph::Orthograph;
pub use saturation::{GreenExcess, saturated};
pub use stumps::{Classifier, Model, Plants, Stump};
pub use terrain::Terrain;
pub use training::{
    LabelledRaster, PlantScores, Score, TrainOptions, TrainReport, UNKNOWN, evaluate, labelled_image, train,
};
