//! Meshes made coarser: what real meshes of few faces and no texture look like, from those that are at hand.

use anyhow::Context as _;
use gable_geometry::DVec3;
use gable_scene::{OpenOptions, Scene, SceneError, Triangle};
use gable_synthetic_city::{TriMesh, decimate};
use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// The triangles of a mesh, in its frame.
pub(super) fn triangles(mesh: &Path) -> anyhow::Result<(Vec<Triangle>, gable_scene::Content)> {
    let scene = Scene::open(super::mesh_folder(mesh), &OpenOptions::default())?;
    let mut all = Vec::new();
    let content = scene.for_each_chunk::<SceneError>(|chunk| {
        all.extend_from_slice(chunk);
        Ok(())
    })?;
    Ok((all, content))
}

/// Writes a copy of a mesh into a folder, without texture and with so many faces for each m² of its plan; a mesh that has fewer keeps
/// what it has. Returns the file. O(n log n) in the faces.
pub(super) fn write(mesh: &Path, density: f64, folder: &Path) -> anyhow::Result<PathBuf> {
    let (triangles, _) = triangles(mesh)?;
    let welded = welded(triangles.iter().map(|t| t.corners));
    let wanted = (plan_area(&welded) * density).ceil() as usize;
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    let file = folder.join("mesh.obj");
    std::fs::write(&file, obj(&decimate(&welded, wanted))).with_context(|| file.display().to_string())?;
    Ok(file)
}

/// Triangles with the corners that they share; those without area are left out.
fn welded(triangles: impl Iterator<Item = [DVec3; 3]>) -> TriMesh {
    let mut mesh = TriMesh::default();
    let mut numbers: HashMap<[u64; 3], u32> = HashMap::new();
    for corners in triangles {
        let face = corners.map(|corner| {
            *numbers.entry(corner.to_array().map(f64::to_bits)).or_insert_with(|| {
                mesh.vertices.push(corner);
                mesh.vertices.len() as u32 - 1
            })
        });
        if face[0] != face[1] && face[1] != face[2] && face[2] != face[0] {
            mesh.faces.push(face);
        }
    }
    mesh
}

/// Area of the plan of all faces that look up, m²; what hangs over other faces counts as often as it does.
fn plan_area(mesh: &TriMesh) -> f64 {
    (0..mesh.faces.len()).map(|face| 0.5 * mesh.area_normal(face).z.max(0.0)).sum()
}

fn obj(mesh: &TriMesh) -> String {
    let mut text = String::new();
    for p in &mesh.vertices {
        let _ = writeln!(text, "v {:.4} {:.4} {:.4}", p.x, p.y, p.z);
    }
    for [a, b, c] in &mesh.faces {
        let _ = writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    // A grid of 1 m squares over 20 × 20 m with a step of 5 m in its middle, as loose triangles.
    fn step() -> Vec<[DVec3; 3]> {
        let at = |x: usize, y: usize| DVec3::new(x as f64, y as f64, if x < 10 { 0.0 } else { 5.0 });
        let square = |x: usize, y: usize| {
            [[at(x, y), at(x + 1, y), at(x + 1, y + 1)], [at(x, y), at(x + 1, y + 1), at(x, y + 1)]]
        };
        (0..20).flat_map(|y| (0..20).flat_map(move |x| square(x, y))).collect()
    }

    #[test]
    fn loose_triangles_share_corners_and_keep_their_plan() {
        let mesh = welded(step().into_iter());
        assert_eq!((mesh.vertices.len(), mesh.faces.len()), (21 * 21, 800));
        assert!((plan_area(&mesh) - 400.0).abs() < 1e-9);
    }

    #[test]
    fn a_thinned_mesh_has_as_many_faces_as_asked_and_its_step() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("whole.obj");
        std::fs::write(&file, obj(&welded(step().into_iter()))).unwrap();
        let thinned = write(&file, 0.2, &folder.path().join("thinned")).unwrap();
        let (triangles, _) = triangles(&thinned).unwrap();
        assert!((20..=80).contains(&triangles.len()), "{}", triangles.len());
        let heights = || triangles.iter().flat_map(|t| t.corners).map(|p| p.z);
        assert!(heights().fold(f64::INFINITY, f64::min).abs() < 0.1);
        assert!((heights().fold(f64::NEG_INFINITY, f64::max) - 5.0).abs() < 0.1);
    }
}
