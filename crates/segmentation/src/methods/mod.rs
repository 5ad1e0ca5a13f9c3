//! Methods of labelling, side by side: one file each, found by name.
//!
//! To add one, write its file, implement [`Labeller`] and add it to [`LABELLERS`]; a program that links this crate can have more
//! of its own. Terrain, patches, the judgement of whole regions and what users give by hand are not its business.

mod likelihood;
mod zhu2018;

pub use likelihood::Likelihood;
pub use zhu2018::Zhu2018;

use crate::evidence::RegionParams;
use crate::features::FeatureSet;
use crate::stumps::{Model, Plants};
use crate::{Error, Orthograph};
use gable_parameters::{Declaration, Settings};
use gable_raster::Raster;

/// The methods of this crate, the default first.
pub const LABELLERS: [&dyn Labeller; 2] = [&Likelihood, &Zhu2018];

/// A method that labels every pixel ground, grass, tree or building.
pub trait Labeller: Sync {
    /// The name by which users choose it, in lower case.
    fn name(&self) -> &'static str;

    /// One line for users.
    fn help(&self) -> &'static str;

    /// The parameters that are its own.
    fn parameters(&self) -> &'static [Declaration];

    /// What the tree classifier looks at in a city with photographs, unless users say something else.
    fn features(&self) -> FeatureSet;

    /// When a whole region is no building.
    ///
    /// # Errors
    /// If a setting cannot be read.
    fn regions(&self, settings: &Settings) -> Result<RegionParams, Error>;

    /// Labels a window. The result on its inside must not depend on what lies farther from it than the margin of a patch.
    ///
    /// # Errors
    /// If the maps lie on different windows, the classifier needs colour and there is none, or a setting cannot be read.
    fn label(&self, input: &LabelInput<'_>, settings: &Settings) -> Result<Segmentation, Error>;
}

/// What a window is labelled from.
#[derive(Clone, Copy, Debug)]
pub struct LabelInput<'a> {
    /// Colour, height and normals.
    pub maps: Orthograph<'a>,
    /// Ground height on the window of the maps, local metres ([`crate::Terrain::raster`]).
    pub terrain: &'a Raster<f32>,
    /// The tree classifier.
    pub classifier: &'a Model,
    /// Noise of the mesh as a multiple of the usual, see [`crate::noise()`].
    pub noise: f64,
    /// Regions of building below this area are none, m².
    pub min_area: f64,
}

impl LabelInput<'_> {
    fn check(&self) -> Result<(), Error> {
        self.maps.check()?;
        if self.terrain.window() != self.maps.height.window() {
            return Err(Error::WindowMismatch { what: "terrain" });
        }
        Ok(())
    }
}

/// The labels of a raster, and what they were made from.
#[derive(Clone, Debug)]
pub struct Segmentation {
    /// [`Label`](crate::Label) of each pixel, as its number.
    pub labels: Raster<u8>,
    /// Probabilities of plants at each pixel.
    pub plants: Plants,
    /// What the classifier alone says of trees, before shape corrected it.
    pub classified: Raster<f32>,
    /// Height over the ground, metres; NaN without data.
    pub above: Raster<f32>,
    /// Energy of the labelling before cleaning.
    pub energy: f64,
}

/// The logistic function of height: the probability of standing high rather than low (Zhu 2018, Eq. 3).
fn probability_of_high(above: f32, middle: f64, steepness: f64) -> f32 {
    1.0 / (1.0 + (-(steepness as f32) * (above - middle as f32)).exp())
}

#[cfg(test)]
mod tests;
