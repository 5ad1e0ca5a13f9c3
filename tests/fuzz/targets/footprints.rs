//! Footprints and roof planes that a parameter names, and outlines of real scenes.
#![no_main]

use gable_evaluation::real::Outlines;
use gable_fuzz::Folder;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

fuzz_target!(|data: &[u8]| {
    gable_pipeline::fuzzing::read_footprints(&FOLDER.write("a.city.json", data));
    let _ = Outlines::parse(&String::from_utf8_lossy(data), "a.geojson");
});
