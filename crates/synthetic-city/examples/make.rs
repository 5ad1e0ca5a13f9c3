//! Makes a town: `make OUT AREA_KM2 [DENSITY] [SEED]`, or `make OUT TRUTH.city.jsonl [DENSITY] [SEED]`.

use gable_city_model::{ReadOptions, read_cityjson};
use gable_synthetic_city::{Source, SynthParams, synthesise};
use std::io::Write;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let args: Vec<String> = std::env::args().collect();
    let number = |k: usize, default: f64| args.get(k).and_then(|a| a.parse().ok()).unwrap_or(default);
    let out = args.get(1).cloned().unwrap_or_else(|| "synthetic".to_owned());
    let source = match args.get(2).filter(|a| a.contains(".json")) {
        Some(path) => {
            let reading = read_cityjson(path.as_ref(), &ReadOptions::default())?;
            Source::Truth { model: Box::new(reading.model), repeat: number(5, 1.0) as u32 }
        }
        None => Source::Procedural { area_km2: number(2, 0.01) },
    };
    let params = SynthParams { source, density: number(3, 7.5), seed: number(4, 1.0) as u64, ..SynthParams::default() };
    let report = synthesise(&params, out.as_ref(), &|_| {})?;
    writeln!(std::io::stdout(), "{report:#?}")?;
    Ok(())
}
