//! GLB, and glTF with a buffer beside it.
#![no_main]

use gable_fuzz::{Folder, parts, read_mesh};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

fuzz_target!(|data: &[u8]| {
    if data.starts_with(b"glTF") {
        return read_mesh(FOLDER.path(), &FOLDER.write("a.glb", data));
    }
    let [json, buffer] = parts(data);
    FOLDER.write("a.bin", buffer);
    read_mesh(FOLDER.path(), &FOLDER.write("a.gltf", json));
});
