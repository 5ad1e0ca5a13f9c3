//! Archives that are sent: ZIP, 7z, tar, and tar in gzip and Zstandard.
#![no_main]

use gable_fuzz::Folder;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let folder = Folder::default();
    let inner = folder.path().join("inner");
    std::fs::create_dir(&inner).expect("made");
    gable_coordinator::fuzzing::unpack(data, &inner);
    let around = std::fs::read_dir(folder.path()).expect("read").count();
    assert_eq!(around, 1, "something lies outside of its folder");
});
