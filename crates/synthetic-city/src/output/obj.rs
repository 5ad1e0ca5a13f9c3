//! A tile as OBJ with MTL and a JPG atlas, and the metadata of the folder.

use crate::error::SynthError;
use crate::sensing::TriMesh;
use crate::texture::atlas::Atlas;
use crate::texture::render::Picture;
use gable_geometry::Crs;
use image::codecs::jpeg::JpegEncoder;
use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

/// Quality of the JPG pictures: visible noise, as in delivered data.
const QUALITY: u8 = 82;

/// Name of a tile.
pub(crate) fn tile_name(ix: i64, iy: i64) -> String {
    format!("Tile_{ix:+04}_{iy:+04}")
}

/// Writes `mesh/metadata.xml`: the reference system and the world coordinates of the local origin.
pub(crate) fn write_metadata(folder: &Path, origin: [f64; 3], crs: &Crs) -> Result<(), SynthError> {
    fs::create_dir_all(folder).map_err(SynthError::io(folder))?;
    let srs = match crs {
        Crs::Unknown => String::new(),
        known => known.to_string(),
    };
    let [x, y, z] = origin;
    let text = format!(
        "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<ModelMetadata version=\"1\">\n\t<!--Spatial Reference System-->\n\t\
         <SRS>{srs}</SRS>\n\t<!--Origin in Spatial Reference System-->\n\t<SRSOrigin>{x},{y},{z}</SRSOrigin>\n\t\
         <Texture>\n\t\t<ColorSource>Visible</ColorSource>\n\t</Texture>\n</ModelMetadata>\n"
    );
    let path = folder.join("metadata.xml");
    fs::write(&path, text).map_err(SynthError::io(path))
}

/// Writes a tile; returns the bytes written. Faces that are `plain` have a material without texture.
pub(crate) fn write_tile(
    folder: &Path,
    name: &str,
    mesh: &TriMesh,
    texture: Option<(&Atlas, &Picture)>,
    plain: &[bool],
) -> Result<u64, SynthError> {
    let folder: PathBuf = folder.join("Data").join(name);
    fs::create_dir_all(&folder).map_err(SynthError::io(&folder))?;
    let mut text = Text { bytes: Vec::with_capacity(mesh.vertices.len() * 40 + mesh.faces.len() * 60) };
    if texture.is_some() {
        text.line(&format!("mtllib {name}.mtl"));
    }
    for p in &mesh.vertices {
        text.numbers("v", &[p.x, p.y, p.z]);
    }
    match texture {
        None => {
            for f in &mesh.faces {
                text.line(&format!("f {} {} {}", f[0] + 1, f[1] + 1, f[2] + 1));
            }
        }
        Some((atlas, _)) => textured_faces(&mut text, name, mesh, atlas, plain),
    }
    let mut total = text.bytes.len() as u64;
    let path = folder.join(format!("{name}.obj"));
    fs::write(&path, &text.bytes).map_err(SynthError::io(path))?;
    if let Some((_, picture)) = texture {
        let material = format!("newmtl {name}_0\nKa 1 1 1\nKd 1 1 1\nd 1\nNs 0\nillum 1\nmap_Kd {name}_0.jpg\n");
        let filled = format!("newmtl {name}_1\nKa 1 1 1\nKd 0.42 0.42 0.42\nd 1\nNs 0\nillum 1\n");
        let material = if plain.contains(&true) { material + &filled } else { material };
        let path = folder.join(format!("{name}.mtl"));
        fs::write(&path, material).map_err(SynthError::io(path))?;
        total += write_jpg(&folder.join(format!("{name}_0.jpg")), picture)?;
    }
    Ok(total)
}

fn textured_faces(text: &mut Text, name: &str, mesh: &TriMesh, atlas: &Atlas, plain: &[bool]) {
    let (w, h) = (atlas.width as f64, atlas.height as f64);
    // A texture vertex for each vertex of each chart; charts are numbered from 1 so that 0 means none.
    let mut own: Vec<(u32, u32)> = vec![(0, 0); mesh.vertices.len()];
    let mut next = 1_u32;
    let mut faces: Vec<[u32; 6]> = Vec::with_capacity(mesh.faces.len());
    let mut order: Vec<u32> = Vec::with_capacity(mesh.faces.len());
    for (n, chart) in atlas.charts.iter().enumerate() {
        for &f in &chart.faces {
            let mut line = [0; 6];
            for (k, &v) in mesh.faces[f as usize].iter().enumerate() {
                let slot = &mut own[v as usize];
                if slot.0 != n as u32 + 1 {
                    *slot = (n as u32 + 1, next);
                    next += 1;
                    let t = chart.texel(mesh.vertices[v as usize]);
                    text.numbers("vt", &[t.x / w, 1.0 - t.y / h]);
                }
                line[2 * k] = v + 1;
                line[2 * k + 1] = slot.1;
            }
            faces.push(line);
            order.push(f);
        }
    }
    text.line(&format!("usemtl {name}_0"));
    let mut sorted: Vec<u32> = (0..order.len() as u32).collect();
    sorted.sort_unstable_by_key(|&i| order[i as usize]);
    let mut material = 0;
    for i in sorted {
        let f = faces[i as usize];
        let wanted = u8::from(plain.get(order[i as usize] as usize) == Some(&true));
        if material != wanted {
            material = wanted;
            text.line(&format!("usemtl {name}_{material}"));
        }
        text.line(&format!("f {}/{} {}/{} {}/{}", f[0], f[1], f[2], f[3], f[4], f[5]));
    }
}

struct Text {
    bytes: Vec<u8>,
}

impl Text {
    fn line(&mut self, line: &str) {
        self.bytes.extend_from_slice(line.as_bytes());
        self.bytes.push(b'\n');
    }

    /// A keyword and numbers with up to five decimals.
    fn numbers(&mut self, keyword: &str, values: &[f64]) {
        self.bytes.extend_from_slice(keyword.as_bytes());
        for &v in values {
            self.bytes.push(b' ');
            let scaled = (v * 1e5).round() as i64;
            if scaled < 0 {
                self.bytes.push(b'-');
            }
            let magnitude = scaled.unsigned_abs();
            self.bytes.extend_from_slice((magnitude / 100_000).to_string().as_bytes());
            self.bytes.push(b'.');
            let mut rest = magnitude % 100_000;
            let mut digits = [0_u8; 5];
            for d in digits.iter_mut().rev() {
                *d = b'0' + (rest % 10) as u8;
                rest /= 10;
            }
            self.bytes.extend_from_slice(&digits);
        }
        self.bytes.push(b'\n');
    }
}

fn write_jpg(path: &Path, picture: &Picture) -> Result<u64, SynthError> {
    let file = File::create(path).map_err(SynthError::io(path))?;
    let mut out = BufWriter::new(file);
    JpegEncoder::new_with_quality(&mut out, QUALITY)
        .encode(&picture.data, picture.width as u32, picture.height as u32, image::ExtendedColorType::Rgb8)
        .map_err(|source| SynthError::Picture { path: path.to_owned(), source })?;
    out.flush().map_err(SynthError::io(path))?;
    Ok(fs::metadata(path).map_err(SynthError::io(path))?.len())
}
