//! Synthetic meshes have the defects of a real one, measured with the same code.

use gable_geometry::DVec3;
use gable_synthetic_city::calibration::{MeshFigures, measure};
use gable_synthetic_city::{RoofCase, Source, SynthParams, TriMesh, mesh_of};
use std::path::PathBuf;

fn data() -> PathBuf {
    let default = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    std::env::var_os("GABLE_TEST_DATA").map_or(default, PathBuf::from)
}

fn read_off(text: &str) -> Option<TriMesh> {
    let mut words = text.split_ascii_whitespace().skip(1);
    let (n, m): (usize, usize) = (words.next()?.parse().ok()?, words.next()?.parse().ok()?);
    words.next();
    let mut number = || words.next()?.parse::<f64>().ok();
    let vertices = (0..n).map(|_| Some(DVec3::new(number()?, number()?, number()?))).collect::<Option<_>>()?;
    let mut face = || {
        number()?;
        Some([number()? as u32, number()? as u32, number()? as u32])
    };
    let faces = (0..m).map(|_| face()).collect::<Option<_>>()?;
    Some(TriMesh { vertices, faces })
}

fn named(f: &MeshFigures) -> [(&'static str, f64); 8] {
    [
        ("faces per m² of surface", f.density),
        ("rms on planes, m", f.plane_rms),
        ("correlation length, m", f.correlation_length),
        ("10th percentile of edges, m", f.edge_lengths[0]),
        ("median edge, m", f.edge_lengths[1]),
        ("90th percentile of edges, m", f.edge_lengths[2]),
        ("corner cut-back, m", f.corner_cut_back),
        ("share of boundary edges", f.boundary_share),
    ]
}

#[test]
#[expect(clippy::print_stdout, reason = "shows the figures, and why nothing was measured")]
fn defects_are_as_strong_as_in_a_real_mesh() {
    let path = data().join("block/block.off");
    let Ok(text) = std::fs::read_to_string(&path) else {
        println!("skipped: {} is absent", path.display());
        return;
    };
    let real = named(&measure(&read_off(&text).expect("a plain OFF file")));
    let seeds = [1, 2, 3];
    let mut mean = [0.0; 8];
    for seed in seeds {
        let source = Source::Case(RoofCase::TwoHalls);
        // One tile, as the real block is one piece; the density gives as many faces per m² of surface.
        let params = SynthParams { seed, source, density: 6.1, slope: 0.0, tile_size: 120.0, ..SynthParams::default() };
        let figures = named(&measure(&mesh_of(&params).expect("valid parameters")));
        for (sum, (_, v)) in mean.iter_mut().zip(figures) {
            *sum += v / seeds.len() as f64;
        }
    }
    println!("{:30} {:>8} {:>9}", "", "real", "synthetic");
    for ((name, r), s) in real.iter().zip(mean) {
        println!("{name:30} {r:8.3} {s:9.3}");
    }
    for ((name, r), s) in real.iter().zip(mean) {
        assert!((s / r - 1.0).abs() < 0.2, "{name}: real {r:.3}, synthetic {s:.3}");
    }
}
