//! Every metric against figures that can be worked out by hand.

mod made;

use proptest::prelude::*;

use gable_city_model::{CityModel, Shell, Terrain, triangulate};
use gable_evaluation::{
    Detection, Evaluation, Inputs, LabelRasters, Options, agreement, evaluate, html_report, inspect,
};
use gable_geometry::{DVec3, dvec3};
use made::{building, city, gable, ground, house, moved, prism, rectangle};

const DENSE: Options = Options { roof_step: 0.25, density: 100.0, seed: 1 };

fn judge(truth: &CityModel, result: &CityModel) -> Evaluation {
    evaluate(Inputs::new(truth, result), &DENSE).unwrap()
}

#[track_caller]
fn near(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{value} is not {expected}");
}

/// A gabled house, two houses wall to wall, a shed.
fn village() -> CityModel {
    city(vec![
        building("gable", gable()),
        house("left", 20., 0., 10., 10., 6.),
        house("right", 30., 0., 10., 10., 8.),
        house("shed", 60., 0., 2., 2., 2.5),
    ])
}

#[test]
fn the_truth_against_itself_is_perfect() {
    let mut truth = village();
    truth.terrain = Some(ground(1.0));
    let e = judge(&truth, &truth);
    for d in &e.objects {
        let rates = [d.per_object, d.per_area];
        assert!(rates.iter().flat_map(|r| [r.completeness, r.correctness, r.quality]).all(|v| (v - 1.0).abs() < 1e-9));
    }
    assert_eq!(e.objects.iter().map(|d| d.truth).collect::<Vec<_>>(), [4, 3, 3]);
    assert!(e.missed.is_empty() && e.invented.is_empty());
    for (overlap, count) in [(e.footprints.buildings, 4), (e.footprints.blocks, 3), (e.footprints.blocks_from_50, 2)] {
        assert_eq!(overlap.count, count);
        near(overlap.mean_iou, 1.0, 1e-9);
        near(overlap.above_90, 1.0, 0.0);
    }
    let r = &e.roofs;
    assert_eq!((r.matched, r.covered, r.height_rmse, r.height_bias), (4, 1.0, 0.0, 0.0));
    assert_eq!((r.slope_error_deg, r.azimuth_error_deg, r.ridge_error.max, r.eave_error.max), (0.0, 0.0, 0.0, 0.0));
    near(r.volume_ratio, 1.0, 1e-12);
    assert_eq!((r.planes.truth, r.planes.one_to_one, r.planes.one_to_one_area), (5, 5, 1.0));
    let d = &e.distances;
    assert!([d.truth_to_model, d.model_to_truth].iter().all(|s| s.count > 0 && s.max < 1e-9));
    assert!(e.footprints.outline_truth_to_result.max < 1e-9 && e.footprints.corner_offset.max < 1e-9);
    let c = &e.complexity.against_truth;
    assert_eq!((c.polygons, c.triangles, c.vertices), (1.0, 1.0, 1.0));
    assert_eq!(
        (e.validity.lod2, e.validity_strict.lod2, e.coherence.lod1_on_lod0, e.coherence.volumes),
        (1., 1., 1., 1.)
    );
    assert_eq!(e.terrain.unwrap().open.max, 0.0);
}

#[test]
fn another_origin_changes_nothing() {
    let truth = village();
    let mut other = moved(&truth, dvec3(-500.0, 300.0, -20.0));
    other.origin = [500.0, -300.0, 20.0];
    let e = judge(&truth, &other);
    near(e.footprints.buildings.mean_iou, 1.0, 1e-9);
    near(e.roofs.height_rmse, 0.0, 1e-9);
    near(e.distances.truth_to_model.max, 0.0, 1e-9);
}

#[test]
fn detection_by_number_and_area() {
    // Truth: 100 m² found whole, 20 m² covered by 40 %, 60 m² missing, a shed of 4 m² covered by half.
    let truth = city(vec![
        house("whole", 0., 0., 10., 10., 5.),
        house("part", 20., 0., 5., 4., 5.),
        house("missing", 40., 0., 10., 6., 5.),
        house("shed", 60., 0., 2., 2., 5.),
    ]);
    // Result: 50 + 50 m² stand for one building; 2 m of 5 m; 30 m² that are not there; a shed twice as large.
    let result = city(vec![
        house("a", 0., 0., 5., 10., 5.),
        house("b", 5., 0., 5., 10., 5.),
        house("c", 20., 0., 2., 4., 5.),
        house("d", 80., 0., 5., 6., 5.),
        house("e", 61., 0., 2., 2., 5.),
    ]);
    let e = judge(&truth, &result);
    let counts = |d: &Detection| [d.truth, d.found, d.result, d.correct];
    assert_eq!(counts(&e.objects[0]), [4, 2, 5, 4]);
    assert_eq!(counts(&e.objects[1]), [3, 1, 3, 2]);
    assert_eq!(counts(&e.objects[2]), [2, 1, 2, 2]);
    let (all, ten, fifty) = (e.objects[0], e.objects[1], e.objects[2]);
    near(all.per_object.completeness, 0.5, 1e-12);
    near(all.per_object.correctness, 0.8, 1e-12);
    near(all.per_object.quality, 0.4 / 0.9, 1e-12);
    // Areas: truth 184, result 142, shared 100 + 8 + 2.
    near(all.per_area.completeness, 110.0 / 184.0, 1e-6);
    near(all.per_area.correctness, 110.0 / 142.0, 1e-6);
    near(all.per_area.quality, 110.0 / (184.0 + 142.0 - 110.0), 1e-6);
    near(ten.per_area.completeness, 108.0 / 180.0, 1e-6);
    near(ten.per_area.correctness, 100.0 / 130.0, 1e-6);
    near(fifty.per_area.completeness, 100.0 / 160.0, 1e-6);
    assert_eq!(e.missed, ["part", "missing"]);
    assert_eq!(e.invented, ["d"]);
    // Best single partners: 50/100, 8/20, none, 2/6. Blocks: 100/100 by two buildings.
    near(e.footprints.buildings.mean_iou, (0.5 + 0.4 + 0.0 + 2.0 / 6.0) / 4.0, 1e-6);
    near(e.footprints.buildings.median_iou, (0.4 + 2.0 / 6.0) / 2.0, 1e-6);
    near(e.footprints.blocks.mean_iou, (1.0 + 0.4 + 0.0 + 2.0 / 6.0) / 4.0, 1e-6);
    near(e.footprints.blocks_from_50.mean_iou, 0.5, 1e-6);
}

#[test]
fn a_thinned_copy_misses_what_was_taken_out() {
    let truth = village();
    let mut thin = truth.clone();
    thin.buildings.retain(|b| b.id == "gable" || b.id == "left");
    let e = judge(&truth, &thin);
    near(e.objects[0].per_object.completeness, 0.5, 1e-12);
    near(e.objects[0].per_object.correctness, 1.0, 1e-12);
    near(e.objects[2].per_object.completeness, 2.0 / 3.0, 1e-12);
    assert_eq!(e.missed, ["right"]);
    // The block of two keeps half of its 200 m².
    near(e.footprints.blocks_from_50.mean_iou, 0.75, 1e-9);
    near(e.roofs.covered, 180.0 / 284.0, 1e-9);
    // Gone: a plane of 100 m² and the shed's of 4 m².
    assert_eq!((e.roofs.planes.one_to_one, e.roofs.planes.missed), (3, 2));
    // Blocks that have both: 80 · 4 + 80 m³ of gable, 600 + 800 of the pair, 600 left.
    near(e.roofs.volume_ratio, 1000.0 / 1800.0, 1e-9);
}

#[test]
fn a_shifted_copy_has_the_shift() {
    let truth = city(vec![house("a", 0., 0., 10., 10., 6.)]);
    let e = judge(&truth, &moved(&truth, dvec3(1.0, 0.0, 0.0)));
    near(e.footprints.buildings.mean_iou, 90.0 / 110.0, 1e-6);
    near(e.objects[0].per_area.completeness, 0.9, 1e-6);
    near(e.roofs.covered, 0.9, 1e-9);
    // West side 1 m off; east side min(1, y, 10 − y), for the result's long sides run past its ends: 9 over 10 m; south and
    // north sides 1 − x where x < 1, else 0.
    near(e.footprints.outline_truth_to_result.mean, (10.0 + 9.0 + 2.0 * 0.5) / 40.0, 1e-6);
    near(e.footprints.outline_truth_to_result.max, 1.0, 1e-9);
    near(e.footprints.corner_offset.mean, 1.0, 1e-9);
    near(e.footprints.corners_found, 1.0, 0.0);
    near(e.footprints.corner_ratio, 1.0, 0.0);
    let far = judge(&truth, &moved(&truth, dvec3(3.0, 0.0, 0.0)));
    near(far.footprints.corners_found, 0.0, 0.0);

    let up = judge(&truth, &moved(&truth, dvec3(0.0, 0.0, 0.5)));
    near(up.roofs.height_rmse, 0.5, 1e-9);
    near(up.roofs.height_rmse_median_from_50, 0.5, 1e-9);
    near(up.roofs.height_bias, 0.5, 1e-9);
    near(up.roofs.ridge_bias, 0.5, 1e-9);
    near(up.roofs.eave_error.mean, 0.5, 1e-9);
    // Roof points at d from the border are min(d, 0.5) away (the walls now rise beside them): 45.1667 over 100 m².
    // Wall points below 0.5 m are 0.5 − z from the walls' lower ends: 5 over 240 m². Squares: 21.7917 and 1.6667.
    let spread = up.distances.truth_to_model;
    near(spread.mean, (45.1667 + 5.0) / 340.0, 0.003);
    near(spread.rms, ((21.7917 + 1.6667) / 340.0_f64).sqrt(), 0.003);
    near(spread.max, 0.5, 1e-6);
    near(spread.count as f64, 34_000.0, 20.0);
    assert_eq!(spread.count, up.distances.truth_to_model_found_from_50.count);
}

#[test]
fn a_simplified_copy_has_the_errors_of_a_flat_roof() {
    let truth = city(vec![building("gable", gable())]);
    let flat = city(vec![house("flat", 0., 0., 10., 8., 5.)]);
    let e = judge(&truth, &flat);
    // Heights run evenly from 4 to 6 m: the error is uniform on ±1 m; samples lie 0.125 m off eaves and ridge.
    near(e.roofs.height_rmse, (1.0_f64 / 3.0).sqrt(), 0.002);
    near(e.roofs.height_bias, 0.0, 1e-9);
    near(e.roofs.ridge_bias, -(1.0 - 0.0625), 1e-9);
    near(e.roofs.eave_bias, 1.0 - 0.0625, 1e-9);
    near(e.roofs.slope_error_deg, 0.5_f64.atan().to_degrees(), 1e-9);
    near(e.roofs.azimuth_error_deg, 0.0, 0.0);
    near(e.roofs.volume_ratio, 1.0, 1e-12);
    let p = e.roofs.planes;
    assert_eq!((p.truth, p.result, p.many_to_one, p.one_to_one, p.missed), (2, 1, 2, 0, 0));
    let c = &e.complexity;
    // The gable: 2 quads, 2 pentagons, 3 quads; 2·5 + 3·2 triangles. The box: 6 quads.
    assert_eq!((c.truth.polygons, c.truth.triangles, c.truth.vertices), (7, 16, 10));
    assert_eq!((c.result.polygons, c.result.triangles, c.result.vertices), (6, 12, 8));
    near(c.against_truth.triangles, 12.0 / 16.0, 1e-12);
    // The other way round one plane has two partners.
    let back = judge(&flat, &truth);
    assert_eq!((back.roofs.planes.one_to_many, back.roofs.planes.result), (1, 2));
}

/// A wall that stands 1 m beside its place puts a strip of 10 m² under the roof of the neighbour, 6 m lower. Seen as a map the
/// roofs are right, and the figure within planes says so; that of whole buildings tells of the strip.
#[test]
fn a_strip_along_a_wall_is_no_error_of_the_plane() {
    let truth = city(vec![house("high", 0., 0., 10., 10., 10.), house("low", 10., 0., 10., 10., 4.)]);
    let result = city(vec![house("high", 0., 0., 9., 10., 10.3), house("low", 9., 0., 11., 10., 4.)]);
    let e = judge(&truth, &result);
    let high = (0.9 * 0.3_f64.powi(2) + 0.1 * 6.0_f64.powi(2)).sqrt();
    near(e.roofs.height_rmse_median_from_50, high / 2.0, 1e-9);
    near(e.roofs.height_rmse_of_planes_median_from_50, 0.3 / 2.0, 1e-9);
    // One roof over both, whose plane is partner of both: nothing is left out.
    let flat = judge(&truth, &city(vec![house("row", 0., 0., 20., 10., 7.)]));
    near(flat.roofs.height_rmse_of_planes_median_from_50, 3.0, 1e-9);
    // Two boxes against one.
    near(flat.complexity.against_truth.roof_polygons, 0.5, 1e-12);
    near(flat.complexity.against_truth.polygons, 0.5, 1e-12);
    assert_eq!((flat.complexity.truth.roof_polygons, flat.complexity.result.roof_polygons), (2, 1));
}

#[test]
fn the_buildings_furthest_off_are_named() {
    let origin = [500.0, -300.0, 20.0];
    let row = |heights: [f64; 3]| {
        let [a, b, c] = heights;
        let houses =
            vec![house("a", 0., 0., 10., 10., a), house("b", 30., 0., 10., 10., b), house("c", 60., 0., 10., 10., c)];
        CityModel { origin, ..city(houses) }
    };
    let e = judge(&row([6.0, 6.0, 6.0]), &row([6.0, 6.2, 7.0]));
    let named: Vec<&str> = e.furthest.iter().map(|f| f.id.as_str()).collect();
    assert_eq!(named, ["c", "b"]);
    near(e.furthest.iter().map(|f| f.share).sum(), 1.0, 1e-9);
    // Within 4 m.
    near(e.furthest[0].at[0], 565.0, 7.0);
    near(e.furthest[0].at[1], -295.0, 7.0);
    // Of three equal surfaces.
    let all = e.distances.truth_to_model_found_from_50.rms;
    near(e.furthest[0].rms, all * (3.0 * e.furthest[0].share).sqrt(), 0.02);
}

#[test]
fn a_turned_roof_has_the_angle() {
    let shed = |rise: [f64; 4]| {
        let mut solid = prism(&rectangle(0., 0., 8., 8.), 0.0, 4.0);
        rise.iter().enumerate().for_each(|(k, r)| solid.vertices[4 + k].z += r);
        city(vec![building("shed", solid)])
    };
    // One rises to the east by 4 m in 8 m, the other to the north by 2 m in 8 m.
    let e = judge(&shed([0., 4., 4., 0.]), &shed([0., 0., 2., 2.]));
    near(e.roofs.azimuth_error_deg, 90.0, 1e-6);
    near(e.roofs.slope_error_deg, (0.5_f64.atan() - 0.25_f64.atan()).to_degrees(), 1e-6);
}

#[test]
fn walls_between_houses_are_not_sampled() {
    let truth = city(vec![house("left", 0., 0., 10., 10., 6.), house("right", 10., 0., 10., 10., 6.)]);
    let e = judge(&truth, &truth);
    // 200 m² of roof and 60 m of outer walls, 6 m high.
    near(e.distances.truth_to_model.count as f64, 56_000.0, 100.0);
    // Of a wall between 6 m and 8 m the upper 2 m are outside: 200 + 6·30 + 8·30 + 2·10.
    let step = city(vec![house("left", 0., 0., 10., 10., 6.), house("right", 10., 0., 10., 10., 8.)]);
    near(judge(&step, &step).distances.truth_to_model.count as f64, 64_000.0, 100.0);
}

#[test]
fn walls_under_the_ground_are_not_sampled() {
    let mut truth = city(vec![house("cellar", 0., 0., 10., 10., 6.)]);
    let corner = |x: f64, y: f64| DVec3::new(x, y, 2.0);
    truth.terrain = Some(Terrain {
        id: "ground".to_owned(),
        vertices: vec![corner(-9., -9.), corner(19., -9.), corner(19., 19.), corner(-9., 19.)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    });
    // 100 m² of roof and 40 m of walls, of which the lower 2 m − 0.3 m stand in the ground.
    near(judge(&truth, &truth).distances.truth_to_model.count as f64, 100.0 * (100.0 + 40.0 * 4.3), 100.0);
}

fn triangles(solid: &Shell) -> Vec<[DVec3; 3]> {
    triangulate(solid).iter().map(|t| t.corners.map(|i| solid.vertices[i as usize])).collect()
}

#[test]
fn distances_to_the_mesh() {
    let truth = city(vec![house("a", 0., 0., 10., 10., 6.)]);
    // A mesh whose roof is 0.3 m too high inside its walls, with a tree top 5 m above and far-away ground.
    let mut mesh = triangles(&prism(&rectangle(0., 0., 10., 10.), 0.0, 6.0));
    mesh.iter_mut().flatten().filter(|p| p.z == 6.0).for_each(|p| p.z = 6.3);
    mesh.push([dvec3(4., 4., 11.), dvec3(6., 4., 11.), dvec3(5., 6., 11.)]);
    mesh.push([dvec3(100., 0., 0.), dvec3(110., 0., 0.), dvec3(100., 9., 0.)]);
    let inputs = || Inputs { mesh: Some(Box::new(mesh.clone().into_iter())), ..Inputs::new(&truth, &truth) };
    let e = evaluate(inputs(), &DENSE).unwrap();
    let roof = e.distances.roof_points_to_roofs.unwrap();
    near(roof.count as f64, 10_000.0, 5.0);
    near(roof.mean, 0.3, 1e-9);
    near(roof.max, 0.3, 1e-9);
    let model = e.distances.model_to_mesh.unwrap();
    // Walls coincide; roof points are min(d, 0.3) off: ∫ over the border strip plus 0.3 inside 9.4 × 9.4 m.
    let strip = 4.0 * (5.0 * 0.09 - 2.0 / 3.0 * 0.027);
    near(model.mean, (strip + 0.3 * 9.4 * 9.4) / 340.0, 0.002);
    assert_eq!(model, e.distances.truth_to_mesh.unwrap());
    assert_eq!(evaluate(inputs(), &DENSE).unwrap(), e, "the same samples every time");
}

#[test]
fn distances_from_lod2_roofs_to_the_mesh() {
    // One flat roof at 6 m; the mesh over it is a plane that rises from 6 m at x = 0 to 7 m at x = 10 and goes on far beyond:
    // points are x / 10 · cos(atan 0.1) off it. A second building has no LOD2, a third nothing over it.
    let mut only_lod1 = house("only LOD1", 20., 0., 10., 10., 6.);
    only_lod1.lods.lod2.clear();
    let mesh = vec![
        [dvec3(-50., -50., 1.), dvec3(50., -50., 11.), dvec3(50., 50., 11.)],
        [dvec3(-50., -50., 1.), dvec3(50., 50., 11.), dvec3(-50., 50., 1.)],
    ];
    let lean = 1.0 / 1.01_f64.sqrt();
    let one = city(vec![house("a", 0., 0., 10., 10., 6.), only_lod1.clone()]);
    let i = inspect(&one, Some(Box::new(mesh.clone().into_iter())), &DENSE).unwrap();
    let roofs = i.lod2_roofs_to_mesh.unwrap();
    near(roofs.count as f64, 10_000.0, 3.0);
    near(roofs.mean, 0.5 * lean, 0.01);
    near(roofs.rms, lean / 3.0_f64.sqrt(), 0.01);
    near(roofs.p95, 0.95 * lean, 0.01);
    near(roofs.max, lean, 0.01);
    // With the walls, and the block model of the other building: more points, and farther.
    let model = i.model_to_mesh.unwrap();
    assert!(model.count > 60_000 && model.mean > 1.5, "{model:?}");
    assert_eq!((i.size.buildings, i.validity.without_lod2), (2, 1));

    // The same figures with the truth beside; far from the mesh distances count 10 m.
    let truth = city(vec![house("a", 0., 0., 10., 10., 6.)]);
    let inputs = Inputs { mesh: Some(Box::new(mesh.into_iter())), ..Inputs::new(&truth, &one) };
    assert_eq!(evaluate(inputs, &DENSE).unwrap().distances.lod2_roofs_to_mesh, Some(roofs));
    let far = vec![[dvec3(-5., 0., 500.), dvec3(5., 0., 500.), dvec3(0., 9., 500.)]];
    let i = inspect(&truth, Some(Box::new(far.into_iter())), &DENSE).unwrap();
    assert_eq!(i.lod2_roofs_to_mesh.map(|s| (s.mean, s.max)), Some((10.0, 10.0)));
    assert_eq!(inspect(&truth, None, &DENSE).unwrap().lod2_roofs_to_mesh, None);
    assert!(inspect(&truth, None, &DENSE).unwrap().table().contains("default tolerances"));
}

#[test]
fn far_and_missing_buildings_count_ten_metres() {
    let truth = city(vec![house("a", 0., 0., 10., 10., 6.)]);
    let e = judge(&truth, &city(vec![]));
    assert_eq!((e.distances.truth_to_model.mean, e.distances.model_to_truth.count), (10.0, 0));
    assert_eq!((e.objects[0].per_object.completeness, e.validity.buildings), (0.0, 0));
    let nothing = judge(&city(vec![]), &city(vec![]));
    assert_eq!(nothing.roofs.matched, 0);
}

#[test]
fn regularity_of_a_skewed_wall() {
    // The north wall runs from (10, 10) to (0, 10.5), 2.9° off; the others follow the axes.
    let skewed = prism(&[(0., 0.), (10., 0.), (10., 10.), (0., 10.5)], 0.0, 5.0);
    let e = judge(&village(), &city(vec![building("skewed", skewed)]));
    near(e.regularity_truth.aligned_walls, 1.0, 1e-12);
    let north = 100.25_f64.sqrt();
    near(e.regularity.aligned_walls, 30.5 / (30.5 + north), 1e-9);
    near(e.regularity.distinct_normals, 6.0, 0.0);
    // A gable has 4 walls, 2 roof planes, 1 ground; a box has 6; in the village (7 + 3 · 6) / 4.
    near(e.regularity_truth.distinct_normals, 6.25, 1e-12);
    assert_eq!((e.regularity.short_edges, e.regularity.small_faces), (0.0, 0.0));
    // A box of 0.2 × 4 m: 4 of 12 edges are short; 2 of 6 faces have 0.4 m², the roof and ground 0.8 m².
    let thin = city(vec![house("thin", 0., 0., 0.2, 4., 2.)]);
    let thin = judge(&thin, &thin).regularity;
    near(thin.short_edges, 4.0 / 12.0, 1e-12);
    near(thin.small_faces, 2.0 / 6.0, 1e-12);
}

#[test]
fn exact_and_almost_coplanar_roofs() {
    let pair = |step: f64| {
        let mut b = house("a", 0., 0., 5., 5., 4.);
        b.lods.lod2.push(prism(&rectangle(20., 0., 5., 5.), 0.0, 4.0 + step));
        judge(&city(vec![b.clone()]), &city(vec![b])).regularity.exactly_coplanar
    };
    // Roofs, and the north and south walls: three pairs.
    near(pair(0.0), 1.0, 1e-12);
    near(pair(0.05), 2.0 / 3.0, 1e-12);
    near(pair(0.5), 1.0, 1e-12);
}

#[test]
fn missing_and_open_solids_are_not_valid() {
    let mut open = house("open", 0., 0., 5., 5., 5.);
    open.lods.lod2[0].faces.pop();
    let mut without = house("without", 20., 0., 5., 5., 5.);
    without.lods.lod2.clear();
    let all = vec![open, without, house("good", 40., 0., 5., 5., 5.), house("fine", 60., 0., 5., 5., 5.)];
    let e = judge(&village(), &city(all));
    assert_eq!((e.validity.lod0, e.validity.lod1, e.validity.lod2), (1.0, 1.0, 0.5));
    assert_eq!((e.validity.without_lod2, e.validity.codes.get(&302)), (1, Some(&1)));
}

#[test]
fn tolerances_tell_strict_from_default() {
    // A corner of the roof 2 cm up leaves all four corners 5 mm off the fitted plane.
    let mut bent = house("bent", 0., 0., 5., 5., 5.);
    bent.lods.lod2[0].vertices[4].z += 0.02;
    let e = judge(&village(), &city(vec![bent]));
    assert_eq!((e.validity.lod2, e.validity_strict.lod2), (1.0, 0.0));
}

#[test]
fn terrain_under_and_beside_roofs() {
    let mut truth = city(vec![house("a", 0., 0., 10., 10., 6.)]);
    let mut result = truth.clone();
    truth.terrain = Some(ground(0.0));
    result.terrain = Some(ground(0.25));
    let t = judge(&truth, &result).terrain.unwrap();
    assert_eq!((t.open.count, t.under_roofs.count), (1500, 100));
    near(t.open.rms, 0.25, 1e-12);
    near(t.open_bias, 0.25, 1e-12);
    near(t.under_roofs.rms, 0.25, 1e-12);
    result.terrain = None;
    assert_eq!(judge(&truth, &result).terrain, None);
}

#[test]
fn levels_of_detail_tell_the_same_story() {
    let with_lod1 = |id: &str, width: f64, height: f64| {
        let mut b = house(id, 0., 0., 10., 10., 5.);
        b.lods.lod1 = vec![prism(&rectangle(0., 0., width, 10.), 0.0, height)];
        b
    };
    let mut none = house("none", 0., 0., 10., 10., 5.);
    none.lods.lod1.clear();
    // 4 % more, 6 % more, a narrower block of the same volume, none at all.
    let all = vec![with_lod1("a", 10., 5.2), with_lod1("b", 10., 5.3), with_lod1("c", 9.8, 50.0 / 9.8), none];
    let c = judge(&village(), &city(all)).coherence;
    assert_eq!(c.complete, 3);
    near(c.lod1_on_lod0, 2.0 / 3.0, 1e-12);
    near(c.lod2_on_lod0, 1.0, 1e-12);
    near(c.volumes, 2.0 / 3.0, 1e-12);
}

#[test]
fn agreement_of_two_runs() {
    let a = city(vec![
        house("same", 0., 0., 10., 10., 5.),
        house("near", 20., 0., 10., 10., 5.),
        house("moved", 40., 0., 10., 10., 5.),
        house("lost", 60., 0., 10., 10., 5.),
    ]);
    let b = city(vec![
        house("moved", 41., 0., 10., 10., 9.),
        house("near", 20.05, 0., 10., 10., 5.),
        house("new", 80., 0., 10., 10., 5.),
        house("same", 0., 0., 10., 10., 5.),
    ]);
    let result = agreement(&a, &b).unwrap();
    assert_eq!((result.buildings, result.same_id, result.same, result.share), (5, 3, 2, 0.4));
    let e = evaluate(Inputs { again: Some(&b), ..Inputs::new(&a, &a) }, &DENSE).unwrap();
    assert_eq!(e.agreement, Some(result));
}

#[test]
fn table_json_and_report() {
    let truth = village();
    let labels = LabelRasters {
        width: 2,
        height: 1,
        step: 1.0,
        classes: &["ground", "building"],
        truth: &[0, 1],
        result: &[0, 0],
    };
    let thin = city(truth.buildings[..2].to_vec());
    let e = evaluate(Inputs { labels: Some(labels), ..Inputs::new(&truth, &thin) }, &DENSE).unwrap();
    let table = e.table();
    assert!(table.contains("from 50 m², by buildings       66.67 %"), "{table}");
    assert!(table.contains("overall accuracy") && table.contains("50.00 %"));
    assert!(table.lines().all(|l| l.chars().count() < 140));
    let json = serde_json::to_string(&e).unwrap();
    assert_eq!(serde_json::from_str::<Evaluation>(&json).unwrap(), e);
    let page = html_report(&truth, &thin, &e, &DENSE).unwrap();
    assert!(page.starts_with("<!DOCTYPE html>") && page.ends_with("</html>\n"));
    assert!(page.contains("made &lt;by&gt; hand") && page.contains("Missed: 1 buildings"));
    // Two maps, and three pictures for each of the two roofs that are matched.
    assert_eq!(page.matches("data:image/png;base64,iVBORw0KGgo").count(), 8);
    assert!(html_report(&city(vec![]), &city(vec![]), &e, &DENSE).unwrap().contains("No buildings"));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    /// Houses on separate lots, any of them missing from either model or narrower in the result.
    #[test]
    fn lots(
        lots in prop::collection::vec((any::<bool>(), any::<bool>(), 2.0..9.0f64, 2.0..9.0f64, 3.0..9.0f64, 0.2..1.0f64), 1..20),
    ) {
        let lot = |k: usize| (20.0 * (k % 5) as f64, 20.0 * (k / 5) as f64);
        let (mut truth, mut result) = (Vec::new(), Vec::new());
        let (mut found, mut shared, mut areas) = (0, 0.0, [0.0; 2]);
        for (k, &(in_truth, in_result, width, depth, height, share)) in lots.iter().enumerate() {
            let (x, y) = lot(k);
            if in_truth {
                truth.push(house(&format!("t{k}"), x, y, width, depth, height));
                areas[0] += width * depth;
            }
            if in_result {
                result.push(house(&format!("r{k}"), x, y, width * share, depth, height));
                areas[1] += width * share * depth;
            }
            if in_truth && in_result {
                shared += width * share * depth;
                found += usize::from(share >= 0.5);
            }
        }
        let (truth, result) = (city(truth), city(result));
        let options = Options { density: 1.0, ..DENSE };
        let e = evaluate(Inputs::new(&truth, &result), &options).unwrap();
        let back = evaluate(Inputs::new(&result, &truth), &options).unwrap();
        let (d, b) = (e.objects[0], back.objects[0]);
        prop_assert_eq!(d.found, found);
        let union = areas[0] + areas[1] - shared;
        let whole = if union > 0.0 { shared / union } else { 0.0 };
        prop_assert!((d.per_area.quality - whole).abs() < 1e-6);
        // Truth and result exchanged exchange completeness and correctness.
        prop_assert_eq!((d.found, d.correct, d.truth, d.result), (b.correct, b.found, b.result, b.truth));
        prop_assert!((d.per_area.completeness - b.per_area.correctness).abs() < 1e-9);
        prop_assert_eq!(e.distances.truth_to_model, back.distances.model_to_truth);
        let same = evaluate(Inputs::new(&truth, &truth), &options).unwrap();
        prop_assert!(same.distances.truth_to_model.max < 1e-9 && same.missed.is_empty());
    }
}
