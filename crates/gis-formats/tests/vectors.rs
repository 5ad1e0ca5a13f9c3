//! Layers of buildings as they are read back.

use flatgeobuf::{FallibleStreamingIterator, FeatureProperties, FgbReader};
use gable_city_model::{Attributes, Building, Face, Lods, Semantic, Shell, Value};
use gable_geometry::{Crs, DVec3, dvec3};
use gable_gis_formats::{ColumnKind, FlatGeobuf, GeoJson, GeoPackage, GeoReference, Schema};
use gable_reference_systems::Projection;
use std::path::Path;

const ORIGIN: [f64; 3] = [691_000.0, 5_334_000.0, 500.0];

/// A house with a courtyard and a pent roof; its attributes are `more`.
fn house(id: &str, at: f64, more: &[(&str, Value)]) -> Building {
    let outer = [(0.0, 0.0), (20.0, 0.0), (20.0, 10.0), (0.0, 10.0)];
    // Clockwise, as holes run.
    let inner = [(5.0, 3.0), (5.0, 7.0), (15.0, 7.0), (15.0, 3.0)];
    let corners = || outer.into_iter().chain(inner);
    let points = |z: &dyn Fn(f64) -> f64| -> Vec<DVec3> { corners().map(|(x, y)| dvec3(x + at, y, z(x))).collect() };
    let rings = vec![vec![0, 1, 2, 3], vec![4, 5, 6, 7]];
    let slope = [("slope_deg".to_owned(), Value::Number(14.04))].into_iter().collect::<Attributes>();
    let face = |semantic, attributes| Face { rings: rings.clone(), semantic, attributes };
    let footprint = Shell { vertices: points(&|_| 2.0), faces: vec![face(Semantic::GroundSurface, Attributes::new())] };
    let roof = Shell { vertices: points(&|x| 8.0 + 0.25 * x), faces: vec![face(Semantic::RoofSurface, slope)] };
    let attributes = more.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    let lods = Lods { footprint: Some(footprint), lod2: vec![roof], ..Lods::default() };
    Building { id: id.to_owned(), attributes, lods }
}

fn town() -> (Schema, Vec<Building>) {
    let text = |text: &str| Value::Text(text.to_owned());
    let houses = vec![
        house(
            "a",
            0.0,
            &[("measuredHeight", Value::Number(11.0)), ("roofType", text("monopitch")), ("floors", Value::Integer(3))],
        ),
        house("b'\"", 100.0, &[("measuredHeight", Value::Integer(9)), ("floors", text("two"))]),
    ];
    let mut schema = Schema::default();
    houses.iter().for_each(|house| schema.see(house));
    (schema, houses)
}

fn package(path: &Path, crs: &Crs) {
    let (schema, houses) = town();
    let layers = [schema.footprints(), schema.roofs()];
    let mut package = GeoPackage::create(path, &GeoReference::of(crs), &layers).unwrap();
    for house in &houses {
        package.add(0, &schema.footprint(house, ORIGIN).unwrap()).unwrap();
        schema.roof_surfaces(house, ORIGIN).iter().for_each(|roof| package.add(1, roof).unwrap());
    }
    package.finish().unwrap();
}

#[test]
fn columns_hold_what_all_buildings_have() {
    let (schema, houses) = town();
    let columns = schema.footprints().columns;
    let kinds: Vec<_> = columns.iter().map(|c| (c.name.as_str(), c.kind)).collect();
    let expected = [
        ("id", ColumnKind::Text),
        ("lod", ColumnKind::Text),
        ("floors", ColumnKind::Text),
        ("measuredHeight", ColumnKind::Number),
        ("roofType", ColumnKind::Text),
    ];
    assert_eq!(kinds, expected);
    let first = schema.footprint(&houses[0], ORIGIN).unwrap();
    assert_eq!(first.values[2], Some(Value::Text("3".to_owned())));
    let second = schema.footprint(&houses[1], ORIGIN).unwrap();
    assert_eq!(second.values[3..], [Some(Value::Number(9.0)), None]);
    assert_eq!(second.polygons[0][0][..2], [[691_100.0, 5_334_000.0, 0.0], [691_120.0, 5_334_000.0, 0.0]]);
    let roof = &schema.roof_surfaces(&houses[0], ORIGIN)[0];
    let slope = (160.0 * (1.0_f64 + 0.0625).sqrt() * 100.0).round() / 100.0;
    let expected = [
        Some(Value::Text("a-roof-1".to_owned())),
        Some(Value::Text("a".to_owned())),
        Some(Value::Text("2".to_owned())),
        Some(Value::Number(slope)),
        Some(Value::Number(508.0)),
        Some(Value::Number(513.0)),
        Some(Value::Text("monopitch".to_owned())),
        Some(Value::Number(14.04)),
    ];
    assert_eq!(roof.values, expected);
}

#[test]
fn a_package_is_whole_and_the_same_each_time() {
    let folder = tempfile::tempdir().unwrap();
    let [first, second] = ["a.gpkg", "b.gpkg"].map(|name| folder.path().join(name));
    package(&first, &Crs::Epsg(25832));
    std::thread::sleep(std::time::Duration::from_millis(20));
    package(&second, &Crs::Epsg(25832));
    assert_eq!(std::fs::read(&first).unwrap(), std::fs::read(&second).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "nothing is left beside");
    let database = rusqlite::Connection::open(&first).unwrap();
    let text = |sql: &str| database.query_row(sql, [], |row| row.get::<_, String>(0)).unwrap();
    let number = |sql: &str| database.query_row(sql, [], |row| row.get::<_, f64>(0)).unwrap();
    assert_eq!(text("PRAGMA integrity_check"), "ok");
    assert_eq!(number("PRAGMA application_id"), f64::from(u32::from_be_bytes(*b"GPKG")));
    assert_eq!(number("SELECT srs_id FROM gpkg_geometry_columns WHERE table_name = 'roof_surfaces'"), 25832.0);
    assert!(text("SELECT definition FROM gpkg_spatial_ref_sys WHERE srs_id = 25832").starts_with("PROJCS[\"ETRS89"));
    assert_eq!(text("SELECT id FROM footprints WHERE fid = 2"), "b'\"");
    assert_eq!(number("SELECT max_x FROM gpkg_contents WHERE table_name = 'footprints'"), 691_120.0);
    assert_eq!(number("SELECT count(*) FROM rtree_footprints_geom WHERE minx > 691090"), 1.0);
    let blob: Vec<u8> = database.query_row("SELECT geom FROM roof_surfaces", [], |row| row.get(0)).unwrap();
    assert_eq!(blob[..8], [b'G', b'P', 0, 3, 0xE8, 0x64, 0, 0]);
    // Polygon Z of two rings of five points.
    assert_eq!(blob[40..49], [1, 0xEB, 3, 0, 0, 2, 0, 0, 0]);
    assert_eq!(blob.len(), 40 + 9 + 2 * (4 + 5 * 24));
}

#[test]
fn a_package_tells_no_system_that_is_not_known() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.gpkg");
    package(&path, &Crs::Unknown);
    let number = |path: &Path| {
        let database = rusqlite::Connection::open(path).unwrap();
        database.query_row("SELECT srs_id FROM gpkg_contents", [], |row| row.get::<_, i64>(0)).unwrap()
    };
    assert_eq!(number(&path), -1);
    let path = folder.path().join("b.gpkg");
    package(&path, &Crs::Enu { latitude: 52.0, longitude: 4.36, height: 0.0 });
    assert_eq!(number(&path), 100_000);
}

#[test]
fn flatgeobuf_comes_back() {
    let (schema, houses) = town();
    let mut bytes = Vec::new();
    let mut file = FlatGeobuf::new(&GeoReference::of(&Crs::Epsg(7415)), &schema.roofs()).unwrap();
    for house in &houses {
        schema.roof_surfaces(house, ORIGIN).iter().for_each(|roof| file.add(roof).unwrap());
    }
    file.write(&mut bytes).unwrap();
    let reader = FgbReader::open(std::io::Cursor::new(&bytes)).unwrap();
    let header = reader.header();
    assert_eq!((header.features_count(), header.has_z(), header.crs().unwrap().code()), (2, true, 28992));
    let mut found = reader.select_bbox(691_090.0, 5_333_990.0, 691_130.0, 5_334_020.0).unwrap();
    let feature = found.next().unwrap().expect("the second house lies there");
    assert_eq!(feature.property::<String>("building").unwrap(), "b'\"");
    assert_eq!(feature.property::<f64>("slope_deg").unwrap(), 14.04);
    assert!(found.next().unwrap().is_none());
}

#[test]
fn geojson_is_that_of_its_standard() {
    let (schema, houses) = town();
    let mut bytes = Vec::new();
    let projection = Projection::of(&Crs::Epsg(25832)).unwrap();
    let mut file = GeoJson::new(&mut bytes, projection, &schema.footprints());
    houses.iter().for_each(|house| file.add(&schema.footprint(house, ORIGIN).unwrap()).unwrap());
    file.finish().unwrap();
    let text = String::from_utf8(bytes).unwrap();
    let geojson::GeoJson::FeatureCollection(found) = text.parse().unwrap() else { panic!("{text}") };
    assert_eq!(found.features.len(), 2);
    let properties = found.features[1].properties.as_ref().unwrap();
    assert_eq!((&properties["id"], &properties["roofType"]), (&"b'\"".into(), &geojson::JsonValue::Null));
    let Some(geojson::GeometryValue::MultiPolygon { coordinates }) =
        found.features[0].geometry.as_ref().map(|g| &g.value)
    else {
        panic!("{text}");
    };
    assert_eq!((coordinates.len(), coordinates[0].len(), coordinates[0][0].len()), (1, 2, 5));
    // By PROJ 9.5.
    let first = coordinates[0][0][0].as_slice();
    assert_eq!(first.len(), 2, "no height");
    assert!((first[0] - 11.567_053).abs() < 2e-6 && (first[1] - 48.130_570).abs() < 2e-6, "{first:?}");
    let area = |ring: &[geojson::Position]| {
        ring.windows(2)
            .map(|p| p[0].as_slice()[0] * p[1].as_slice()[1] - p[1].as_slice()[0] * p[0].as_slice()[1])
            .sum::<f64>()
    };
    assert!(area(&coordinates[0][0]) > 0.0 && area(&coordinates[0][1]) < 0.0);
    assert_eq!(coordinates[0][0].first(), coordinates[0][0].last());
}
