//! Properties that hold for every scene.

use crate::scenes::{Folder, count, sheet, strewn};
use gable_blocks::{GridSpec, UNITS_PER_METRE};
use gable_geometry::{DVec3, dvec3};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_triangle_is_in_exactly_the_blocks_whose_core_its_box_meets(
        seed in any::<u64>(),
        triangles in 1usize..300,
        columns in 1u32..9,
        rows in 1u32..9,
    ) {
        let folder = Folder::new();
        let path = folder.obj("a.obj", &strewn(seed, triangles));
        let one = folder.split(&path, count(1, 1), "one").expect("splits");
        let many = folder.split(&path, count(columns, rows), "many").expect("splits");
        // The frame, so every corner, is the same whatever the grid.
        prop_assert_eq!(&one.grid.frame, &many.grid.frame);
        let all = folder.blocks(&one, "one").remove(0);
        prop_assert_eq!(all.len() as u64 + one.defects.slivers + one.defects.floating_triangles, triangles as u64);
        prop_assert_eq!(one.defects, many.defects);
        for (entry, found) in many.blocks.iter().zip(folder.blocks(&many, "many")) {
            let bounds = entry.core.bounds(many.grid.step);
            let meets = |t: &gable_blocks::BlockTriangle| {
                let p = t.positions();
                let (min, max) = (p[0].min(p[1]).min(p[2]), p[0].max(p[1]).max(p[2]));
                min.x <= bounds.max.x && max.x >= bounds.min.x && min.y <= bounds.max.y && max.y >= bounds.min.y
            };
            let expected: Vec<_> = all.iter().filter(|t| meets(t)).copied().collect();
            prop_assert_eq!(entry.triangles as usize, found.len());
            prop_assert_eq!(found, expected);
        }
    }

    #[test]
    fn corners_are_rounded_to_the_lattice_in_the_order_of_the_scene(seed in any::<u64>()) {
        let folder = Folder::new();
        let triangles = strewn(seed, 100);
        let path = folder.obj("a.obj", &triangles);
        let report = folder.split(&path, count(1, 1), "one").expect("splits");
        prop_assert!(report.defects.floating_triangles <= 1);
        let origin = DVec3::from_array(report.grid.frame.origin);
        prop_assert_eq!(origin, origin.floor());
        prop_assert_eq!(origin.z, 0.0);
        let mut last = None;
        for block in &folder.blocks(&report, "one").remove(0) {
            // The colour tells which one it is: a crumb in the air may be left out.
            let at = usize::from(block.colours[0][0]) - 2;
            prop_assert!(last.replace(at).is_none_or(|last| last < at));
            let scene = &triangles[at];
            for (local, world) in block.positions().iter().zip(scene) {
                let error = (*local + origin - *world).abs().max_element();
                prop_assert!(error <= 0.5 / UNITS_PER_METRE + 1e-9, "{}", error);
            }
            prop_assert_eq!(block.colours, [[(at + 2) as u8, 7, 255, 255]; 3]);
        }
    }
}

#[test]
fn the_threads_change_no_byte() {
    let folder = Folder::new();
    let path = folder.obj("a.obj", &strewn(5, 4000));
    let bytes = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let into = format!("{threads}");
        let report = pool.install(|| folder.split(&path, count(5, 4), &into)).expect("splits");
        let read = |file: &String| std::fs::read(folder.path().join(&into).join(file)).expect("reads");
        let files: Vec<_> = report.blocks.iter().map(|b| read(&b.file)).collect();
        (serde_json::to_string(&report).expect("serialises"), files)
    };
    let one = bytes(1);
    assert_eq!(one, bytes(2));
    assert_eq!(one, bytes(4));
    let back: gable_blocks::SplitReport = serde_json::from_str(&one.0).expect("comes back");
    assert_eq!(serde_json::to_string(&back).expect("serialises"), one.0);
}

#[test]
fn blocks_of_a_size_and_empty_ones() {
    let folder = Folder::new();
    let far = dvec3(120.0, 0.0, 0.0);
    let path = folder.obj("a.obj", &[sheet(10, 3.0, DVec3::ZERO), sheet(10, 3.0, far)].concat());
    let report = folder.split(&path, GridSpec::Size(30.0), "a").expect("splits");
    assert_eq!((report.grid.columns(), report.grid.rows()), (5, 1));
    let counts: Vec<u64> = report.blocks.iter().map(|b| b.triangles).collect();
    // The middle blocks are empty, the second touches the first sheet's border, as does the fourth.
    assert_eq!(counts, [200, 20, 0, 20, 200]);
    assert_eq!((report.min, report.max), ([0.0; 3], [150.0, 30.0, 0.0]));
    assert!(folder.blocks(&report, "a")[2].is_empty());
}

#[test]
fn bad_scenes_and_grids_leave_no_block() {
    let folder = Folder::new();
    let good = folder.obj("good.obj", &sheet(4, 3.0, DVec3::ZERO));
    let text = std::fs::read_to_string(&good).expect("reads");
    // One broken face of many is left out and told; a file of nothing else is refused.
    let scratched = folder.path().join("scratched.obj");
    std::fs::write(&scratched, text.clone() + "f 1 2 99999\n").expect("writes");
    let report = folder.split(&scratched, count(2, 2), "scratched").expect("one face is broken");
    assert_eq!((report.counts.triangles, report.counts.faces), (32, 33));
    let bad = folder.path().join("bad.obj");
    let vertices: String = text.lines().filter(|line| line.starts_with('v')).map(|line| format!("{line}\n")).collect();
    std::fs::write(&bad, vertices + "f 1 2 99999\n").expect("writes");
    let said = folder.split(&bad, count(2, 2), "bad").expect_err("all faces are broken").to_string();
    assert!(
        said.contains("bad.obj") && said.contains("line 97: a face names vertex 99999, but there are 96"),
        "{said}"
    );
    let said = folder.split(&good, count(2, 200), "bad").expect_err("too many rows").to_string();
    assert_eq!(said, "the grid cannot be made: 200 rows of blocks are asked for, but there are 40 rows of pixels");
    let left = std::fs::read_dir(folder.path().join("bad")).expect("is there").count();
    assert_eq!(left, 0, "nothing is left in the folder");
}
