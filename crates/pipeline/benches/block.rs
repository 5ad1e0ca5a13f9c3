//! A block as a city has many of: 218 × 218 m at 7.5 faces per m², pixels of 0.2 m, through all stages on one thread, so
//! that the time is core time. Says the core seconds of each stage and the peak memory of the process first.
//!
//! `cargo bench -p gable-pipeline --bench block`. The aim is 10 s and 1.5 GB; Zhu et al. 2018 took 67 s (Table 2).

use criterion::{Criterion, criterion_group, criterion_main};
use gable_files::Reach;
use gable_pipeline::{Params, RunSummary, Unobserved, run};
use gable_synthetic_city::{Source, SynthParams, synthesise};
use std::path::Path;

/// Edge of the block, metres.
const EDGE: f64 = 218.0;
/// Faces per m² of the mesh.
const DENSITY: f64 = 7.5;

fn params() -> Params {
    let settings = [
        ("sampling.step", "0.2"),
        ("grid.columns", "1"),
        ("grid.rows", "1"),
        ("resources.threads", "1"),
        ("output.report", "false"),
    ];
    let settings = settings.map(|(name, value)| (name.to_owned(), value.to_owned()));
    Params::assemble(None, None, &settings).expect("these parameters are in range")
}

fn model(mesh: &Path) -> RunSummary {
    let out = tempfile::tempdir().expect("a temporary folder");
    run(mesh, out.path(), &params(), &Reach::everything(), &Unobserved).expect("the block can be modelled")
}

#[expect(clippy::print_stderr, reason = "the figures beside the time that criterion measures")]
fn whole_block(criterion: &mut Criterion) {
    let city = tempfile::tempdir().expect("a temporary folder");
    // Seeds from 100 on are for tuning and timing.
    let source = Source::Procedural { area_km2: EDGE * EDGE / 1e6 };
    let synth = SynthParams { seed: 101, source, density: DENSITY, ..SynthParams::default() };
    synthesise(&synth, city.path(), &|_| {}).expect("the block can be made");
    let mesh = city.path().join("mesh");

    let summary = model(&mesh);
    let core: f64 = summary.stages.iter().map(|s| s.core).sum();
    eprintln!(
        "{} triangles, {:.0} m², {} buildings: {core:.2} s of core time, peak {:.0} MB with making the mesh",
        summary.triangles,
        summary.area_m2,
        summary.buildings,
        summary.peak_memory_bytes as f64 / 1e6
    );
    for stage in &summary.stages {
        eprintln!("{:>10} {:6.2} s", stage.stage, stage.core);
    }
    criterion.bench_function("block of 218 m, all stages", |bencher| bencher.iter(|| model(&mesh)));
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = whole_block
}
criterion_main!(benches);
