//! All formats at once: the same from a run and from a job, replaced by a later run, and never with a reference system made up.

mod common;

use common::{files, job, params, result, same};
use gable_files::Reach;
use gable_pipeline::{Params, Unobserved, run};
use serde_json::json;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

const FORMATS: &str = "cityjson,citygml,citygml3,obj,glb,geotiff,geopackage,flatgeobuf,geojson";

/// Level ground of 90 m × 60 m, and two houses with flat roofs on it.
fn houses(folder: &Path) -> PathBuf {
    let mut text = String::new();
    let mut add = |points: &[[f64; 3]]| {
        points.iter().for_each(|[x, y, z]| writeln!(text, "v {x} {y} {z}").unwrap());
        text += "f -3 -2 -1\n";
    };
    add(&[[0.0, 0.0, 0.0], [90.0, 0.0, 0.0], [90.0, 60.0, 0.0]]);
    add(&[[0.0, 0.0, 0.0], [90.0, 60.0, 0.0], [0.0, 60.0, 0.0]]);
    for (west, south, east, north, top) in [(15.0, 20.0, 31.0, 34.0, 7.0), (55.0, 15.0, 70.0, 40.0, 9.0)] {
        let ring = [[west, south], [east, south], [east, north], [west, north]];
        for side in 0..4 {
            let ([ax, ay], [bx, by]) = (ring[side], ring[(side + 1) % 4]);
            add(&[[ax, ay, 0.0], [bx, by, 0.0], [bx, by, top]]);
            add(&[[ax, ay, 0.0], [bx, by, top], [ax, ay, top]]);
        }
        let roof = ring.map(|[x, y]| [x, y, top]);
        add(&roof[..3]);
        add(&[roof[0], roof[2], roof[3]]);
    }
    let path = folder.join("houses.obj");
    std::fs::write(&path, text).unwrap();
    path
}

fn settings(more: &[(&str, &str)]) -> Params {
    let all = [
        ("grid.columns", "2"),
        ("grid.rows", "1"),
        ("sampling.step", "0.5"),
        ("output.report", "false"),
        ("output.formats", FORMATS),
        ("input.crs", "EPSG:25832"),
        ("input.origin", "691000,5334000,500"),
    ];
    params(&[&all, more].concat())
}

fn written(mesh: &Path, out: &Path, params: &Params) -> Vec<String> {
    let summary = run(mesh, out, params, &Reach::everything(), &Unobserved).unwrap();
    assert_eq!(summary.buildings, 2);
    let mut listed = summary.files.clone();
    listed.sort();
    let found: Vec<String> = files(out).into_keys().collect();
    assert_eq!(listed, found, "the summary names every file");
    found
}

#[test]
fn a_job_makes_every_format_of_a_run() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = houses(folder.path());
    let out = tempfile::tempdir().unwrap();
    let told = [("output.title", "Two houses"), ("output.identifier", "h2"), ("output.reference_date", "2025-04-30")];
    let params = settings(&told);
    let names = written(&mesh, out.path(), &params);
    let expected = [
        "city.gpkg",
        "footprints.fgb",
        "footprints.geojson",
        "index.json",
        "rasters/dsm.tif",
        "rasters/dtm.tif",
        "rasters/labels.tif",
        "rasters/ndsm.tif",
        "rasters/orthophoto.tif",
        "roof_surfaces.fgb",
        "roof_surfaces.geojson",
    ];
    let of_tiles = ["citygml3.gml", "city.json", "glb", "gml", "mtl", "obj"];
    for name in expected
        .into_iter()
        .map(str::to_owned)
        .chain(["0_0", "1_0"].iter().flat_map(|tile| of_tiles.map(|end| format!("tiles/{tile}.{end}"))))
    {
        assert!(names.contains(&name), "{name} is not among {names:?}");
    }
    assert_eq!(names.len(), expected.len() + 2 * of_tiles.len(), "{names:?}");
    let tile: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.path().join("tiles/0_0.city.json")).unwrap()).unwrap();
    assert_eq!(tile["metadata"]["title"], "Two houses, tile 0_0");
    assert_eq!(
        (&tile["metadata"]["identifier"], &tile["metadata"]["referenceDate"]),
        (&"h2".into(), &"2025-04-30".into())
    );
    same(&result(&job(&mesh, &params, &|_| None)), &files(out.path()));
    hold_against_gdal(out.path());
    hold_against_cjio(out.path());

    // What is not asked for any more goes.
    let few = written(&mesh, out.path(), &settings(&[("output.formats", "cityjson")]));
    assert_eq!(few, ["index.json", "tiles/0_0.city.json", "tiles/1_0.city.json"]);
}

/// Says that something was not tried, and why; `tests/run` counts it as skipped.
#[expect(clippy::print_stderr, reason = "the reason for what is skipped is for whoever runs the tests")]
fn skip(name: &str, reason: &str) {
    eprintln!("skipped {name}: {reason}");
    if let Some(log) = std::env::var_os("GABLE_SKIP_LOG") {
        let mut file = std::fs::OpenOptions::new().append(true).create(true).open(log).unwrap();
        writeln!(file, "skipped {name}: {reason}").unwrap();
    }
}

/// What a program of `tests/conformance` finds in a result; `None`, with a printed reason, where no Python has what it `needs`.
fn found_by(program: &str, pythons: &[PathBuf], needs: &str, out: &Path) -> Option<serde_json::Value> {
    let has = |python: &&PathBuf| {
        let import = Command::new(python).args(["-c", needs]).stdout(Stdio::null()).stderr(Stdio::null()).status();
        import.is_ok_and(|status| status.success())
    };
    let Some(python) = pythons.iter().find(has) else {
        skip(&format!("what {program} finds in a result"), &format!("no Python has it: {needs}"));
        return None;
    };
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/conformance").join(program);
    let done = Command::new(python).arg(path).arg(out).output().unwrap();
    let (said, complained) = (String::from_utf8_lossy(&done.stdout), String::from_utf8_lossy(&done.stderr));
    assert!(done.status.success(), "{program}: {}\n{said}\n{complained}", done.status);
    Some(serde_json::from_str(said.trim_end().lines().last().unwrap_or_default()).unwrap())
}

fn hold_against_gdal(out: &Path) {
    // Debian's own Python has Debian's packages.
    let pythons = ["/usr/bin/python3", "python3"].map(PathBuf::from);
    let needs = "import osgeo_utils.samples.validate_cloud_optimized_geotiff, numpy";
    let Some(found) = found_by("gis.py", &pythons, needs, out) else { return };
    let rasters = found["rasters"].as_object().unwrap();
    assert_eq!(rasters.len(), 5);
    for (name, raster) in rasters {
        assert_eq!((&raster["complaints"], &raster["plane"]), (&json!([]), &json!("25832")), "{name}");
        assert_eq!(raster["transform"], json!([691_000.0, 0.5, 0.0, 5_334_060.0, 0.0, -0.5]), "{name}");
        assert_eq!((&raster["size"], &raster["block"]), (&json!([180, 120]), &json!([512, 512])), "{name}");
        assert_eq!((&raster["compression"], &raster["seen"]), (&json!("DEFLATE"), &json!(1.0)), "{name}");
    }
    let range = |name: &str| [&rasters[name]["low"], &rasters[name]["high"]].map(|v| v.as_f64().unwrap());
    assert_eq!([range("dsm.tif"), range("dtm.tif"), range("ndsm.tif")], [[500.0, 509.0], [500.0, 500.0], [0.0, 9.0]]);
    assert_eq!(rasters["orthophoto.tif"]["colours"], json!(["Red", "Green", "Blue", "Alpha"]));
    assert_eq!(rasters["labels.tif"]["classes"]["CLASS_3"], "building");
    assert_eq!((&rasters["dsm.tif"]["unit"], &rasters["dsm.tif"]["none"]), (&json!("metre"), &json!(-9999.0)));
    assert_eq!((&found["difference"], &found["same_places"]), (&json!(0.0), &json!(true)));

    let layers = found["layers"].as_object().unwrap();
    assert_eq!(layers.len(), 6);
    for (name, layer) in layers {
        assert_eq!((&layer["count"], &layer["unique"]), (&json!(2), &json!(2)), "{name}");
        assert_eq!((&layer["invalid"], &layer["clockwise"]), (&json!(0), &json!(0)), "{name}");
        let is_json = name.contains("geojson");
        assert_eq!(layer["code"], if is_json { "4326" } else { "25832" }, "{name}");
        let extent: Vec<f64> = layer["extent"].as_array().unwrap().iter().map(|v| v.as_f64().unwrap()).collect();
        // By PROJ 9.1.
        let (expected, within) = match is_json {
            true => ([11.567_266_8, 11.568_014_2, 48.130_686_4, 48.130_915_6], 5e-6),
            false => ([691_015.0, 691_070.0, 5_334_015.0, 5_334_040.0], 0.5),
        };
        assert!(
            extent.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < within),
            "{name}: {extent:?}"
        );
        if !is_json {
            let area = layer["area"].as_f64().unwrap();
            assert!((area - (16.0 * 14.0 + 15.0 * 25.0)).abs() < 6.0, "{name}: {area} m²");
        }
        let field = if name.ends_with("footprints") { "measuredHeight" } else { "slope_deg" };
        assert_eq!(layer["fields"][field], "Real", "{name}");
    }
    assert_eq!(layers["city.gpkg/roof_surfaces"]["kind"], "3D Polygon");
    // By the spatial index, and beside all that is in it.
    assert_eq!((&found["indexed"], &found["beside"]), (&json!(2), &json!(0)));
    // Rasters and layers lie over each other.
    assert_eq!(found["built"], 2);
    assert!(found["height_differences"].as_array().unwrap().iter().all(|v| v.as_f64().unwrap().abs() < 0.1), "{found}");
    for name in ["0_0.gml", "0_0.citygml3.gml"] {
        assert_eq!(found["gml"][name], json!({ "Building": 1, "ReliefFeature": 1 }), "{name}");
    }
}

fn hold_against_cjio(out: &Path) {
    let own = std::env::var_os("GABLE_TEST_TOOLS").map(|tools| Path::new(&tools).join("bin/python"));
    let pythons: Vec<PathBuf> = own.into_iter().collect();
    let Some(found) = found_by("cityjson.py", &pythons, "import cjio.cityjson", out) else { return };
    let expected = json!({ "tiles": 2, "title": "Two houses, tile 0_0", "epsg": 25832, "superfluous": 0, "buildings": 2, "heights": 2, "lod2": 2 });
    for (name, expected) in expected.as_object().unwrap() {
        assert_eq!(&found[name], expected, "{name} of {found}");
    }
}

#[test]
fn without_a_reference_system_no_geojson_is_written_and_that_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = houses(folder.path());
    let out = tempfile::tempdir().unwrap();
    let params = settings(&[("input.crs", "auto"), ("output.formats", "geopackage,geojson")]);
    let summary = run(&mesh, out.path(), &params, &Reach::everything(), &Unobserved).unwrap();
    let said: Vec<String> = summary.warnings.iter().map(|warning| warning.text()).collect();
    assert!(said.iter().any(|text| text.contains("no GeoJSON is written")), "{said:?}");
    assert_eq!(files(out.path()).into_keys().collect::<Vec<_>>(), ["city.gpkg", "index.json"]);
}

#[test]
fn a_footprint_hands_on_what_it_is_told() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = houses(folder.path());
    let footprints = folder.path().join("footprints.city.json");
    let text = r#"{"type": "CityJSON", "version": "2.0", "transform": {"scale": [1, 1, 1], "translate": [691000, 5334000, 500]},
        "vertices": [[15,20,0],[31,20,0],[31,34,0],[15,34,0],[55,15,0],[70,15,0],[70,40,0],[55,40,0]],
        "CityObjects": {
            "a": {"type": "Building", "attributes": {"yearOfConstruction": 1904, "storeysAboveGround": 2, "function": "1000",
                    "measuredHeight": 99.0, "owner": "somebody"},
                "geometry": [{"type": "MultiSurface", "lod": "0", "boundaries": [[[0,1,2,3]]]}]},
            "b": {"type": "Building", "geometry": [{"type": "MultiSurface", "lod": "0", "boundaries": [[[4,5,6,7]]]}]}}}"#;
    std::fs::write(&footprints, text).unwrap();
    let out = tempfile::tempdir().unwrap();
    let given =
        [("segmentation.footprints", footprints.to_str().unwrap()), ("output.formats", "cityjson,citygml,citygml3")];
    let params = settings(&[&given[..], &[("grid.columns", "1")]].concat());
    let _ = written(&mesh, out.path(), &params);
    let tile: serde_json::Value =
        serde_json::from_slice(&std::fs::read(out.path().join("tiles/0_0.city.json")).unwrap()).unwrap();
    let attributes = &tile["CityObjects"]["a"]["attributes"];
    assert_eq!((&attributes["yearOfConstruction"], &attributes["storeysAboveGround"]), (&1904.into(), &2.into()));
    assert_eq!((&attributes["function"], &attributes["owner"]), (&"1000".into(), &serde_json::Value::Null));
    assert!((attributes["measuredHeight"].as_f64().unwrap() - 7.0).abs() < 0.5, "what is measured holds: {attributes}");
    let gml = |name: &str| std::fs::read_to_string(out.path().join(name)).unwrap();
    let second = gml("tiles/0_0.gml");
    assert!(second.contains("<bldg:yearOfConstruction>1904</bldg:yearOfConstruction>"));
    assert!(
        second.contains("<bldg:storeysAboveGround>2</bldg:storeysAboveGround>")
            && second.contains("<bldg:function>1000<")
    );
    let third = gml("tiles/0_0.citygml3.gml");
    assert!(third.contains("<con:dateOfConstruction>1904-01-01</con:dateOfConstruction>"));
    assert!(third.contains("<bldg:storeysAboveGround>2</bldg:storeysAboveGround>"));
}
