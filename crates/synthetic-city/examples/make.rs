//! Makes a procedural town: `make OUT AREA_KM2 [DENSITY] [SEED]`.
use gable_synthetic_city::{Source, SynthParams, synthesise};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| args.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let out = args.get(1).cloned().unwrap_or_else(|| "synthetic".to_owned());
    let params = SynthParams {
        source: Source::Procedural { area_km2: number(2, 0.01) },
        density: number(3, 7.5),
        seed: number(4, 1.0) as u64,
        ..SynthParams::default()
    };
    let report = synthesise(&params, out.as_ref(), &|_| {})?;
    use std::io::Write;
    writeln!(std::io::stdout(), "{report:#?}")?;
    Ok(())
}
