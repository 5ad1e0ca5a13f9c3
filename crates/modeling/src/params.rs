//! What can be set.

use gable_city_model::Tolerances;

/// Parameters of [`model`](crate::model), for both methods. Lengths in metres, angles in degrees.
#[derive(Clone, Debug)]
pub struct Params {
    /// Whose rules.
    pub method: Method,
    /// Faces within this angle of the vertical are facades.
    pub facade_angle: f64,
    /// How far a roof point may lie from its plane.
    pub plane_distance: f64,
    /// How far a roof point's normal may turn from its plane's.
    pub plane_angle: f64,
    /// Smallest area of a roof plane, m².
    pub plane_area: f64,
    /// Most planes of one building.
    pub max_planes: usize,
    /// Shortest line segment that is kept.
    pub line_length: f64,
    /// Parallel segments closer than this become one (Zhu 2018, §5.2).
    pub collinear: f64,
    /// Segments grow by this times their length at most before they slice the plane: until they hit another one (default method),
    /// or always (published method).
    pub extension: f64,
    /// Cells smaller than this join a neighbour, m².
    pub min_cell_area: f64,
    /// Parts on a roof that are smaller than this, and set off from it by steps, are left out, m² (default method).
    pub superstructure_area: f64,
    /// Weight of a metre of border between two faces (Zhu 2018, Eq. 11, in cubic metres).
    pub beta: f64,
    /// The same for the published method, where data is summed over pixels.
    pub beta_pixel: f64,
    /// A step in the roof of at least this height may be a party wall between two buildings; 0 leaves what hangs together
    /// one building.
    pub party_wall_step: f64,
    /// Work for each pixel of a building, counted as in `work.rs`, after which it gets a simpler model: fewer planes, or blocks.
    pub work: usize,
    /// Least height of a roof above the ground.
    pub min_height: f64,
    /// What passes as valid.
    pub tolerances: Tolerances,
}

/// Whose rules a building is modelled by.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// Ours.
    #[default]
    Gable,
    /// Those of Zhu 2018.
    Zhu2018,
}

impl Method {
    /// The name that is written.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Gable => "gable",
            Self::Zhu2018 => "zhu2018",
        }
    }
}

impl Default for Params {
    fn default() -> Self {
        Self {
            method: Method::Gable,
            facade_angle: 20.0,
            plane_distance: 0.3,
            plane_angle: 20.0,
            plane_area: 3.0,
            max_planes: 200,
            line_length: 1.0,
            collinear: 0.5,
            extension: 3.0,
            min_cell_area: 0.5,
            superstructure_area: 4.0,
            beta: 0.4,
            beta_pixel: 10.0,
            party_wall_step: 0.5,
            work: 2000,
            min_height: 2.0,
            tolerances: Tolerances::default(),
        }
    }
}
