//! A small town in every format, and helpers to read it.

use gable_geometry::{DVec3, dvec3};
use gable_scene::{Content, Counts, Material, OpenOptions, Scene, SceneError, Triangle};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Positions, colours, texture coordinates and quads of a ground of 40 × 30 m with a box of 6 m on it.
pub(crate) struct Town {
    pub(crate) positions: Vec<DVec3>,
    pub(crate) colours: Vec<[u8; 3]>,
    pub(crate) uvs: Vec<[f32; 2]>,
    pub(crate) quads: Vec<[usize; 4]>,
}

pub(crate) fn town() -> Town {
    let mut town = Town { positions: Vec::new(), colours: Vec::new(), uvs: Vec::new(), quads: Vec::new() };
    let mut ring = |x0: f64, y0: f64, x1: f64, y1: f64, z: f64| {
        for (x, y) in [(x0, y0), (x1, y0), (x1, y1), (x0, y1)] {
            town.positions.push(dvec3(x, y, z));
            town.uvs.push([(x / 40.0) as f32, (y / 30.0) as f32]);
            town.colours.push([(x * 6.0) as u8, (y * 8.0) as u8, (z * 40.0) as u8]);
        }
    };
    ring(0.0, 0.0, 40.0, 30.0, 0.5);
    ring(10.0, 10.0, 20.0, 18.0, 0.25);
    ring(10.0, 10.0, 20.0, 18.0, 6.125);
    // The ground around the box, its walls, its roof.
    for i in 0..4 {
        let j = (i + 1) % 4;
        town.quads.push([i, j, 4 + j, 4 + i]);
        town.quads.push([4 + i, 4 + j, 8 + j, 8 + i]);
    }
    town.quads.push([8, 9, 10, 11]);
    town
}

impl Town {
    /// The triangles that a reader must give, without attributes.
    pub(crate) fn corners(&self) -> Vec<[DVec3; 3]> {
        let fan = |q: &[usize; 4]| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]];
        self.quads.iter().flat_map(fan).map(|t| t.map(|i| self.positions[i])).collect()
    }

    pub(crate) fn obj(&self) -> String {
        let mut text = String::from("mtllib town.mtl\nusemtl brick\n");
        for (p, uv) in self.positions.iter().zip(&self.uvs) {
            let _ = writeln!(text, "v {} {} {}\nvt {} {}", p.x, p.y, p.z, uv[0], uv[1]);
        }
        for q in &self.quads {
            let _ = writeln!(text, "f {0}/{0} {1}/{1} {2}/{2} {3}/{3}", q[0] + 1, q[1] + 1, q[2] + 1, q[3] + 1);
        }
        text
    }

    pub(crate) fn off(&self) -> String {
        let mut text = format!("COFF # a town\n{} {} 0\n", self.positions.len(), self.quads.len());
        for (p, c) in self.positions.iter().zip(&self.colours) {
            let _ = writeln!(text, "{} {} {} {} {} {} 255", p.x, p.y, p.z, c[0], c[1], c[2]);
        }
        for q in &self.quads {
            let _ = writeln!(text, "4 {} {} {} {} 200 200 200", q[0], q[1], q[2], q[3]);
        }
        text
    }

    /// `format` is `ascii`, `binary_little_endian` or `binary_big_endian`.
    pub(crate) fn ply(&self, format: &str) -> Vec<u8> {
        let header = format!(
            "ply\nformat {format} 1.0\ncomment made here\nelement vertex {}\nproperty double x\nproperty double y\n\
             property double z\nproperty float s\nproperty float t\nproperty uchar red\nproperty uchar green\n\
             property uchar blue\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.quads.len()
        );
        let mut bytes = header.into_bytes();
        if format == "ascii" {
            let mut text = String::new();
            for ((p, uv), c) in self.positions.iter().zip(&self.uvs).zip(&self.colours) {
                let _ = writeln!(text, "{} {} {} {} {} {} {} {}", p.x, p.y, p.z, uv[0], uv[1], c[0], c[1], c[2]);
            }
            for q in &self.quads {
                let _ = writeln!(text, "4 {} {} {} {}", q[0], q[1], q[2], q[3]);
            }
            bytes.extend_from_slice(text.as_bytes());
            return bytes;
        }
        let big = format == "binary_big_endian";
        let mut put = |value: &[u8]| {
            if big { bytes.extend(value.iter().rev()) } else { bytes.extend_from_slice(value) }
        };
        for ((p, uv), c) in self.positions.iter().zip(&self.uvs).zip(&self.colours) {
            p.to_array().iter().for_each(|v| put(&v.to_le_bytes()));
            uv.iter().for_each(|v| put(&v.to_le_bytes()));
            c.iter().for_each(|v| put(&[*v]));
        }
        for q in &self.quads {
            put(&[4]);
            q.iter().for_each(|i| put(&(*i as i32).to_le_bytes()));
        }
        bytes
    }

    /// JSON and buffer of a glTF scene, y up, with the image after the numbers.
    pub(crate) fn gltf(&self, uri: &str, image: &[u8]) -> (String, Vec<u8>) {
        let mut buffer = Vec::new();
        for p in &self.positions {
            // x east, y up, z south; the node's transform below undoes the shift and the scale.
            for v in [p.x - 7.0, p.z, -p.y] {
                buffer.extend_from_slice(&((v / 2.0) as f32).to_le_bytes());
            }
        }
        for uv in &self.uvs {
            [uv[0], 1.0 - uv[1]].iter().for_each(|v| buffer.extend_from_slice(&v.to_le_bytes()));
        }
        let n = self.positions.len();
        let at = buffer.len();
        for q in &self.quads {
            for i in [q[0], q[1], q[2], q[0], q[2], q[3]] {
                buffer.extend_from_slice(&(i as u16).to_le_bytes());
            }
        }
        let end = buffer.len();
        buffer.extend_from_slice(image);
        let uri = if uri.is_empty() { String::new() } else { format!("\"uri\":\"{uri}\",") };
        let json = format!(
            r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[1]}}],
            "nodes":[{{"mesh":0,"scale":[2,2,2]}},{{"children":[0],"translation":[7,0,0]}}],
            "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"TEXCOORD_0":1}},"indices":2,"material":0}}]}}],
            "materials":[{{"name":"brick","pbrMetallicRoughness":{{"baseColorTexture":{{"index":0}}}}}}],
            "textures":[{{"source":0}}],"images":[{{"bufferView":3,"mimeType":"image/png"}}],
            "buffers":[{{{uri}"byteLength":{all}}}],
            "bufferViews":[{{"buffer":0,"byteLength":{p}}},{{"buffer":0,"byteOffset":{p},"byteLength":{u}}},
            {{"buffer":0,"byteOffset":{at},"byteLength":{i}}},{{"buffer":0,"byteOffset":{end},"byteLength":{m}}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":{n},"type":"VEC3","min":[-50,-50,-50],"max":[50,50,50]}},
            {{"bufferView":1,"componentType":5126,"count":{n},"type":"VEC2"}},
            {{"bufferView":2,"componentType":5123,"count":{c},"type":"SCALAR"}}]}}"#,
            all = buffer.len(),
            p = 12 * n,
            u = 8 * n,
            i = end - at,
            m = image.len(),
            c = self.quads.len() * 6,
        );
        (json, buffer)
    }

    pub(crate) fn glb(&self, image: &[u8]) -> Vec<u8> {
        let (mut json, mut buffer) = self.gltf("", image);
        while json.len() % 4 != 0 {
            json.push(' ');
        }
        buffer.resize(buffer.len().next_multiple_of(4), 0);
        let mut glb = b"glTF\x02\0\0\0".to_vec();
        glb.extend_from_slice(&((12 + 8 + json.len() + 8 + buffer.len()) as u32).to_le_bytes());
        glb.extend_from_slice(&(json.len() as u32).to_le_bytes());
        glb.extend_from_slice(b"JSON");
        glb.extend_from_slice(json.as_bytes());
        glb.extend_from_slice(&(buffer.len() as u32).to_le_bytes());
        glb.extend_from_slice(b"BIN\0");
        glb.extend_from_slice(&buffer);
        glb
    }
}

/// A PNG of 2 × 2 pixels: red, green, blue, white.
pub(crate) fn png() -> Vec<u8> {
    let pixels = vec![255, 0, 0, 0, 255, 0, 0, 0, 255, 255, 255, 255];
    let image = image::RgbImage::from_raw(2, 2, pixels).expect("the pixels fit");
    let mut bytes = std::io::Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).expect("memory");
    bytes.into_inner()
}

/// Base 64, to make data URIs.
pub(crate) fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::new();
    for three in bytes.chunks(3) {
        let bits = three.iter().fold(0u32, |b, v| b << 8 | u32::from(*v)) << (8 * (3 - three.len()));
        for at in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * at) & 63) as usize] as char;
            text.push(if at > three.len() { '=' } else { letter });
        }
    }
    text
}

/// A folder that holds what a test writes.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        Self(tempfile::tempdir().expect("temporary folder"))
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        std::fs::create_dir_all(path.parent().expect("has a folder")).expect("temporary folder");
        std::fs::write(&path, bytes).expect("temporary file");
        path
    }

    /// What reading says, the folder's path cut away.
    pub(crate) fn said(&self, path: &Path, options: &OpenOptions) -> String {
        let error = read(path, options).expect_err("reading must fail").to_string();
        error.replace(&format!("{}/", self.0.path().display()), "").replace(&self.0.path().display().to_string(), ".")
    }
}

/// A scene that was read.
#[derive(Debug)]
pub(crate) struct Read {
    pub(crate) scene: Scene,
    pub(crate) triangles: Vec<Triangle>,
    pub(crate) counts: Counts,
    pub(crate) materials: Vec<Material>,
}

/// All triangles of a scene.
pub(crate) fn read(path: &Path, options: &OpenOptions) -> Result<Read, SceneError> {
    let scene = Scene::open(path, options)?;
    let mut triangles = Vec::new();
    let Content { counts, materials } = scene.for_each_chunk(|chunk| {
        triangles.extend_from_slice(chunk);
        Ok::<(), SceneError>(())
    })?;
    Ok(Read { scene, triangles, counts, materials })
}

/// The folder of the real meshes, where there is one; else says that the test is skipped.
#[expect(clippy::print_stderr, reason = "a test that is skipped says so")]
pub(crate) fn data() -> Option<PathBuf> {
    let beside = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("GABLE_TEST_DATA").map_or(beside, PathBuf::from);
    if folder.is_dir() {
        return Some(folder);
    }
    eprintln!("skipped: no test data at GABLE_TEST_DATA, nor at ../shared/data beside the workspace");
    None
}
