//! What must hold of every arrangement.
use gable_arrangement::{Arrangement, Extension, Options, extend};
use gable_geometry::{Counter, DVec2, Polygon, dvec2, ring_area};
use proptest::prelude::*;

type Segment = (DVec2, DVec2);

fn frame(side: f64) -> Vec<Segment> {
    let c = [dvec2(0.0, 0.0), dvec2(side, 0.0), dvec2(side, side), dvec2(0.0, side)];
    (0..4).map(|i| (c[i], c[(i + 1) % 4])).collect()
}

/// Coordinates on a coarse raster give many coincidences, overlaps and triple points.
fn coarse() -> impl Strategy<Value = Vec<Segment>> {
    let p = || (0i32..9, 0i32..9).prop_map(|(x, y)| dvec2(f64::from(x), f64::from(y)));
    prop::collection::vec((p(), p()), 1..40)
}

fn fine() -> impl Strategy<Value = Vec<Segment>> {
    let p = || (0.0..8.0, 0.0..8.0).prop_map(|(x, y)| dvec2(x, y));
    prop::collection::vec((p(), p()), 1..40)
}

fn check(a: &Arrangement) -> Result<(), TestCaseError> {
    let (v, e, f) = (a.vertices().len(), a.half_edges().len() / 2, a.faces().len());
    prop_assert_eq!(v + f, e + 1 + a.components(), "Euler");
    let mut points = std::collections::BTreeSet::new();
    for p in a.vertices() {
        prop_assert!(points.insert((p.x.to_bits(), p.y.to_bits())));
    }
    for (i, h) in a.half_edges().iter().enumerate() {
        prop_assert_eq!(a.half_edges()[h.twin as usize].twin as usize, i);
        prop_assert_eq!(a.half_edges()[h.next as usize].face, h.face);
        prop_assert_eq!(a.half_edges()[h.next as usize].origin, a.target(i as u32));
        prop_assert_ne!(a.half_edges()[h.twin as usize].face, h.face);
    }
    let mut on_boundary = vec![false; a.half_edges().len()];
    for face in 0..f as u32 {
        for h in a.boundary(face).flat_map(|s| a.cycle(s)) {
            prop_assert_eq!(a.half_edges()[h as usize].face, face);
            prop_assert!(!std::mem::replace(&mut on_boundary[h as usize], true));
        }
        if face == 0 {
            continue;
        }
        let polygon = a.face_polygon(face);
        prop_assert!(ring_area(&polygon.outer) > 0.0 && polygon.holes.iter().all(|h| ring_area(h) < 0.0));
        prop_assert!((polygon.area() - a.faces()[face as usize].area).abs() < 1e-6);
        let inside = a.point_inside(face).unwrap();
        prop_assert!(polygon.contains(inside));
        prop_assert_eq!(a.locate(inside), face);
    }
    prop_assert!(on_boundary.iter().all(|&b| b));
    Ok(())
}

/// No two edges meet but at common ends (brute force).
fn check_crossings(a: &Arrangement) -> Result<(), TestCaseError> {
    use gable_geometry::{Orientation::On, orientation};
    let ends: Vec<_> =
        a.edges().map(|e| (a.half_edges()[e.half_edge as usize].origin, a.target(e.half_edge))).collect();
    let at = |v: u32| a.vertices()[v as usize];
    for (i, &(p, q)) in ends.iter().enumerate() {
        for v in (0..a.vertices().len() as u32).filter(|&v| v != p && v != q) {
            let (x, between) = (at(v), (at(v) - at(p)).dot(at(v) - at(q)) < 0.0);
            prop_assert!(!(between && orientation(at(p), at(q), x) == On), "vertex on an edge");
        }
        for &(r, s) in &ends[i + 1..] {
            let (o1, o2) = (orientation(at(p), at(q), at(r)), orientation(at(p), at(q), at(s)));
            let (o3, o4) = (orientation(at(r), at(s), at(p)), orientation(at(r), at(s), at(q)));
            let none_on = ![o1, o2, o3, o4].contains(&On);
            prop_assert!(!(none_on && o1 != o2 && o3 != o4), "edges cross");
        }
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]

    #[test]
    fn coincidences(segments in coarse()) {
        let a = Arrangement::build(&segments, &Options::default());
        check(&a)?;
        check_crossings(&a)?;
    }

    #[test]
    fn general_position(segments in fine()) {
        let a = Arrangement::build(&segments, &Options::default());
        check(&a)?;
        check_crossings(&a)?;
        let extended = extend(&segments, Extension::UntilHit { ratio: 0.5, limit: 1.0, touch: 0.01 });
        check(&Arrangement::build(&extended, &Options::default()))?;
    }

    /// A lattice so coarse that almost everything is bent.
    #[test]
    fn coarse_lattice(segments in fine()) {
        let a = Arrangement::build(&segments, &Options { snap: 0.25 });
        check(&a)?;
        check_crossings(&a)?;
    }

    #[test]
    fn areas_fill_the_frame(mut segments in fine()) {
        for s in frame(8.0) {
            segments.push(s);
        }
        let a = Arrangement::build(&segments, &Options::default());
        let sum: f64 = a.faces()[1..].iter().map(|f| f.area).sum();
        prop_assert!((sum - 64.0).abs() < 1e-9, "{}", sum);
    }

    #[test]
    fn order_does_not_matter(segments in coarse(), seed in 0u64..99) {
        let mut rng = Counter::new(seed);
        let mut other = segments.clone();
        for i in (1..other.len()).rev() {
            other.swap(i, rng.index(i + 1));
            if rng.unit() < 0.5 {
                other[i] = (other[i].1, other[i].0);
            }
        }
        let (a, b) = (Arrangement::build(&segments, &Options::default()), Arrangement::build(&other, &Options::default()));
        prop_assert_eq!(a.vertices(), b.vertices());
        prop_assert_eq!(a.faces(), b.faces());
    }

    #[test]
    fn raster_agrees_with_polygons(segments in fine()) {
        let a = Arrangement::build(&segments, &Options::default());
        let (x0, y0, w, h, step) = (-3i64, 2i64, 60usize, 50usize, 0.17);
        let raster = a.face_raster(x0, y0, w, h, step);
        let polygons: Vec<Polygon> = (0..a.faces().len() as u32).map(|f| a.face_polygon(f)).collect();
        for row in 0..h {
            for column in 0..w {
                let p = dvec2((x0 + column as i64) as f64 + 0.5, (y0 + row as i64) as f64 + 0.5) * step;
                let face = raster[row * w + column];
                let expected = (1..polygons.len()).find(|&f| polygons[f].contains(p)).unwrap_or(0) as u32;
                prop_assert!(face == expected || polygons[face.max(expected) as usize].boundary_distance(p) < 1e-9);
            }
        }
    }
}

#[test]
fn a_square_cut_by_200_lines_has_the_faces_that_euler_counts() {
    // Lines in general position that all cross the square: faces = 1 + lines + crossings inside.
    let side = 100.0;
    let mut rng = Counter::new(5);
    let mut lines: Vec<Segment> = Vec::new();
    while lines.len() < 200 {
        let (s, t) = (rng.range(0.0, side), rng.range(0.0, side));
        lines.push(if rng.unit() < 0.5 { (dvec2(s, 0.0), dvec2(t, side)) } else { (dvec2(0.0, s), dvec2(side, t)) });
    }
    let mut crossings = 0;
    for (i, &(a, b)) in lines.iter().enumerate() {
        for &(c, d) in &lines[i + 1..] {
            let (u, v) = (b - a, d - c);
            let t = (c - a).perp_dot(v) / u.perp_dot(v);
            let s = (c - a).perp_dot(u) / u.perp_dot(v);
            crossings += usize::from((0.0..1.0).contains(&t) && (0.0..1.0).contains(&s));
        }
    }
    let all: Vec<Segment> = frame(side).into_iter().chain(lines.iter().copied()).collect();
    // A lattice fine enough that no cell vanishes.
    let a = Arrangement::build(&all, &Options { snap: 2f64.powi(-20) });
    assert_eq!(a.faces().len() - 1, 1 + lines.len() + crossings);
    assert_eq!(a.components(), 1);
}

#[test]
fn nested_components_are_holes_of_the_face_around_them() {
    let square = |lo: f64, hi: f64| -> Vec<Segment> {
        let c = [dvec2(lo, lo), dvec2(hi, lo), dvec2(hi, hi), dvec2(lo, hi)];
        (0..4).map(|i| (c[i], c[(i + 1) % 4])).collect()
    };
    let mut segments = square(0.0, 10.0);
    segments.extend(square(2.0, 8.0));
    segments.extend(square(4.0, 6.0));
    segments.push((dvec2(0.0, 5.0), dvec2(3.0, 5.0))); // dangles inside the second square
    segments.push((dvec2(8.0, 5.0), dvec2(10.0, 5.0))); // a bridge
    let a = Arrangement::build(&segments, &Options::default());
    let mut areas: Vec<f64> = a.faces()[1..].iter().map(|f| f.area).collect();
    areas.sort_by(f64::total_cmp);
    // Both together cut the outer ring in two halves.
    assert_eq!(areas, [4.0, 32.0, 32.0, 32.0]);
    segments.pop();
    let a = Arrangement::build(&segments, &Options::default());
    let mut areas: Vec<f64> = a.faces()[1..].iter().map(|f| f.area).collect();
    areas.sort_by(f64::total_cmp);
    assert_eq!((a.components(), areas), (3, vec![4.0, 32.0, 64.0]));
    assert_eq!(a.locate(dvec2(5.0, 5.0)), a.locate(dvec2(5.5, 4.5)));
    let ring = a.face_polygon(a.locate(dvec2(1.0, 1.0)));
    assert_eq!((ring.holes.len(), ring.area()), (1, 64.0));
}

#[test]
fn bad_coordinates_are_left_out() {
    let mut segments = frame(4.0);
    segments.push((dvec2(f64::NAN, 0.0), dvec2(1.0, 1.0)));
    segments.push((dvec2(1.0, f64::INFINITY), dvec2(1.0, 1.0)));
    let a = Arrangement::build(&segments, &Options::default());
    assert_eq!((a.skipped(), a.faces().len(), a.faces()[1].area), (2, 2, 16.0));
    assert_eq!(Arrangement::build(&[], &Options::default()).faces().len(), 1);
}
