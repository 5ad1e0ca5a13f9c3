//! Methods of reconstruction, side by side: one file each, found by name.
//!
//! To add one, write its file, implement [`Reconstruction`] and add it to [`METHODS`]; a program that links this crate can have
//! more of its own. What every method's buildings have in common (ground height, party walls, LODs, validation, attributes) is
//! not its business.

mod planes_first;
mod zhu2018;

pub use planes_first::PlanesFirst;
pub use zhu2018::Zhu2018;

use crate::input::BuildingInput;
use crate::reason::Reason;
use crate::roof_partition::RoofPartition;
use gable_parameters::{Declaration, Settings};

/// The methods of this crate, the default first.
pub const METHODS: [&dyn Reconstruction; 2] = [&PlanesFirst, &Zhu2018];

/// What a method reads besides the maps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Needs {
    /// The steep facets of the mesh ([`BuildingInput::facets`]).
    pub facets: bool,
}

/// A method that finds the roof of one building.
pub trait Reconstruction: Sync {
    /// The name by which users choose it, in lower case.
    fn name(&self) -> &'static str;

    /// One line for users.
    fn help(&self) -> &'static str;

    /// The parameters that are its own.
    fn parameters(&self) -> &'static [Declaration];

    /// What it reads besides the maps.
    fn needs(&self) -> Needs {
        Needs::default()
    }

    /// How far beyond the mask it looks, metres; it gets [`MARGIN`](crate::MARGIN) in any case.
    fn reach(&self) -> f64 {
        crate::input::MARGIN
    }

    /// How far it looks where a crown stands beside the building and may hide a part of it, metres.
    fn reach_under_crowns(&self) -> f64 {
        self.reach()
    }

    /// The building with what other things hide of it; `None` if nothing more is known of it than what is seen.
    fn completed(&self, _input: &BuildingInput) -> Option<BuildingInput> {
        None
    }

    /// The roof of a building over ground at height `ground` (local metres), as a planar partition with a plane for each
    /// region. No step of it may take more than `most_work`, counted as `modeling.work` is.
    ///
    /// # Errors
    /// The reason why there is none.
    fn reconstruct(
        &self,
        input: &BuildingInput,
        ground: f64,
        most_work: usize,
        settings: &Settings,
    ) -> Result<RoofPartition, Reason>;
}
