//! Why a building has no model, or not the best one.

/// Why a building has no model, or is not written at the best LOD. The text is for people, [`Reason::code`] for counting.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Reason {
    /// No pixel of it has a height.
    #[error("the building has no pixel with a height")]
    NoHeights,
    /// No roof plane was found.
    #[error("no roof plane is found")]
    NoPlanes,
    /// All that was found lies on the ground.
    #[error("no roof stands above the ground")]
    NoRoof,
    /// No face of the subdivision lies in it.
    #[error("no face of the arrangement lies in the building")]
    NoFaces,
    /// The labelling of the faces failed.
    #[error("the labelling of the faces: {0}")]
    GraphCut(String),
    /// It is larger than memory allows.
    #[error("it measures {width:.0} × {height:.0} m, too much for one building")]
    TooLarge {
        /// West to east, metres.
        width: f64,
        /// South to north, metres.
        height: f64,
    },
    /// What was found earlier is not found any more: files of an earlier run were changed.
    #[error("{0} is not where it was when it was found")]
    Moved(&'static str),
    /// Nothing was seen inside of its given footprint.
    #[error("nothing of the mesh lies in its footprint")]
    EmptyFootprint,
    /// A shape does not pass the validation.
    #[error("{lod}: {defect}")]
    Invalid {
        /// Its level of detail: `LOD0`, `LOD1` or `LOD2`.
        lod: &'static str,
        /// The first defect, with its place.
        defect: String,
    },
    /// A shape does not pass the validation, and to mend it takes more work than a building may.
    #[error("{lod}: {defect}; to mend all such places is more work than modeling.work allows")]
    InvalidBeyondWork {
        /// Its level of detail.
        lod: &'static str,
        /// The first defect, with its place.
        defect: String,
    },
    /// A parameter of the method cannot be read.
    #[error("a parameter of the method: {0}")]
    Settings(String),
    /// The program failed at it.
    #[error("{0}")]
    Fault(String),
}

impl Reason {
    /// A word of its kind, which stays the same from version to version.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::NoHeights => "no_heights",
            Self::NoPlanes => "no_planes",
            Self::NoRoof => "no_roof",
            Self::NoFaces => "no_faces",
            Self::GraphCut(_) => "graph_cut",
            Self::TooLarge { .. } => "too_large",
            Self::Moved(_) => "moved",
            Self::EmptyFootprint => "empty_footprint",
            Self::Invalid { .. } => "invalid",
            Self::InvalidBeyondWork { .. } => "invalid_beyond_work",
            Self::Settings(_) => "settings",
            Self::Fault(_) => "fault",
        }
    }
}
