//! A folder of label pictures, which a parameter names.
#![no_main]

use gable_files::Reach;
use gable_fuzz::{Folder, parts};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(|| {
    let folder = Folder::default();
    std::fs::create_dir(folder.path().join("labels")).expect("made");
    folder
});

fuzz_target!(|data: &[u8]| {
    let [truth, description, picture] = parts(data);
    if truth.is_empty() {
        std::fs::remove_file(FOLDER.path().join("truth.json")).ok();
    } else {
        FOLDER.write("truth.json", truth);
    }
    FOLDER.write("labels/0_0.json", description);
    FOLDER.write("labels/0_0.png", picture);
    let reach = Reach::within([FOLDER.path().to_owned()]).expect("the folder is there");
    if let Ok(maps) = gable_pipeline::label_map::read(FOLDER.path(), &reach) {
        let _ = gable_pipeline::label_map::together(&maps, &maps);
    }
});
