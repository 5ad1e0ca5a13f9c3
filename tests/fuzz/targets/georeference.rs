//! What is said of where meshes lie: `metadata.xml`, `.prj`, offsets, and the texts that name reference systems.
#![no_main]

use gable_fuzz::{Folder, parts, read_mesh};
use gable_reference_systems::{metric, read};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(|| {
    let folder = Folder::default();
    std::fs::create_dir_all(folder.path().join("odm_georeferencing")).expect("made");
    folder.write("a.obj", b"v 0 0 0\nv 9 0 0\nv 9 9 0\nv 0 9 3\nf 1 2 3\nf 1 3 4\n");
    folder
});

/// The files, in the order in which an input has them.
const FILES: [&str; 5] =
    ["metadata.xml", "a.prj", "a_offset.xyz", "odm_georeferencing/coords.txt", "odm_georeferencing/proj.txt"];

fuzz_target!(|data: &[u8]| {
    let said: [&[u8]; 5] = parts(data);
    for text in said {
        if let Ok(crs) = read(&String::from_utf8_lossy(text)) {
            let _ = metric(&crs);
        }
    }
    for (name, text) in FILES.into_iter().zip(said) {
        if text.is_empty() {
            std::fs::remove_file(FOLDER.path().join(name)).ok();
        } else {
            FOLDER.write(name, text);
        }
    }
    read_mesh(FOLDER.path(), FOLDER.path());
});
