//! Real meshes, where they are.

use crate::scenes::{Folder, count};
use gable_blocks::Defects;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// The folder of the real meshes, where there is one; else says that the test is skipped.
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("GABLE_TEST_DATA").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no test data at GABLE_TEST_DATA, nor at ../shared/data beside the workspace");
    None
}

#[test]
fn the_grid_changes_no_triangle_of_real_meshes() {
    let Some(data) = data() else { return };
    for (name, triangles) in [("frankfurt/mesh.obj", 49_413), ("dayanta", 65_337), ("block/block.off", 47_030)] {
        let folder = Folder::new();
        let one = folder.split(&data.join(name), count(1, 1), "one").expect("splits");
        let many = folder.split(&data.join(name), count(16, 16), "many").expect("splits");
        assert_eq!(one.counts.triangles, triangles, "{name}");
        assert_eq!(one.outliers, many.outliers);
        assert_eq!(one.outliers.parts, 0, "{name}");
        let all = folder.blocks(&one, "one").remove(0);
        assert_eq!(one.defects, many.defects);
        let Defects { slivers, duplicates, floating_triangles, .. } = one.defects;
        assert_eq!(all.len() as u64 + slivers + duplicates + floating_triangles, triangles, "{name}");
        let key = |t: &gable_blocks::BlockTriangle| (t.corners, t.uv.map(|uv| uv.map(f32::to_bits)), t.material);
        let whole: BTreeSet<_> = all.iter().map(key).collect();
        let parts: BTreeSet<_> = folder.blocks(&many, "many").iter().flatten().map(key).collect();
        assert!(whole == parts, "{name}: the union of the blocks is not the scene");
        let bytes: u64 = one.blocks.iter().map(|b| b.bytes).sum();
        assert!(bytes < 25 * triangles, "{name}: {bytes} bytes");
    }
}
