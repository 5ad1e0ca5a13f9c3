//! 3D Tiles: a tileset, one within it, and a tile.
#![no_main]

use gable_fuzz::{Folder, parts, read_mesh};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

fuzz_target!(|data: &[u8]| {
    let [tileset, inner, tile] = parts(data);
    FOLDER.write("inner.json", inner);
    FOLDER.write("a.b3dm", tile);
    read_mesh(FOLDER.path(), &FOLDER.write("tileset.json", tileset));
});
