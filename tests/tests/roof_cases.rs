//! The roofs that a person looks at first, one small scene each: as photogrammetry would see it, and whether it is recognised.
//!
//! Limits stand a little beside what is reached; a scene that falls short of what a person sees says so.

use gable_tests::{case, run_gable};
use serde_json::Value;

/// What has to come out.
struct Expected {
    /// Buildings of the result.
    buildings: u64,
    /// Least IoU of the footprints, of all that hangs together.
    iou: f64,
    /// Roof planes that have exactly one counterpart in the truth, at least, and roof planes in all, at most.
    planes: [u64; 2],
    /// Largest RMSE of the height of the roofs, metres.
    rmse: f64,
}

fn recognised(name: &str, cut: &[&str], expected: &Expected) {
    let scene = case(name);
    let folder = tempfile::tempdir().unwrap();
    let (mesh, truth) = (scene.join("mesh"), scene.join("truth"));
    let (mesh, truth, out) = (mesh.to_str().unwrap(), truth.to_str().unwrap(), folder.path().to_str().unwrap());
    let run = ["run", mesh, "--out", out, "--quiet", "--set", "output.report=false"];
    let _ = run_gable(&[&run[..], cut].concat()).success();
    let found = run_gable(&["eval", "--truth", truth, "--result", out, "--json"]).success().json();
    let number = |path: &str| found.pointer(path).and_then(Value::as_f64).unwrap_or_else(|| panic!("{path}: {found}"));
    let count = |path: &str| found.pointer(path).and_then(Value::as_u64).unwrap_or_else(|| panic!("{path}: {found}"));
    let Expected { buildings, iou, planes: [matched, most], rmse } = *expected;
    assert_eq!(count("/objects/0/result"), buildings);
    assert_eq!(count("/objects/0/correct"), buildings, "none is invented");
    let reached = number("/footprints/blocks/mean_iou");
    assert!(reached >= iou, "footprint IoU {reached:.3}");
    let planes = [count("/roofs/planes/one_to_one"), count("/roofs/planes/result")];
    assert!(planes[0] >= matched && planes[1] <= most, "roof planes, matched and in all: {planes:?}");
    let reached = number("/roofs/height_rmse");
    assert!(reached <= rmse, "roof RMSE {reached:.3} m");
    let shells = [number("/validity/lod2"), number("/validity/lod1"), number("/validity/lod0")];
    assert_eq!(shells, [1.0; 3], "valid, and none is missing");
}

macro_rules! cases {
    ($($(#[$about:meta])* $test:ident $name:literal $cut:expr, $buildings:literal buildings, IoU $iou:literal,
        $matched:literal of $most:literal planes, $rmse:literal m;)*) => {
        $($(#[$about])* #[test]
        fn $test() {
            let expected = Expected { buildings: $buildings, iou: $iou, planes: [$matched, $most], rmse: $rmse };
            recognised($name, &$cut, &expected);
        })*
    };
}

cases! {
    gable "gable" [], 1 buildings, IoU 0.96, 2 of 2 planes, 0.10 m;
    hip "hip" [], 1 buildings, IoU 0.95, 4 of 4 planes, 0.13 m;
    /// Hips of one or two square metres are below LOD2's size.
    half_hip "half-hip" [], 1 buildings, IoU 0.96, 0 of 4 planes, 0.20 m;
    mansard "mansard" [], 1 buildings, IoU 0.97, 8 of 8 planes, 0.10 m;
    shed "shed" [], 1 buildings, IoU 0.97, 1 of 1 planes, 0.08 m;
    pyramid "pyramid" [], 1 buildings, IoU 0.91, 4 of 4 planes, 0.10 m;
    cross_gable "cross-gable" [], 1 buildings, IoU 0.97, 4 of 4 planes, 0.12 m;
    l_shape "l-shape" [], 1 buildings, IoU 0.97, 4 of 4 planes, 0.08 m;
    t_shape "t-shape" [], 1 buildings, IoU 0.96, 6 of 6 planes, 0.13 m;
    flat_with_parapet "flat-parapet" [], 1 buildings, IoU 0.97, 1 of 1 planes, 0.08 m;
    /// One of the steps passes for a party wall.
    terraces "terraces" [], 2 buildings, IoU 0.97, 3 of 3 planes, 0.35 m;
    courtyard "courtyard" [], 1 buildings, IoU 0.95, 8 of 8 planes, 0.14 m;
    /// The tower, round and pointed, is taken for a tree, and the house goes on under it.
    round_tower "round-tower" [], 1 buildings, IoU 0.88, 3 of 5 planes, 0.90 m;
    skew "skew" [], 1 buildings, IoU 0.95, 2 of 2 planes, 0.08 m;
    /// Two of the five have eaves of nearly one height.
    party_walls "party-walls" [], 4 buildings, IoU 0.96, 6 of 10 planes, 0.20 m;
    on_a_slope "on-slope" [], 1 buildings, IoU 0.95, 2 of 2 planes, 0.11 m;
    under_a_tree "under-tree" [], 1 buildings, IoU 0.94, 4 of 4 planes, 0.10 m;
    over_four_blocks "four-blocks" ["--grid", "2x2"], 1 buildings, IoU 0.96, 4 of 4 planes, 0.09 m;
    /// A speck of a plane stays on the roof.
    over_ten_blocks "ten-blocks" ["--block-size", "20"], 1 buildings, IoU 0.95, 1 of 3 planes, 0.11 m;
    /// A box of roof machinery, 2 m × 2 m, stays on one of the low buildings; the truth has none of them.
    two_halls "two-halls" [], 5 buildings, IoU 0.97, 8 of 10 planes, 0.08 m;
}
