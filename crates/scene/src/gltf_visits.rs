//! The nodes of a glTF file in the order in which they are shown, and whether that is more than a city has.

use crate::budget;
use crate::error::SceneError;
use crate::glb::Container;
use crate::transform::Transform;
use gltf::{Mesh, Semantic};

/// The nodes of the default scene (of all roots where there is none), each with its place in the world, parents first.
///
/// A mesh may be shown by many nodes, and its numbers be used by many primitives, so that few bytes can stand for any number of
/// triangles: what they come to is counted here, from the header alone.
pub(crate) fn visits(container: &Container) -> Result<Vec<(usize, Transform)>, SceneError> {
    let document = &container.document;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let mut open: Vec<(usize, Transform)> = match scene {
        Some(scene) => scene.nodes().map(|node| (node.index(), Transform::IDENTITY)).collect(),
        None => {
            let mut is_child = vec![false; document.nodes().len()];
            for child in document.nodes().flat_map(|node| node.children().collect::<Vec<_>>()) {
                is_child[child.index()] = true;
            }
            let roots = document.nodes().filter(|node| !is_child[node.index()]);
            roots.map(|node| (node.index(), Transform::IDENTITY)).collect()
        }
    };
    open.reverse();
    let nodes: Vec<_> = document.nodes().collect();
    let meshes: Vec<Cost> = document.meshes().map(|mesh| Cost::of(&mesh)).collect();
    let mut seen = vec![false; nodes.len()];
    let mut found = Vec::new();
    let mut cost = Cost::default();
    while let Some((index, above)) = open.pop() {
        if std::mem::replace(&mut seen[index], true) {
            return Err(container.fault(&format!("node {index} hangs under two nodes or under itself")));
        }
        let node = &nodes[index];
        let matrix = container.nodes.matrices.get(index);
        let matrix = matrix.ok_or_else(|| container.fault("a node that is named is not there"))?;
        let transform = above.then(matrix);
        let children: Vec<_> = node.children().map(|child| (child.index(), transform)).collect();
        open.extend(children.into_iter().rev());
        if let Some(mesh) = node.mesh() {
            cost.add(&meshes[mesh.index()]);
        }
        found.push((index, transform));
    }
    cost.check(container)?;
    Ok(found)
}

/// What it takes to show a mesh.
#[derive(Clone, Copy, Debug, Default)]
struct Cost {
    triangles: u64,
    /// Vertices, indices and primitives: all that has to be looked at.
    items: u64,
}

impl Cost {
    fn of(mesh: &Mesh<'_>) -> Self {
        let mut cost = Self::default();
        for primitive in mesh.primitives() {
            let vertices = primitive.get(&Semantic::Positions).map_or(0, |p| p.count() as u64);
            let corners = primitive.indices().map_or(vertices, |indices| indices.count() as u64);
            // Strips and fans have one triangle for each corner.
            let triangles = if primitive.mode() == gltf::mesh::Mode::Triangles { corners / 3 } else { corners };
            cost.add(&Self { triangles, items: vertices.saturating_add(corners).saturating_add(1) });
        }
        cost
    }

    fn add(&mut self, other: &Self) {
        self.triangles = self.triangles.saturating_add(other.triangles);
        self.items = self.items.saturating_add(other.items);
    }

    /// Without repetition, a triangle takes a byte of the buffers at least.
    fn check(&self, container: &Container) -> Result<(), SceneError> {
        let bytes = container.buffer_bytes();
        if self.triangles > bytes.saturating_add(budget::REPEATED_TRIANGLES)
            || self.items > bytes.saturating_add(budget::REPEATED_ITEMS)
        {
            let what = format!(
                "its nodes show {} triangles from {} bytes, by showing the same many times: more than is read of such a file",
                self.triangles, bytes
            );
            return Err(SceneError::too_much(&container.path, what));
        }
        Ok(())
    }
}
