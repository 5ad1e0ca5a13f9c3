//! CityJSON and CityJSONSeq.
#![no_main]

use gable_city_model::{ReadOptions, read_cityjson_str};
use gable_fuzz::use_model;
use libfuzzer_sys::fuzz_target;
use std::path::Path;

fuzz_target!(|data: &[u8]| {
    let text = String::from_utf8_lossy(data);
    if let Ok(reading) = read_cityjson_str(&text, Path::new("a.city.json"), &ReadOptions::default()) {
        use_model(&reading.model);
    }
});
