//! The OBJ reader against `tobj`, the memory it takes apart.

use crate::town::{Folder, Read, data, read};
use gable_geometry::DVec3;
use gable_scene::{OpenOptions, Up};
use proptest::prelude::*;
use std::fmt::Write;
use std::path::Path;

/// Corners and texture coordinates of all triangles as tobj reads them.
fn by_tobj(path: &Path) -> Vec<([DVec3; 3], Option<[[f32; 2]; 3]>)> {
    let options = tobj::LoadOptions { triangulate: true, ..tobj::LoadOptions::default() };
    let (models, _) = tobj::load_obj(path, &options).expect("tobj reads it");
    let mut triangles = Vec::new();
    for model in models {
        let mesh = model.mesh;
        for (at, three) in mesh.indices.chunks_exact(3).enumerate() {
            let corners = [0, 1, 2].map(|i| DVec3::from_slice(&mesh.positions[3 * three[i] as usize..][..3]));
            let uv = mesh.texcoord_indices.get(3 * at..3 * at + 3).map(|three| {
                [0, 1, 2].map(|i| {
                    let at = 2 * three[i] as usize;
                    [mesh.texcoords[at] as f32, mesh.texcoords[at + 1] as f32]
                })
            });
            triangles.push((corners, uv));
        }
    }
    triangles
}

fn agrees(path: &Path) {
    let Read { triangles: ours, .. } = read(path, &OpenOptions { up: Up::Z, ..OpenOptions::default() }).expect("reads");
    let theirs = by_tobj(path);
    let area = |c: &[DVec3; 3]| (c[1] - c[0]).cross(c[2] - c[0]).length() > 0.0;
    let theirs: Vec<_> = theirs.into_iter().filter(|(corners, _)| area(corners)).collect();
    assert_eq!(ours.len(), theirs.len(), "{}", path.display());
    for (ours, (corners, uv)) in ours.iter().zip(&theirs) {
        assert_eq!((&ours.corners, &ours.uv), (corners, uv), "{}", path.display());
    }
}

#[test]
fn agrees_on_real_meshes() {
    let Some(data) = data() else { return };
    agrees(&data.join("frankfurt/mesh.obj"));
    // Alone, so that its origin in the metadata beside it is not added.
    let tile = std::fs::read(data.join("dayanta/Data/Tile_+003_+004/Tile_+003_+004.obj")).expect("reads");
    let folder = Folder::new();
    agrees(&folder.write("tile.obj", tile));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]
    #[test]
    fn agrees_on_generated_meshes(
        vertices in proptest::collection::vec(((-1e6f64..1e6), (-1e6f64..1e6), (-1e3f64..1e3), 0usize..9), 4..30),
        faces in proptest::collection::vec(
            // Of larger faces the library makes fans, whatever their shape.
            (proptest::collection::vec(any::<prop::sample::Index>(), 3..4), any::<bool>()), 1..30,
        ),
        ending in prop_oneof![Just("\n"), Just("\r\n")],
    ) {
        let mut text = format!("# made here{ending}o a{ending}");
        for (x, y, z, decimals) in &vertices {
            let _ = write!(text, "v {x:.decimals$} {y:.decimals$} {z:e}{ending}vt {:.3} {:.3}{ending}", x / 1e6, y / 1e6);
        }
        for (corners, relative) in &faces {
            text += "f";
            for corner in corners {
                let at = corner.index(vertices.len()) as i64;
                let at = if *relative { at - vertices.len() as i64 } else { at + 1 };
                let _ = write!(text, " {at}/{at}");
            }
            text += ending;
        }
        let folder = Folder::new();
        let path = folder.write("made.obj", text);
        // All faces may be degenerate, or the extent nonsense; then there is nothing to compare.
        if read(&path, &OpenOptions { up: Up::Z, ..OpenOptions::default() }).is_ok() {
            agrees(&path);
        }
    }
}
