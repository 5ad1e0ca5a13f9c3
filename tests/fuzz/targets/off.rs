//! OFF.
#![no_main]

use gable_fuzz::{Folder, read_mesh};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

static FOLDER: LazyLock<Folder> = LazyLock::new(Folder::default);

fuzz_target!(|data: &[u8]| read_mesh(FOLDER.path(), &FOLDER.write("a.off", data)));
