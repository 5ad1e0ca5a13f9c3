//! What a mesh names is read inside of its root only, and only if it is a regular file.

use crate::town::{Folder, Read, png, read, town};
use gable_files::Reach;
use gable_scene::{OpenOptions, Scene, WarningKind, load_texture, texture_bytes};
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

/// What stands in files outside: readable as a buffer, a library, an image and metadata, and found again by this.
const SECRET: &str = "hunter2";

/// A folder with `root` in it, which may be read, and files beside it, which may not.
struct Place {
    folder: Folder,
    options: OpenOptions,
}

impl Place {
    fn new() -> Self {
        let folder = Folder::new();
        std::fs::create_dir(folder.path().join("root")).expect("temporary folder");
        folder.write("secret.mtl", format!("newmtl {SECRET}\nKd 1 1 1\n"));
        folder.write("secret.png", png());
        folder.write(
            "secret.txt",
            format!("{SECRET} and some more, so that it is as long as what is asked for").repeat(99),
        );
        folder.write("metadata.xml", format!("<ModelMetadata><SRS>{SECRET}</SRS></ModelMetadata>"));
        let reach = Reach::within([folder.path().join("root")]).expect("is there");
        Self { folder, options: OpenOptions { reach, ..OpenOptions::default() } }
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        self.folder.write(&format!("root/{name}"), bytes)
    }

    /// Ways from a file in the root to a file beside it, links among them.
    fn ways(&self, outside: &str) -> Vec<String> {
        let absolute = self.folder.path().join(outside);
        let link = format!("link-to-{outside}");
        if !self.folder.path().join("root").join(&link).exists() {
            symlink(&absolute, self.folder.path().join("root").join(&link)).expect("links");
        }
        vec![format!("../{outside}"), absolute.display().to_string(), format!("a/../../{outside}"), link]
    }

    /// What comes of reading, as text: the error, or the warnings.
    fn said(&self, path: &Path) -> String {
        match read(path, &self.options) {
            Ok(Read { counts, .. }) => format!("{:?}", counts.warnings),
            Err(error) => error.to_string(),
        }
    }
}

#[test]
fn buffers_and_images_of_gltf() {
    let place = Place::new();
    for way in place.ways("secret.txt") {
        let (json, _) = town().gltf(&way, &png());
        let said = place.said(&place.write("a.gltf", json));
        assert!(said.contains("lies outside of what may be read here") && !said.contains(SECRET), "{way}: {said}");
    }
    for way in place.ways("secret.png") {
        let (json, buffer) = town().gltf("a.bin", &png());
        place.write("a.bin", buffer);
        let json = json.replace(r#""bufferView":3,"mimeType":"image/png""#, &format!(r#""uri":"{way}""#));
        let Read { counts, materials, .. } = read(&place.write("a.gltf", json), &place.options).expect("reads");
        assert_eq!(counts.warnings.count(WarningKind::MissingTexture), 1, "{way}");
        assert!(materials[0].texture.is_none(), "{way}");
    }
}

#[test]
fn libraries_and_textures_of_obj() {
    let place = Place::new();
    for way in place.ways("secret.mtl") {
        for statement in [format!("mtllib {way}"), format!("mtllib none.mtl {way}")] {
            let path = place.write("a.obj", town().obj().replace("mtllib town.mtl", &statement));
            let Read { counts, materials, .. } = read(&path, &place.options).expect("reads");
            assert!(counts.warnings.count(WarningKind::MissingMaterialLibrary) > 0, "{statement}");
            assert!(materials.is_empty() && !format!("{:?}", counts.warnings).contains(SECRET), "{statement}");
        }
    }
    let path = place.write("a.obj", town().obj());
    for way in place.ways("secret.png") {
        for keyword in ["map_Kd", "map_Ke"] {
            place.write("town.mtl", format!("newmtl brick\n{keyword} {way}\n"));
            let Read { counts, materials, .. } = read(&path, &place.options).expect("reads");
            assert_eq!(counts.warnings.count(WarningKind::MissingTexture), 1, "{way}");
            assert!(materials[0].texture.is_none(), "{way}");
        }
    }
}

#[test]
fn textures_of_ply_and_metadata_above() {
    let place = Place::new();
    let text = String::from_utf8(town().ply("ascii")).expect("text");
    for way in place.ways("secret.png") {
        let path = place.write("a.ply", text.replace("comment made here", &format!("comment TextureFile {way}")));
        let Read { materials, .. } = read(&path, &place.options).expect("the metadata above the root is not looked at");
        assert!(materials[0].texture.is_none(), "{way}");
    }
    let path = place.folder.path().join("root/a.ply");
    let said = read(&path, &OpenOptions::default()).expect_err("without a root it is looked at").to_string();
    assert!(said.contains("unknown reference system"), "{said}");
}

#[test]
fn a_texture_that_was_found_is_opened_inside_of_the_root_only() {
    let place = Place::new();
    place.write("town.mtl", "newmtl brick\nmap_Kd a.png\n");
    place.write("a.png", png());
    let path = place.write("a.obj", town().obj());
    let Read { scene, materials, .. } = read(&path, &place.options).expect("reads");
    assert!(load_texture(&materials[0], scene.reach()).expect("decodes").is_some());
    let image = place.folder.path().join("root/a.png");
    std::fs::remove_file(&image).expect("removed");
    symlink("../secret.png", &image).expect("linked");
    let error = load_texture(&materials[0], scene.reach()).expect_err("it leads outside").to_string();
    assert!(error.contains("lies outside"), "{error}");
}

#[test]
fn a_file_that_is_no_image_is_not_handed_on_as_one() {
    let place = Place::new();
    place.write("town.mtl", "newmtl brick\nmap_Kd a.png\n");
    place.write("a.png", png());
    let Read { scene, materials, .. } = read(&place.write("a.obj", town().obj()), &place.options).expect("reads");
    place.write("a.png", "id_rsa");
    let source = materials[0].texture.as_ref().expect("a texture");
    let error = texture_bytes(source, scene.reach()).expect_err("no image").to_string();
    assert!(error.contains("it is no JPEG, PNG"), "{error}");
}

#[test]
fn meshes_themselves_lie_in_the_root() {
    let place = Place::new();
    let outside = place.folder.write("outside.obj", town().obj());
    symlink(&outside, place.folder.path().join("root/tile.obj")).expect("linked");
    place.write("good.obj", town().obj());
    for path in [outside, place.folder.path().join("root/../outside.obj"), place.folder.path().join("root/tile.obj")] {
        assert!(place.said(&path).contains("lies outside"), "{}", path.display());
    }
    assert!(place.said(&place.folder.path().join("root")).contains("lies outside"), "a folder with a link in it");
}

#[test]
fn pipes_and_devices_never_wait_and_never_end_the_memory() {
    let folder = Folder::new();
    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().expect("runs").success());
    symlink("/dev/zero", folder.path().join("zero.obj")).expect("linked");
    let options = OpenOptions::default();
    for device in ["pipe", "/dev/zero"] {
        let obj = folder.write("a.obj", town().obj().replace("town.mtl", device));
        let Read { counts, .. } = read(&obj, &options).expect("reads");
        assert_eq!(counts.warnings.count(WarningKind::MissingMaterialLibrary), 1, "{device}");
        folder.write("b.mtl", format!("newmtl brick\nmap_Kd {device}\n"));
        let obj = folder.write("b.obj", town().obj().replace("town.mtl", "b.mtl"));
        let Read { counts, .. } = read(&obj, &options).expect("reads");
        assert_eq!(counts.warnings.count(WarningKind::MissingTexture), 1, "{device}");
        let (json, _) = town().gltf(device, &png());
        let said = folder.said(&folder.write("a.gltf", json), &options);
        assert!(said.ends_with("is no regular file"), "{said}");
    }
    for name in ["p.obj", "p.ply", "p.off", "p.glb"] {
        std::fs::rename(&pipe, folder.path().join(name)).expect("renamed");
        assert!(folder.said(&folder.path().join(name), &options).ends_with("is no regular file"), "{name}");
        std::fs::rename(folder.path().join(name), &pipe).expect("renamed");
    }
    assert!(folder.said(&folder.path().join("zero.obj"), &options).ends_with("is no regular file"));
    std::fs::rename(&pipe, folder.path().join("metadata.xml")).expect("renamed");
    let obj = folder.write("a.obj", town().obj());
    assert!(Scene::open(&obj, &options).is_ok(), "a pipe is no metadata");
}
