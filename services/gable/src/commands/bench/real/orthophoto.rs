//! The colours of a mesh seen from above.

use gable_evaluation::real::RealScene;
use gable_files::Reach;
use gable_geometry::DVec2;
use gable_scene::{GREY, Material, Triangle, load_texture};
use image::RgbImage;

/// Where there is no surface.
const BLANK: [u8; 3] = [250, 250, 248];

/// The colour of each pixel of a scene, row by row from the south; `None` if the mesh has no colours at all. `triangles` are those that
/// the scene was made of. One texture is decoded at a time; one that cannot be has the colour of its material, as in a run, which warns of it.
pub(in super::super) fn colours(
    scene: &RealScene,
    triangles: &[Triangle],
    materials: &[Material],
) -> Option<Vec<[u8; 3]>> {
    let textured = |t: &Triangle| {
        t.uv.is_some() && materials.get(t.material as usize).is_some_and(|material| material.texture.is_some())
    };
    if !triangles.iter().any(|t| t.colours.is_some() || textured(t)) {
        return None;
    }
    let [width, height] = scene.size();
    let mut colours = vec![BLANK; width * height];
    // Pixels by material, so that each texture is decoded once.
    let mut tops: Vec<_> = scene.tops().collect();
    tops.sort_by_key(|&(_, _, triangle)| triangles[triangle].material);
    for group in tops.chunk_by(|a, b| triangles[a.2].material == triangles[b.2].material) {
        let material = group.first().and_then(|top| materials.get(triangles[top.2].material as usize));
        let texture = material.and_then(|material| load_texture(material, &Reach::everything()).ok().flatten());
        let plain = material.map_or(GREY, |material| material.colour);
        for &(at, centre, number) in group {
            let triangle = &triangles[number];
            let weights = weights(triangle, centre);
            colours[at] = match (&texture, triangle.uv, triangle.colours) {
                (Some(texture), Some(uv), _) => texel(texture, uv, weights),
                (_, _, Some(corners)) => [0, 1, 2].map(|k| {
                    let mixed: f64 = (0..3).map(|c| weights[c] * f64::from(corners[c][k])).sum();
                    mixed.round().clamp(0.0, 255.0) as u8
                }),
                _ => plain,
            };
        }
    }
    Some(colours)
}

/// Barycentric weights of a place in a triangle seen from above.
fn weights(triangle: &Triangle, at: DVec2) -> [f64; 3] {
    let [a, b, c] = triangle.corners.map(|p| p.truncate());
    let (u, v, w) = (b - a, c - a, at - a);
    let det = u.perp_dot(v);
    let (s, t) = (w.perp_dot(v) / det, u.perp_dot(w) / det);
    [1.0 - s - t, s, t]
}

fn texel(texture: &RgbImage, uv: [[f32; 2]; 3], weights: [f64; 3]) -> [u8; 3] {
    let along = |axis: usize| (0..3).map(|c| weights[c] * f64::from(uv[c][axis])).sum::<f64>();
    let pixel = |place: f64, size: u32| ((place.rem_euclid(1.0) * f64::from(size)) as u32).min(size - 1);
    texture.get_pixel(pixel(along(0), texture.width()), pixel(1.0 - along(1), texture.height())).0
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_evaluation::real::Outlines;
    use gable_geometry::dvec3;
    use gable_scene::TextureSource;

    /// A square of 4 m in two triangles.
    fn square(material: u32, uv: bool, colours: Option<[[u8; 3]; 3]>) -> Vec<Triangle> {
        let corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 4.0], [0.0, 4.0]];
        let triangle = |numbers: [usize; 3]| Triangle {
            corners: numbers.map(|k| dvec3(corners[k][0], corners[k][1], 1.0)),
            uv: uv.then(|| numbers.map(|k| corners[k].map(|v| v as f32 / 4.0))),
            colours,
            material,
        };
        vec![triangle([0, 1, 2]), triangle([0, 2, 3])]
    }

    fn seen(triangles: &[Triangle], materials: &[Material]) -> Option<Vec<[u8; 3]>> {
        let corners: Vec<_> = triangles.iter().map(|t| t.corners).collect();
        colours(&RealScene::new(Outlines::default(), &corners).unwrap(), triangles, materials)
    }

    #[test]
    fn textures_lie_as_in_the_mesh() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("texture.png");
        // Row 0 is the northern one: red west, green east; below blue, white.
        let texels = vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
        RgbImage::from_raw(2, 2, texels).unwrap().save(&file).unwrap();
        let material = Material { texture: Some(TextureSource::File(file)), ..Material::default() };
        let seen = seen(&square(0, true, None), &[material]).unwrap();
        assert_eq!(seen.len(), 1600);
        let at = |x: usize, y: usize| seen[40 * y + x];
        assert_eq!((at(5, 35), at(35, 35)), ([255, 0, 0], [0, 255, 0]));
        assert_eq!((at(5, 5), at(35, 5)), ([0, 0, 255], [255; 3]));
    }

    #[test]
    fn other_colours() {
        let plain = Material { colour: [9, 8, 7], ..Material::default() };
        assert_eq!(seen(&square(0, true, None), std::slice::from_ref(&plain)), None, "nothing has a texture");
        let vertices = seen(&square(Triangle::NO_MATERIAL, false, Some([[10, 20, 30]; 3])), &[]).unwrap();
        assert!(vertices.iter().all(|c| *c == [10, 20, 30]));
        let gone = TextureSource::File("nowhere.png".into());
        let missing = Material { texture: Some(gone), ..plain };
        assert!(seen(&square(0, true, None), &[missing]).unwrap().iter().all(|c| *c == [9, 8, 7]));
    }
}
