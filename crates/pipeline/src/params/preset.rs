//! Named sets of values.

/// A named set of values that replaces defaults.
#[derive(Debug)]
pub struct Preset {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Full names and values.
    pub values: &'static [(&'static str, &'static str)],
}

/// The presets.
pub const PRESETS: &[Preset] = &[
    Preset { name: "default", help: "the rules that measure best, at 0.2 m", values: &[] },
    Preset {
        name: "zhu2018",
        help: "the published rules of Zhu et al. 2018 everywhere, as a baseline",
        values: &[
            ("segmentation.method", "zhu2018"),
            ("segmentation.terrain", "constant"),
            ("segmentation.mu", "1"),
            ("segmentation.step_smoothness", "0"),
            ("segmentation.h_trunc", "3"),
            ("segmentation.steepness", "2"),
            ("segmentation.hole_area", "0"),
            ("segmentation.roof_tree_area", "0"),
            ("segmentation.building_tree_share", "1"),
            ("segmentation.wall_share", "0"),
            ("segmentation.probability", "0"),
            ("segmentation.narrow_share", "0"),
            ("segmentation.min_width", "0"),
            ("modeling.method", "zhu2018"),
            ("modeling.collinear", "0.5"),
            ("modeling.beta_pixel", "10"),
            ("modeling.party_wall_step", "0"),
        ],
    },
    Preset {
        name: "fast",
        help: "pixels of 0.4 m: four times fewer, small roof parts are lost",
        values: &[
            ("sampling.step", "0.4"),
            ("segmentation.patch", "256"),
            ("segmentation.margin", "32"),
            ("modeling.plane_area", "6"),
            ("modeling.superstructure_area", "9"),
            ("modeling.line_length", "1.6"),
        ],
    },
    Preset {
        name: "fine",
        help: "pixels of 0.1 m, for meshes of more than 10 faces per square metre",
        values: &[
            ("sampling.step", "0.1"),
            ("segmentation.patch", "1024"),
            ("segmentation.margin", "128"),
            ("modeling.plane_distance", "0.2"),
            ("modeling.plane_area", "1.5"),
            ("modeling.line_length", "0.6"),
            ("modeling.collinear", "0.3"),
            ("modeling.min_cell_area", "0.25"),
        ],
    },
];
