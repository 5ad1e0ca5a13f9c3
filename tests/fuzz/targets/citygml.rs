//! CityGML 2.0 and 3.0.
#![no_main]

use gable_city_model::{ReadOptions, read_city_model};
use gable_fuzz::{Folder, use_model};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

fuzz_target!(|data: &[u8]| {
    if let Ok(reading) = read_city_model(&FOLDER.write("a.gml", data), &ReadOptions::default()) {
        use_model(&reading.model);
    }
});
