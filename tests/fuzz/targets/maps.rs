//! Tiles of the ground, and low heights: artefacts that later stages read.
#![no_main]

use gable_fuzz::Folder;
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(|| {
    let folder = Folder::default();
    std::fs::create_dir(folder.path().join("terrain")).expect("made");
    folder
});

fuzz_target!(|data: &[u8]| {
    FOLDER.write("terrain/0_0.ter", data);
    gable_pipeline::fuzzing::read_terrain(FOLDER.path());
    gable_pipeline::fuzzing::read_coarse(&FOLDER.write("a.low", data));
});
