//! Hand-made geometries for every code.

use super::*;
use crate::Semantic;
use crate::shell::samples::{cuboid, face, gabled, prism};
use gable_geometry::{DVec3, dvec3};

const FINE: [u16; 0] = [];
const FAR: DVec3 = DVec3::new(85_000.0, 446_000.0, 1.0);

fn codes(issues: &[Issue]) -> Vec<u16> {
    let mut codes: Vec<_> = issues.iter().map(|issue| issue.code.number()).collect();
    codes.dedup();
    codes
}

fn solid(shell: &Shell) -> Vec<u16> {
    codes(&validate_solid(shell, &Tolerances::default()))
}

/// Codes of one polygon in the plane z = 2, and of the same polygon stood upright and turned.
fn polygon(rings: &[&[(f64, f64)]]) -> Vec<u16> {
    let results: Vec<_> = [0, 1, 2]
        .into_iter()
        .map(|turn| {
            let mut shell = Shell::default();
            let mut indices = Vec::new();
            for ring in rings {
                let start = shell.vertices.len() as u32;
                indices.push((start..start + ring.len() as u32).collect::<Vec<_>>());
                shell.vertices.extend(ring.iter().map(|&(x, y)| match turn {
                    0 => FAR + dvec3(x, y, 2.0),
                    1 => FAR + dvec3(2.0, x, y),
                    _ => FAR + dvec3(x, x + 1.0, y),
                }));
            }
            let indices: Vec<_> = indices.iter().map(Vec::as_slice).collect();
            shell.faces.push(face(&indices, Semantic::RoofSurface));
            codes(&validate_surfaces(&shell, &Tolerances::default()))
        })
        .collect();
    assert!(results.iter().all(|r| *r == results[0]), "{results:?}");
    results[0].clone()
}

const SQUARE: [(f64, f64); 4] = [(0., 0.), (10., 0.), (10., 10.), (0., 10.)];

#[test]
fn valid_solids() {
    let outer = [(0., 0.), (9., 0.), (9., 4.), (5., 4.), (5., 7.), (0., 7.)];
    let hole = [(1., 1.), (1., 2.), (2., 2.), (2., 1.)];
    let inner = cuboid(FAR + 1.0, FAR + 2.0).reversed();
    for tolerances in [Tolerances::default(), Tolerances::strict()] {
        for shell in [cuboid(FAR, FAR + 3.0), gabled(FAR), prism(&[&outer], 0.0, 3.0), prism(&[&outer, &hole], 0., 3.)]
        {
            assert_eq!(codes(&validate_solid(&shell, &tolerances)), FINE);
        }
        let hollow = validate_solid_with_cavities(&cuboid(FAR, FAR + 3.0), std::slice::from_ref(&inner), &tolerances);
        assert_eq!(codes(&hollow), FINE);
    }
}

#[test]
fn rings_1xx() {
    assert_eq!(polygon(&[&[(0., 0.), (5., 0.)]]), [101]);
    assert_eq!(polygon(&[&[(0., 0.), (5., 0.), (0.0005, 0.0)]]), [101]);
    assert_eq!(polygon(&[&[(0., 0.), (5., 0.), (5.0004, 0.), (5., 5.)]]), [102]);
    assert_eq!(polygon(&[&[(0., 0.), (5., 0.), (5., 5.), (0., 5.), (0., 0.)]]), [102]);
    // Bow tie with and without area, spike, a vertex on another edge, a vertex visited twice.
    assert_eq!(polygon(&[&[(0., 0.), (5., 5.), (5., 0.), (0., 5.)]]), [104]);
    assert_eq!(polygon(&[&[(0., 0.), (5., 5.), (5., 0.), (0., 9.)]]), [104]);
    assert_eq!(polygon(&[&[(0., 0.), (5., 0.), (9., 0.), (5., 0.0), (5., 5.)]]), [104]);
    assert_eq!(polygon(&[&[(0., 0.), (9., 0.), (5., 0.), (5., 5.)]]), [104]);
    assert_eq!(polygon(&[&[(0., 0.), (10., 0.), (10., 5.), (5., 0.), (0., 5.)]]), [104]);
    assert_eq!(polygon(&[&[(0., 0.), (4., 0.), (2., 2.), (4., 4.), (0., 4.), (2., 2.)]]), [104]);
    assert_eq!(polygon(&[&[(0., 0.), (4., 0.), (9., 0.)]]), [105]);
    assert_eq!(polygon(&[&SQUARE]), FINE);
}

#[test]
fn polygons_2xx() {
    let hole = |x: f64, y: f64, s: f64| [(x, y), (x, y + s), (x + s, y + s), (x + s, y)];
    assert_eq!(polygon(&[&SQUARE, &hole(2., 2., 2.), &hole(5., 5., 2.)]), FINE);
    assert_eq!(polygon(&[&SQUARE, &hole(8., 8., 4.)]), [201]);
    assert_eq!(polygon(&[&SQUARE, &hole(2., 2., 3.), &hole(4., 4., 3.)]), [201]);
    // A shared piece of edge, and a crossing through corners.
    assert_eq!(polygon(&[&SQUARE, &hole(2., 0., 3.)]), [201]);
    assert_eq!(polygon(&[&SQUARE, &[(10., 0.), (5., 5.), (0., 10.), (12., 12.)]]), [201]);
    assert_eq!(polygon(&[&SQUARE, &hole(2., 2., 3.), &hole(2., 2., 3.)]), [202]);
    // Touching in one point is allowed, in two it cuts the interior.
    assert_eq!(polygon(&[&SQUARE, &[(0., 5.), (2., 6.), (2., 4.)]]), FINE);
    assert_eq!(polygon(&[&SQUARE, &[(0., 5.), (5., 6.), (10., 5.), (5., 4.)]]), [205]);
    assert_eq!(polygon(&[&SQUARE, &[(0., 5.), (5., 6.), (5., 4.)], &[(5., 6.), (10., 5.), (6., 4.)]]), [205]);
    assert_eq!(polygon(&[&SQUARE, &[(0., 5.), (5., 6.), (5., 4.)], &[(5., 6.), (9., 5.), (6., 4.)]]), FINE);
    assert_eq!(polygon(&[&SQUARE, &hole(12., 2., 2.)]), [206]);
    assert_eq!(polygon(&[&SQUARE, &hole(2., 2., 6.), &hole(3., 3., 2.)]), [207]);
    assert_eq!(polygon(&[&SQUARE, &[(2., 2.), (4., 2.), (4., 4.), (2., 4.)]]), [208]);
}

#[test]
fn planarity_203_204() {
    let mut lifted = cuboid(FAR, FAR + 5.0);
    lifted.vertices[7].z += 0.05;
    assert_eq!(solid(&lifted), [203]);
    lifted.vertices[7].z -= 0.03;
    assert_eq!(solid(&lifted), FINE);
    assert_eq!(codes(&validate_solid(&lifted, &Tolerances::strict())), [203]);
    // A strip of 9 mm, folded within the planarity tolerance but at 40°.
    let mut shell = Shell { vertices: vec![], faces: vec![face(&[&[0, 1, 2, 3]], Semantic::RoofSurface)] };
    shell
        .vertices
        .extend([(0., 0., 0.), (4., 0.009, 0.), (8., 0., 0.), (4., -0.009, 0.009)].map(|(x, y, z)| dvec3(x, y, z)));
    assert_eq!(codes(&validate_surfaces(&shell, &Tolerances::default())), [204]);
}

#[test]
fn shells_3xx() {
    let open = |drop: usize| {
        let mut shell = cuboid(FAR, FAR + 3.0);
        shell.faces.truncate(drop);
        shell
    };
    assert_eq!(solid(&open(3)), [301]);
    assert_eq!(solid(&open(5)), [302]);
    let mut turned = cuboid(FAR, FAR + 3.0);
    turned.faces[3].rings[0].reverse();
    assert_eq!(solid(&turned), [307]);

    let unite = |mut a: Shell, b: Shell| {
        let shift = a.vertices.len() as u32;
        a.vertices.extend(b.vertices);
        a.faces.extend(b.faces.into_iter().map(|mut f| {
            f.rings.iter_mut().flatten().for_each(|i| *i += shift);
            f
        }));
        a
    };
    assert_eq!(solid(&unite(cuboid(FAR, FAR + 1.0), cuboid(FAR + 2.0, FAR + 3.0))), [305]);
    // Two boxes that touch in an edge, and in a corner.
    assert_eq!(solid(&unite(cuboid(FAR, FAR + 1.0), cuboid(FAR + dvec3(1., 1., 0.), FAR + dvec3(2., 2., 1.)))), [304]);
    assert_eq!(solid(&unite(cuboid(FAR, FAR + 1.0), cuboid(FAR + 1.0, FAR + 2.0))), [305]);
    // The outline passes one corner twice: roof and floor touch themselves as rings.
    let pinched = [(0., 0.), (4., 0.), (4., 2.), (2., 2.), (2., 4.), (4., 4.), (4., 6.), (0., 6.)];
    assert_eq!(solid(&prism(&[&pinched], 0.0, 3.0)), FINE);
}

/// A block with two pits in its roof that touch in one point below the rim: one component, one pinched vertex.
#[test]
fn pinched_vertex_303() {
    let mut shell = cuboid(dvec3(0., 0., 0.), dvec3(10., 10., 5.));
    let tip = shell.vertices.len() as u32;
    shell.vertices.push(dvec3(5., 5., 3.));
    // A pyramid pit from above whose tip is the top of a pyramid pit from below.
    for (z, ccw) in [(5.0, false), (0.0, true)] {
        let start = shell.vertices.len() as u32;
        shell.vertices.extend([(4., 4.), (6., 4.), (6., 6.), (4., 6.)].map(|(x, y)| dvec3(x, y, z)));
        let mut ring: Vec<u32> = (start..start + 4).collect();
        if !ccw {
            ring.reverse();
        }
        let cap = usize::from(!ccw);
        shell.faces[cap].rings.push(ring.clone());
        for k in 0..4 {
            shell.faces.push(face(&[&[ring[(k + 1) % 4], ring[k], tip]], Semantic::RoofSurface));
        }
    }
    assert_eq!(solid(&shell), [303]);
    // With the pits apart it is valid.
    let below = shell.vertices.len() as u32;
    shell.vertices.push(dvec3(5., 5., 2.));
    for f in shell.faces.iter_mut().rev().take(4) {
        f.rings[0][2] = below;
    }
    assert_eq!(solid(&shell), FINE);
    // With the pit from below reaching through the one from above it crosses itself.
    shell.vertices[below as usize].z = 4.0;
    assert_eq!(solid(&shell), [306]);
}

#[test]
fn touching_walls_306() {
    // A U whose arms meet: a wall lies on another without sharing its corners.
    let u = [(0., 0.), (9., 0.), (9., 9.), (6., 9.), (6., 3.), (3., 3.), (3., 9.), (0., 9.)];
    let mut shell = prism(&[&u], 0.0, 3.0);
    assert_eq!(solid(&shell), FINE);
    // Move one arm's roof corners into the other arm.
    for v in &mut shell.vertices {
        if v.x == 3.0 && v.y == 9.0 {
            v.x = 7.0;
        }
    }
    assert!([vec![104], vec![306]].contains(&solid(&shell)));
    // The roof dips below the floor in one place.
    let mut house = gabled(DVec3::ZERO);
    house.vertices[8].z = -1.0;
    house.vertices[9].z = -1.0;
    assert_eq!(solid(&house), [104]);
}

#[test]
fn cavities_4xx() {
    let outer = cuboid(FAR, FAR + 9.0);
    let check = |cavities: &[Shell]| codes(&validate_solid_with_cavities(&outer, cavities, &Tolerances::default()));
    let cavity = |low: f64, high: f64| cuboid(FAR + low, FAR + high).reversed();
    assert_eq!(solid(&outer.reversed()), [405]);
    assert_eq!(check(&[cavity(1., 2.), cavity(3., 4.)]), FINE);
    assert_eq!(check(&[cavity(8., 10.)]), [401]);
    assert_eq!(check(&[cavity(1., 3.), cavity(2., 4.)]), [401]);
    assert_eq!(check(&[outer.reversed()]), [402]);
    assert_eq!(check(&[cavity(10., 11.)]), [403]);
    assert_eq!(check(&[cavity(1., 4.), cavity(2., 3.)]), [403]);
    assert_eq!(check(&[cavity(1., 2.).reversed()]), [405]);
    // A cavity on the floor would leave no matter between: contact in an area.
    assert_eq!(check(&[cuboid(FAR + dvec3(1., 1., 0.), FAR + 2.0).reversed()]), [401]);
}

#[test]
fn parts_601() {
    let check = |solids: &[Shell]| codes(&validate_parts(solids, &Tolerances::default()));
    let a = cuboid(FAR, FAR + 4.0);
    let shifted = |x: f64| cuboid(FAR + dvec3(x, 1.0, 0.0), FAR + dvec3(x + 4.0, 3.0, 2.0));
    assert_eq!(check(&[a.clone(), shifted(4.0)]), FINE);
    assert_eq!(check(&[a.clone(), shifted(3.995)]), FINE);
    assert_eq!(check(&[a.clone(), shifted(3.9)]), [601]);
    assert_eq!(check(&[a.clone(), a.clone()]), [601]);
    assert_eq!(check(&[a.clone(), cuboid(FAR + 1.0, FAR + 2.0)]), [601]);
    assert_eq!(check(&[a.clone(), cuboid(FAR + dvec3(1., 1., -1.), FAR + dvec3(2., 2., 9.))]), [601]);
    assert_eq!(check(&[a.clone(), cuboid(FAR + dvec3(0., 0., 4.), FAR + dvec3(4., 4., 9.))]), FINE);
}

#[test]
fn nonsense_makes_no_panic() {
    let tolerances = Tolerances::default();
    assert_eq!(codes(&validate_solid(&Shell::default(), &tolerances)), [902]);
    let mut shell = cuboid(FAR, FAR + 1.0);
    shell.faces[0].rings[0][0] = 77;
    assert_eq!(solid(&shell), [901]);
    let mut shell = cuboid(FAR, FAR + 1.0);
    shell.vertices[0].x = f64::NAN;
    assert_eq!(solid(&shell), [901]);
    let mut shell = cuboid(FAR, FAR + 1.0);
    shell.faces[0].rings.clear();
    assert_eq!(solid(&shell), [101]);
    shell.faces[0].rings.push(vec![]);
    assert_eq!(solid(&shell), [101]);
}

#[test]
fn rounding_is_judged_as_written() {
    // A roof that is valid as computed; at 0.1 mm two of its corners are one and a sliver goes.
    let outline = [(0., 0.), (5., 0.), (5.000_03, 0.000_02), (5., 5.), (0., 5.)];
    let written = crate::quantised(&prism(&[&outline], 0.0, 3.0));
    assert_eq!(codes(&validate_solid(&written, &Tolerances::strict())), FINE);
}

proptest::proptest! {
    /// Houses with disturbed corners: whatever comes out, no panic, the same answer twice, and lists of codes that
    /// belong to one level.
    #[test]
    fn disturbed_houses(moves in proptest::collection::vec((0..10usize, -9.0..9.0f64, -9.0..9.0f64, -9.0..9.0f64), 0..6)) {
        let mut house = gabled(FAR);
        for (i, x, y, z) in moves {
            house.vertices[i] += dvec3(x.round(), y.round(), z);
        }
        let issues = validate_solid(&house, &Tolerances::default());
        proptest::prop_assert_eq!(&issues, &validate_solid(&house, &Tolerances::default()));
        let mut levels: Vec<_> = issues.iter().map(|issue| (issue.code.number() / 100).max(2)).collect();
        levels.dedup();
        proptest::prop_assert!(levels.len() <= 1, "{:?}", issues);
        if issues.is_empty() {
            proptest::prop_assert!(house.volume() > 0.0);
        }
    }
}

#[test]
fn holes_of_one_roof_that_touch() {
    // On a flat roof, a box and a pit under a tilted lid share the corner (2, 2): all of one fan, but of two rings.
    let at = |corners: &[(i32, i32, f64)]| -> Vec<DVec3> {
        corners.iter().map(|&(x, y, z)| FAR + dvec3(f64::from(x), f64::from(y), z)).collect()
    };
    let mut shell = cuboid(FAR, FAR + dvec3(4.0, 4.0, 1.0));
    let first = shell.vertices.len() as u32;
    shell.vertices.extend(at(&[(1, 1, 1.0), (2, 1, 1.0), (2, 2, 1.0), (1, 2, 1.0)]));
    shell.vertices.extend(at(&[(1, 1, 2.0), (2, 1, 2.0), (2, 2, 2.0), (1, 2, 2.0)]));
    shell.vertices.extend(at(&[(3, 2, 1.0), (3, 3, 1.0), (3, 2, 0.5), (3, 3, 0.5)]));
    let ring = |corners: &[u32]| corners.iter().map(|i| first + i).collect::<Vec<u32>>();
    let roof = shell.faces.iter().position(|f| f.semantic == Semantic::RoofSurface).expect("a roof");
    shell.faces[roof].rings.extend([ring(&[0, 3, 2, 1]), ring(&[2, 9, 8])]);
    for wall in [[0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7], [4, 5, 6, 7], [8, 9, 11, 10]] {
        shell.faces.push(face(&[&ring(&wall)], Semantic::WallSurface));
    }
    for wall in [[2, 10, 11], [2, 8, 10], [9, 2, 11]] {
        shell.faces.push(face(&[&ring(&wall)], Semantic::WallSurface));
    }
    assert_eq!(solid(&shell), FINE);
    // So it is with a ramp that rises from the corner.
    let mut ramp = shell.clone();
    ramp.vertices[first as usize + 10].z = FAR.z + 1.5;
    ramp.vertices[first as usize + 11].z = FAR.z + 1.5;
    assert_eq!(solid(&ramp), FINE);
}
