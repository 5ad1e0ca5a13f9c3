//! Samples for the integration tests, and the real data where it is present.
#![allow(dead_code, reason = "each test binary uses a part of this module")]

use gable_city_model::{Attributes, Building, CityModel, Face, Lods, Semantic, Shell, Terrain, Value};
use gable_geometry::{Crs, DVec3, dvec3};
use std::path::PathBuf;
use std::process::Command;

pub(crate) fn face(ring: &[u32], semantic: Semantic) -> Face {
    Face { rings: vec![ring.to_vec()], semantic, attributes: Attributes::new() }
}

/// A gabled house of 8 × 10 m.
pub(crate) fn house(at: DVec3) -> Shell {
    let corners = [(0., 0., 0.), (8., 0., 0.), (8., 10., 0.), (0., 10., 0.), (0., 0., 3.), (8., 0., 3.)];
    let more = [(8., 10., 3.), (0., 10., 3.), (4., 0., 6.123_456), (4., 10., 6.123_456)];
    let mut shell = Shell {
        vertices: corners.iter().chain(&more).map(|&(x, y, z)| at + dvec3(x, y, z)).collect(),
        faces: vec![
            face(&[3, 2, 1, 0], Semantic::GroundSurface),
            face(&[0, 1, 5, 8, 4], Semantic::WallSurface),
            face(&[1, 2, 6, 5], Semantic::WallSurface),
            face(&[2, 3, 7, 9, 6], Semantic::WallSurface),
            face(&[3, 0, 4, 7], Semantic::WallSurface),
            face(&[5, 6, 9, 8], Semantic::RoofSurface),
            face(&[7, 4, 8, 9], Semantic::RoofSurface),
        ],
    };
    for (k, azimuth) in [(5, 90.0), (6, 270.0)] {
        let slope = Value::Number(37.983_176_234);
        shell.faces[k].attributes =
            [("slope_deg".to_owned(), slope), ("azimuth_deg".to_owned(), Value::Number(azimuth))].into();
    }
    shell
}

/// A flat block of 8 × 10 m with a courtyard.
pub(crate) fn block(at: DVec3) -> Shell {
    let ring = |x0: f64, y0: f64, x1: f64, y1: f64, z: f64| {
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| at + dvec3(x, y, z))
    };
    let mut vertices = Vec::new();
    for z in [0.0, 4.5] {
        vertices.extend(ring(0., 0., 8., 10., z));
        vertices.extend(ring(3., 3., 5., 5., z));
    }
    let rings = |a: [u32; 4], b: [u32; 4], semantic| Face {
        rings: vec![a.to_vec(), b.to_vec()],
        semantic,
        attributes: Attributes::new(),
    };
    let mut faces = vec![
        rings([3, 2, 1, 0], [4, 5, 6, 7], Semantic::GroundSurface),
        rings([8, 9, 10, 11], [15, 14, 13, 12], Semantic::RoofSurface),
    ];
    for k in 0..4u32 {
        let n = (k + 1) % 4;
        faces.push(face(&[k, n, n + 8, k + 8], Semantic::WallSurface));
        faces.push(face(&[n + 4, k + 4, k + 12, n + 12], Semantic::WallSurface));
    }
    Shell { vertices, faces }
}

/// The faces of one meaning, moved to a height.
pub(crate) fn flat(shell: &Shell, semantic: Semantic, z: f64) -> Shell {
    let mut flat = shell.clone();
    flat.faces.retain(|face| face.semantic == semantic);
    flat.vertices.iter_mut().for_each(|p| p.z = z);
    flat
}

/// Three buildings (one of two parts, one without LOD2) and terrain.
pub(crate) fn city(crs: Crs) -> CityModel {
    let at = dvec3(-40.25, 17.5, 1.0);
    let one = Building {
        id: "b_00001-é".to_owned(),
        attributes: [
            ("measuredHeight".to_owned(), Value::Number(6.123_4)),
            ("roofType".to_owned(), Value::Text("gabled & <hipped>".to_owned())),
            ("volume_m3".to_owned(), Value::Number(365.0)),
            ("roof_planes".to_owned(), Value::Integer(2)),
            ("complete".to_owned(), Value::Bool(true)),
        ]
        .into(),
        lods: Lods {
            footprint: Some(flat(&house(at), Semantic::GroundSurface, 1.0)),
            roof_edge: Some(flat(&house(at), Semantic::RoofSurface, 4.0)),
            lod1: vec![block(at)],
            lod2: vec![house(at)],
        },
    };
    let two = Building {
        id: "b_00002".to_owned(),
        attributes: Attributes::new(),
        lods: Lods { lod1: vec![house(at + 20.0)], lod2: vec![house(at + 20.0), block(at + 40.0)], ..Lods::default() },
    };
    let three = Building {
        id: "b_00003".to_owned(),
        attributes: Attributes::new(),
        lods: Lods { footprint: Some(flat(&block(at - 15.0), Semantic::GroundSurface, 0.0)), ..Lods::default() },
    };
    let terrain = Terrain {
        id: "terrain".to_owned(),
        vertices: vec![dvec3(-90., 0., 0.), dvec3(50., 0., 1.), dvec3(50., 90., 2.), dvec3(-90., 90., 0.5)],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    CityModel {
        title: "A \"city\"".to_owned(),
        metadata: Default::default(),
        origin: [85_000.0, 446_000.0, 0.0],
        crs,
        buildings: vec![one, two, three],
        terrain: Some(terrain),
    }
}

/// A file of the real data, unpacked into `to`; `None` (with a printed reason) if data or `xz` are absent.
#[expect(clippy::print_stderr, reason = "says why a test is skipped")]
pub(crate) fn real(name: &str, to: &tempfile::TempDir) -> Option<PathBuf> {
    let root = std::env::var_os("GABLE_TEST_DATA")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")), PathBuf::from);
    let packed = root.join(name);
    if !packed.exists() {
        eprintln!("skipped: {} is absent", packed.display());
        return None;
    }
    let output = match Command::new("xz").args(["-dkc"]).arg(&packed).output() {
        Ok(output) if output.status.success() => output.stdout,
        other => {
            eprintln!("skipped: xz cannot unpack {}: {other:?}", packed.display());
            return None;
        }
    };
    let path = to.path().join(packed.file_stem().unwrap());
    std::fs::write(&path, output).unwrap();
    Some(path)
}

pub(crate) const DELFT: &str = "delft-3dbag/delft.city.jsonl.xz";
pub(crate) const DELFSHAVEN: &str = "delfshaven-lod2/Delfshaven_3-20_solids.json.xz";
pub(crate) const MUNICH: &str = "munich-lod2/Munich_LOD2_4424_5482_solid.gml.xz";
