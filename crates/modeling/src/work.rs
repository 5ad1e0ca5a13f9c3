//! How much work a building may take before it gets a simpler model.
//!
//! Work is counted and never timed, so that a model depends neither on the machine nor on what else it does. A count
//! stands for about as many nanoseconds as its weight says. Each part of the modelling may take so much for each pixel of
//! the building, and all that is not bounded by pixels is counted; so the whole is linear in the pixels.

/// A smaller building may take as much as one of so many pixels: 800 m² at 0.2 m.
const LEAST_PIXELS: usize = 20_000;

/// Weight of holding two segments or two regions of pixels against each other.
pub(crate) const PAIR: usize = 20;

/// Weight of an edge of the partition each time that a solid is raised over it and validated.
pub(crate) const EDGE: usize = 1000;

/// The most that each part of the modelling may take for a building of so many pixels.
pub(crate) fn most(pixels: usize, for_each_pixel: usize) -> usize {
    for_each_pixel.saturating_mul(pixels.max(LEAST_PIXELS))
}

#[cfg(test)]
mod tests {
    use crate::{BuildingInput, BuildingModel, ModelParams, PlanesFirst, model};
    use gable_geometry::Counter;
    use gable_ortho::WallEvidence;
    use gable_parameters::Settings;
    use gable_raster::{GridWindow, Raster};

    /// Square level roofs of 6 m, `columns` by `columns`, each of its own height, as one mask.
    fn blocks(columns: usize) -> BuildingInput {
        let (step, side, margin) = (0.4, 15, 12);
        let size = columns * side + 2 * margin;
        let window = GridWindow { step, x0: 0, y0: 0, width: size, height: size };
        let mut rng = Counter::new(2);
        let levels: Vec<f32> = (0..columns * columns).map(|_| 4.0 + 2.0 * rng.index(6) as f32).collect();
        let mut height = Raster::filled(window, 0.0);
        for y in 0..columns * side {
            for x in 0..columns * side {
                height[(x + margin, y + margin)] = levels[y / side * columns + x / side] + 0.03 * rng.normal() as f32;
            }
        }
        BuildingInput {
            mask: height.map(|&z| z > 2.0),
            crowns: Raster::filled(window, false),
            terrain: Raster::filled(window, 0.0),
            normal: Raster::filled(window, [0.0, 0.0, 1.0]),
            colour: None,
            walls: Raster::filled(window, WallEvidence::default()),
            height,
            roof: None,
            facets: Vec::new(),
        }
    }

    fn whole(input: &BuildingInput, work: usize, settings: &Settings) -> BuildingModel {
        let params = ModelParams { party_wall_step: 0.0, work, ..ModelParams::default() };
        let mut models = model(input, &PlanesFirst, settings, &params).unwrap();
        assert_eq!(models.len(), 1);
        models.remove(0)
    }

    #[test]
    fn an_ordinary_building_needs_little_of_it() {
        let input = blocks(6);
        let usual = ModelParams::default().work;
        let all = whole(&input, usual, &Settings::default());
        assert_eq!((all.reason, all.note), (None, None));
        let tenth = whole(&input, usual / 10, &Settings::default());
        assert_eq!((tenth.reason, tenth.note), (None, None));
        assert_eq!(tenth.lods, all.lods);
    }

    #[test]
    fn a_building_beyond_its_work_gets_fewer_planes_and_says_so() {
        let input = blocks(12);
        let full = whole(&input, ModelParams::default().work, &Settings::default());
        let simple = whole(&input, 3, &Settings::default());
        let note = simple.note.clone().unwrap_or_default();
        assert!(note.starts_with("only ") && note.contains("modeling.work"), "{note}");
        assert!(simple.roofs.len() < full.roofs.len(), "{} of {}", simple.roofs.len(), full.roofs.len());
        assert!(!simple.lods.lod1.is_empty() || !simple.lods.lod2.is_empty(), "{:?}", simple.reason);
        assert!(simple.area > 0.9 * full.area, "{} m² of {} m²", simple.area, full.area);
        assert_eq!(whole(&input, 3, &Settings::default()).lods, simple.lods, "counted, not timed");
    }

    #[test]
    fn planes_beyond_the_most_are_left_out_with_a_note() {
        let mut settings = Settings::default();
        settings.insert("max_planes", "3");
        let simple = whole(&blocks(6), ModelParams::default().work, &settings);
        let note = simple.note.unwrap_or_default();
        assert!(note.starts_with("only 3 of ") && note.contains("modeling.max_planes"), "{note}");
    }
}
