//! What `gable eval` makes of a city model.
#![no_main]

use gable_city_model::{CityModel, ReadOptions, read_cityjson_str};
use gable_evaluation::{Inputs, Options, evaluate, inspect};
use libfuzzer_sys::fuzz_target;
use std::path::Path;
use std::sync::LazyLock;

static TRUTH: LazyLock<CityModel> =
    LazyLock::new(|| read(include_str!("../seeds/eval/truth.city.jsonl")).expect("the seed is read"));

fn read(text: &str) -> Option<CityModel> {
    read_cityjson_str(text, Path::new("a.city.json"), &ReadOptions::default()).ok().map(|reading| reading.model)
}

fuzz_target!(|data: &[u8]| {
    let Some(model) = read(&String::from_utf8_lossy(data)) else { return };
    // Coarse, so that there is time for many.
    let options = Options { roof_step: 2.0, density: 0.01, seed: 1 };
    let _ = inspect(&model, None, &options);
    let _ = evaluate(Inputs::new(&TRUTH, &model), &options);
});
