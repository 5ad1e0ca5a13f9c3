//! Named sets of values.

/// A named set of values that replaces defaults.
#[derive(Debug)]
pub struct Preset {
    /// Name.
    pub name: &'static str,
    /// One line of help.
    pub help: &'static str,
    /// Whether `method` alone may stand for it.
    pub is_method: bool,
    /// Full names and values.
    pub values: &'static [(&'static str, &'static str)],
}

/// The presets.
pub const PRESETS: &[Preset] = &[
    Preset { name: "default", help: "the rules that measure best, at 0.2 m", is_method: false, values: &[] },
    Preset {
        name: "zhu2018",
        help: "the published rules of Zhu et al. 2018 everywhere, as a baseline",
        is_method: true,
        values: &[
            ("segmentation.method", "zhu2018"),
            ("segmentation.terrain", "constant"),
            ("modeling.method", "zhu2018"),
            ("modeling.party_wall_step", "0"),
        ],
    },
    Preset {
        name: "fast",
        help: "pixels of 0.4 m: four times fewer, small roof parts are lost",
        is_method: false,
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
        is_method: false,
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
