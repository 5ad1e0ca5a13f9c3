//! Results on real meshes against what a person has drawn.

mod ground;
mod judged_labels;
mod judged_objects;
mod outlines;
mod overlay;
mod scene;

pub use ground::GroundFit;
pub use judged_labels::{JudgedLabels, Label};
pub use judged_objects::{JudgedObjects, SMALLEST};
pub use outlines::{OutlineClass, Outlines};
pub use overlay::overlay_jpeg;
pub use scene::RealScene;

use gable_city_model::CityModel;
use gable_geometry::{DVec2, DVec3};
use serde::{Deserialize, Serialize};

/// All figures of a result on a real mesh.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RealFigures {
    /// Labels.
    pub labels: JudgedLabels,
    /// Buildings.
    pub objects: JudgedObjects,
    /// Terrain.
    pub ground: GroundFit,
}

/// Measures a model and labels. `label` gives the label at a place in the frame of the mesh, `None` where there is none.
#[must_use]
pub fn judge(scene: &RealScene, model: &CityModel, label: &dyn Fn(DVec2) -> Option<Label>) -> RealFigures {
    let shift = DVec3::from_array(model.origin);
    RealFigures {
        labels: judged_labels::judged_labels(scene, label),
        objects: judged_objects::judged_objects(scene, model, shift),
        ground: ground::ground_fit(scene, model.terrain.as_ref(), shift),
    }
}
