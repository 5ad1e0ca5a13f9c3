//! What can be set for every method; what a method alone reads stands with the method.

use gable_city_model::Tolerances;

/// Parameters of [`model`](crate::model) that hold for every method.
#[derive(Clone, Debug)]
pub struct ModelParams {
    /// A step in the roof of at least this height may be a party wall between two buildings, metres; 0 leaves a connected
    /// component one building.
    pub party_wall_step: f64,
    /// Work for each pixel of a building, counted as in `work.rs`, after which it gets a simpler model: fewer planes, or blocks.
    pub work: usize,
    /// What passes as valid.
    pub tolerances: Tolerances,
}

impl Default for ModelParams {
    fn default() -> Self {
        Self { party_wall_step: 0.5, work: 2000, tolerances: Tolerances::default() }
    }
}
