//! Buildings as they are seen from afar: boxes, of a seventh of the triangles.

use crate::{Attributes, Building, Face, Lods, Semantic, Shell};
use gable_geometry::{DVec2, dvec3, point_segment_distance};

/// How far a corner of a box may be from the footprint that it stands for, metres.
const REACH: f64 = 20.0;

/// The buildings whose block models are boxes, where a box is no further than some metres from them, with the attributes that they have;
/// and how far the boxes are from the blocks, metres. None if boxes would save nothing.
///
/// A box stands on the rectangle of least area that holds the footprint and has a side along one of its edges. It is at the height of the
/// block. What is further from its rectangle, such as a closed block around a large yard, keeps its outline. Nothing has an underside, for
/// nobody sees it from afar.
#[must_use]
pub fn boxes(buildings: &[Building]) -> Option<(Vec<Building>, f64)> {
    let (mut error, mut saved) = (0.0_f64, false);
    let mut boxed = |shell: &Shell| match around(shell) {
        Some((found, distance)) if distance <= REACH && found.faces.len() < seen(&shell.faces).count() => {
            (error, saved) = (error.max(distance), true);
            found
        }
        _ => Shell { vertices: shell.vertices.clone(), faces: seen(&shell.faces).cloned().collect() },
    };
    let of = |b: &Building| {
        // A building without blocks is shown at another level, here as nearer by.
        let Lods { footprint, roof_edge, lod1, lod2 } = &b.lods;
        let lods = match lod1.is_empty() {
            true => Lods {
                footprint: footprint.clone(),
                roof_edge: roof_edge.clone(),
                lod1: Vec::new(),
                lod2: lod2.clone(),
            },
            false => Lods { lod1: lod1.iter().map(&mut boxed).collect(), ..Lods::default() },
        };
        Building { id: b.id.clone(), attributes: b.attributes.clone(), lods }
    };
    let buildings = buildings.iter().map(of).collect();
    saved.then_some((buildings, error))
}

/// The faces that are no undersides.
fn seen(faces: &[Face]) -> impl Iterator<Item = &Face> {
    faces.iter().filter(|f| f.semantic != Semantic::GroundSurface)
}

/// The box around a block, and how far it is from it.
fn around(shell: &Shell) -> Option<(Shell, f64)> {
    let (low, high) = shell.bounds()?;
    let at = |i: u32| shell.vertices.get(i as usize).map(|v| v.truncate());
    let ground = shell.faces.iter().filter(|f| f.semantic == Semantic::GroundSurface);
    let rings: Option<Vec<Vec<DVec2>>> =
        ground.flat_map(|f| &f.rings).map(|ring| ring.iter().map(|&i| at(i)).collect::<Option<Vec<_>>>()).collect();
    let rings = rings.filter(|rings| rings.iter().any(|r| r.len() > 2))?;
    let edges = || rings.iter().flat_map(|ring| (0..ring.len()).map(move |i| (ring[i], ring[(i + 1) % ring.len()])));
    let rectangle = edges()
        .filter_map(|(a, b)| (b - a).try_normalize())
        .map(|along| {
            let across = along.perp();
            let span = |axis: DVec2| {
                let places = rings.iter().flatten().map(|p| p.dot(axis));
                places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), p| (l.min(p), h.max(p)))
            };
            let ((west, east), (south, north)) = (span(along), span(across));
            let corner = |x: f64, y: f64| along * x + across * y;
            let corners = [corner(west, south), corner(east, south), corner(east, north), corner(west, north)];
            ((east - west) * (north - south), corners)
        })
        // Of equal ones the first.
        .reduce(|best, next| if next.0 < best.0 { next } else { best })?
        .1;
    let distance = |p: DVec2| edges().map(|(a, b)| point_segment_distance(p, a, b)).fold(f64::INFINITY, f64::min);
    // Between its corners a side may be as far from the footprint as in its middle.
    let places = (0..4).flat_map(|i| [rectangle[i], rectangle[i].midpoint(rectangle[(i + 1) % 4])]);
    let error = places.map(distance).fold(0.0, f64::max).max(yards(&rings));
    let heights = [low.z, high.z];
    let vertices = heights.iter().flat_map(|&z| rectangle.map(|p| dvec3(p.x, p.y, z))).collect();
    let face = |ring: [u32; 4], semantic| Face { rings: vec![ring.to_vec()], semantic, attributes: Attributes::new() };
    let mut faces = vec![face([4, 5, 6, 7], Semantic::RoofSurface)];
    faces.extend((0..4).map(|i| face([i, (i + 1) % 4, (i + 1) % 4 + 4, i + 4], Semantic::WallSurface)));
    Some((Shell { vertices, faces }, error))
}

/// How far the middle of the widest yard is from its walls, metres, about: holes run the other way round than what they are in.
fn yards(rings: &[Vec<DVec2>]) -> f64 {
    let area = |ring: &Vec<DVec2>| gable_geometry::ring_area(ring);
    // A ground surface looks down: from above its outer ring runs clockwise.
    rings.iter().map(area).filter(|a| *a > 0.0).map(|a| a.sqrt() / 2.0).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shell::samples::prism;
    use crate::tiles3d::{TileLod, buildings_content};

    fn building(block: Shell) -> Building {
        let attributes = Attributes::from([("rmse_m".to_owned(), crate::Value::Number(0.5))]);
        Building { id: "a".to_owned(), attributes, lods: Lods { lod1: vec![block], ..Lods::default() } }
    }

    #[test]
    fn a_house_with_a_porch_is_a_turned_box() {
        // 10 m × 6 m, turned, with a porch of 2 m × 1 m.
        let turn = DVec2::from_angle(0.5);
        let outline: Vec<(f64, f64)> =
            [(0.0, 0.0), (10.0, 0.0), (10.0, 6.0), (4.0, 6.0), (4.0, 7.0), (2.0, 7.0), (2.0, 6.0), (0.0, 6.0)]
                .map(|(x, y)| DVec2::new(x, y).rotate(turn))
                .map(|p| (p.x, p.y))
                .to_vec();
        let house = building(prism(&[&outline], 3.0, 9.0));
        let (found, error) = boxes(std::slice::from_ref(&house)).expect("a box");
        let shell = &found[0].lods.lod1[0];
        assert_eq!(shell.bounds().map(|(low, high)| (low.z, high.z)), Some((3.0, 9.0)));
        assert!((error - 1.0).abs() < 1e-9, "{error}");
        assert_eq!((&found[0].id, &found[0].attributes), (&house.id, &house.attributes));
        assert!((shell.vector_area(&shell.faces[0]).z - 70.0).abs() < 1e-9);
        let walls: Vec<f64> = shell.faces[1..].iter().map(|f| shell.vector_area(f).length().round()).collect();
        assert_eq!((walls.iter().sum::<f64>(), walls.len()), (2.0 * 60.0 + 2.0 * 42.0, 4));
        let middle = shell.vertices.iter().sum::<gable_geometry::DVec3>() / 8.0;
        let out = |f: &Face| shell.vector_area(f).dot(shell.vertices[f.rings[0][0] as usize] - middle) > 0.0;
        assert!(shell.faces.iter().all(out), "seen from outside");
        let content = |b: &Building| buildings_content(std::slice::from_ref(b), TileLod::Lod1).unwrap().unwrap();
        let (near, far) = (content(&house), content(&found[0]));
        assert!(far.glb.len() < near.glb.len());
    }

    #[test]
    fn what_is_no_box_from_afar_stays() {
        let ell = [(0.0, 0.0), (60.0, 0.0), (60.0, 10.0), (10.0, 10.0), (10.0, 60.0), (0.0, 60.0)];
        assert_eq!(boxes(&[building(prism(&[&ell], 0.0, 9.0))]), None, "two wings of 50 m");
        let outer = [(0.0, 0.0), (70.0, 0.0), (70.0, 70.0), (30.0, 71.0), (0.0, 70.0)];
        let yard = [(10.0, 10.0), (10.0, 60.0), (60.0, 60.0), (60.0, 10.0)];
        assert_eq!(boxes(&[building(prism(&[&outer[..], &yard[..]], 0.0, 9.0))]), None, "a yard of 50 m");
        let plain = [(0.0, 0.0), (8.0, 0.0), (8.0, 5.0), (0.0, 5.0)];
        assert_eq!(boxes(&[building(prism(&[&plain], 0.0, 9.0))]), None, "it is a box already");
    }

    #[test]
    fn what_has_no_block_is_shown_as_it_is() {
        let porch = [(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (2.0, 3.5), (0.0, 3.0)];
        let mut roof = building(Shell::default());
        roof.lods = Lods { lod2: vec![prism(&[&porch], 0.0, 3.0)], ..Lods::default() };
        let (found, _) = boxes(&[building(prism(&[&porch], 0.0, 3.0)), roof.clone()]).expect("one box");
        assert_eq!(found[1], roof);
        assert_eq!(boxes(&[]), None);
    }
}
