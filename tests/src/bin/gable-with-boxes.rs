//! `gable` with one method more: a box over every building. A method takes one file and one line that installs it.

use gable_geometry::{Box2, Plane, Polygon};
use gable_modeling::{BuildingInput, Reason, Reconstruction, RoofPartition};
use gable_parameters::{Declaration, Parameters as _, Settings, parameters, within};
use gable_pipeline::params::Registry;
use std::process::ExitCode;

/// A box over every building, along the axes of the map.
struct Boxes;

parameters! {
    /// Parameters of the method of boxes.
    struct BoxParams {
        /// Height of every box over the ground.
        box_height: f64 = 5.0, "m", within(1.0, 100.0);
    }
}

impl Reconstruction for Boxes {
    fn name(&self) -> &'static str {
        "box"
    }

    fn help(&self) -> &'static str {
        "a box over every building"
    }

    fn parameters(&self) -> &'static [Declaration] {
        BoxParams::declarations()
    }

    fn reconstruct(
        &self,
        input: &BuildingInput,
        ground: f64,
        _most_work: usize,
        settings: &Settings,
    ) -> Result<RoofPartition, Reason> {
        let params: BoxParams = settings.typed().map_err(Reason::Settings)?;
        let window = input.window();
        let mask = input.mask.values().iter().enumerate().filter(|(_, inside)| **inside);
        let pixels = mask.map(|(pixel, _)| window.centre(pixel % window.width, pixel / window.width));
        let Box2 { min, max } = Box2::of(pixels).grown(window.step / 2.0);
        let corners = vec![min, (max.x, min.y).into(), max, (min.x, max.y).into()];
        let outline = Polygon { outer: corners, holes: Vec::new() };
        Ok(RoofPartition::of_polygons(&[(outline, Plane::horizontal(ground + params.box_height))]))
    }
}

fn main() -> ExitCode {
    Registry::built_in().with_reconstruction(&Boxes).install().expect("nothing has run yet");
    gable::main()
}
