//! OBJ with its material library and a texture.
#![no_main]

use gable_fuzz::{Folder, parts, read_mesh};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(|| {
    let folder = Folder::default();
    folder.write("a.png", include_bytes!("../seeds/texture/a.png"));
    folder
});

fuzz_target!(|data: &[u8]| {
    let [mesh, library] = parts(data);
    FOLDER.write("a.mtl", library);
    read_mesh(FOLDER.path(), &FOLDER.write("a.obj", mesh));
});
