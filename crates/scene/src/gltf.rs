//! GLB and glTF 2.0 files (Khronos): the triangles of the default scene, its nodes' transforms applied.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::error::{Place, SceneError};
use crate::glb::Container;
use crate::gltf_accessor::{Indices, Numbers};
use crate::gltf_nodes::world_centre;
use crate::gltf_visits::visits;
use crate::lookup::Lookup;
use crate::material::{GREY, Material, TextureSource};
use crate::placement::{Axis, Placement};
use crate::sink::{Corner, Halt, Sink};
use crate::texture;
use crate::transform::Transform;
use crate::triangle::Triangle;
use crate::uri::Target;
use gable_files::Reach;
use gable_geometry::DVec3;
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Primitive, Semantic};
use std::path::{Path, PathBuf};

/// A material for each of the file's, in its order.
pub(crate) fn read_materials(path: &Path, reach: &Reach, warnings: &mut Warnings) -> Result<Vec<Material>, SceneError> {
    let container = Container::open(path, reach)?;
    let mut materials = Vec::new();
    for source in container.document.materials() {
        let surface = source.pbr_metallic_roughness();
        let [r, g, b, _] = surface.base_color_factor();
        let name = source.name().unwrap_or_default().to_owned();
        let mut material = Material { name, texture: None, colour: [r, g, b].map(srgb) };
        let texture = surface.base_color_texture().or_else(|| source.emissive_texture());
        if let Some(texture) = texture {
            material.colour = GREY;
            let image = container.nodes.images.get(texture.texture().index()).copied().flatten();
            let found = image.ok_or_else(|| "its image is of a type that is not read".to_owned());
            match found.and_then(|image| image_source(&container, image)) {
                Ok(source) => material.texture = Some(source),
                Err(why) => {
                    let place = || format!("{}: material {:?}: {why}", path.display(), material.name);
                    warnings.add(WarningKind::MissingTexture, place);
                }
            }
        }
        materials.push(material);
    }
    Ok(materials)
}

/// Where an image is, if it is there and of a type that is read.
fn image_source(container: &Container, index: usize) -> Result<TextureSource, String> {
    let embedded = TextureSource::Embedded { file: container.path.clone(), image: index };
    let start = match image_target(container, index, texture::HEAD).map_err(|e| e.to_string())? {
        Target::File(file) => {
            texture::image_type(&file, &container.reach)?;
            return Ok(TextureSource::File(file));
        }
        Target::Bytes(bytes) => bytes,
    };
    texture::format(&start).map(|_| embedded)
}

/// The file of an image, or its bytes: at most `most` of them where they are in a buffer.
fn image_target(container: &Container, index: usize, most: u64) -> Result<Target, SceneError> {
    let image = container.document.as_json().images.get(index);
    let image = image.ok_or_else(|| container.fault("an image that is named is not there"))?;
    match (&image.buffer_view, &image.uri) {
        (Some(view), _) => {
            let view = container.document.views().nth(view.value());
            let view = view.ok_or_else(|| container.fault("an image's buffer view is not there"))?;
            container.read_view(&view, most).map(Target::Bytes)
        }
        (None, Some(uri)) => Ok(match container.resolve(uri)? {
            Target::File(file) => Target::File(found(container, file)),
            bytes => bytes,
        }),
        (None, None) => Err(container.fault("an image has neither a URI nor a buffer view")),
    }
}

/// A file that a glTF file names, or the one that is meant if there is none of this name.
fn found(container: &Container, file: PathBuf) -> PathBuf {
    if container.reach.is_file(&file) {
        return file;
    }
    let folder = container.path.parent().unwrap_or(Path::new(""));
    let name = file.strip_prefix(folder).unwrap_or(&file).to_string_lossy().into_owned();
    let found = Lookup::new(&container.reach).find(&[folder], name.as_bytes());
    if found.is_there { found.path } else { file }
}

/// The bytes of an image inside a file.
pub(crate) fn image_bytes(path: &Path, index: usize, reach: &Reach) -> Result<Vec<u8>, SceneError> {
    match image_target(&Container::open(path, reach)?, index, budget::IMAGE_FILE)? {
        Target::Bytes(bytes) => Ok(bytes),
        Target::File(file) => Ok(reach.read(&file, budget::IMAGE_FILE)?),
    }
}

/// A linear channel in sRGB (IEC 61966-2-1), as a byte.
fn srgb(linear: f32) -> u8 {
    let c = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (c.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Streams one file: primitive by primitive, each in memory while it is read.
pub(crate) fn stream(
    path: &Path,
    reach: &Reach,
    first: u32,
    mut placement: Placement,
    sink: &mut Sink<'_>,
) -> Result<(), Halt> {
    let container = Container::open(path, reach)?;
    let mut mirrored = false;
    if let Some(frame) = placement.frame {
        // Of a tile the centre is in the frame of the tiles, and never turned.
        placement.origin += container.nodes.centre.unwrap_or_default() + container.tile_centre.unwrap_or_default();
        mirrored = frame.mirrors();
    } else if let Some(centre) = container.nodes.centre {
        placement.origin += world_centre(centre, placement.up == Axis::Y);
    }
    let nodes: Vec<_> = container.document.nodes().collect();
    for (index, transform) in visits(&container)? {
        for primitive in nodes[index].mesh().iter().flat_map(gltf::Mesh::primitives) {
            stream_primitive(&container, &primitive, first, &transform, mirrored, placement, sink)?;
        }
    }
    Ok(())
}

fn stream_primitive(
    container: &Container,
    primitive: &Primitive<'_>,
    first: u32,
    transform: &Transform,
    mirrored: bool,
    placement: Placement,
    sink: &mut Sink<'_>,
) -> Result<(), Halt> {
    let path = container.path.as_path();
    if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
        sink.counts.warnings.add(WarningKind::IgnoredStatement, || format!("{}: points or lines", path.display()));
        return Ok(());
    }
    let Some(positions) = primitive.get(&Semantic::Positions) else { return Ok(()) };
    let place = Place::Byte(positions.view().map_or(0, |view| view.offset() as u64));
    let positions = Numbers::read(container, &positions, Dimensions::Vec3, &[DataType::F32])?;
    let count = positions.count;
    let surface = primitive.material().pbr_metallic_roughness();
    let info = surface.base_color_texture().or_else(|| primitive.material().emissive_texture());
    let shift = info.as_ref().and_then(gltf::texture::Info::texture_transform);
    let set = info.as_ref().map_or(0, gltf::texture::Info::tex_coord);
    let set = shift.as_ref().and_then(gltf::texture::TextureTransform::tex_coord).unwrap_or(set);
    let uvs = match primitive.get(&Semantic::TexCoords(set)) {
        Some(uvs) => {
            Some(Numbers::read(container, &uvs, Dimensions::Vec2, &[DataType::F32, DataType::U8, DataType::U16])?)
        }
        None => None,
    };
    let colours = match primitive.get(&Semantic::Colors(0)) {
        Some(colours) => {
            let wanted = if colours.dimensions() == Dimensions::Vec4 { Dimensions::Vec4 } else { Dimensions::Vec3 };
            Some(Numbers::read(container, &colours, wanted, &[DataType::F32, DataType::U8, DataType::U16])?)
        }
        None => None,
    };
    let mut corners = Vec::with_capacity(count);
    for at in 0..count {
        let [x, y, z] = positions.get(at).map(f64::from);
        let position = sink.vertex(transform.apply(DVec3::new(x, y, z)), &placement);
        if !position.is_finite() {
            let value = format!("({x}, {y}, {z}) in the vertices of a mesh");
            sink.broken(WarningKind::BrokenVertex, SceneError::NotFinite { path: path.to_owned(), place, value })?;
        }
        let uv = uvs.as_ref().filter(|uvs| at < uvs.count).map_or(Corner::NO_UV, |uvs| {
            let [u, v] = uvs.get(at);
            let (u, v) = shift.as_ref().map_or((u, v), |shift| {
                let ([su, sv], [ou, ov]) = (shift.scale(), shift.offset());
                let (sin, cos) = shift.rotation().sin_cos();
                (cos * u * su + sin * v * sv + ou, cos * v * sv - sin * u * su + ov)
            });
            // glTF's v runs down from the top of the image.
            let uv = [u, 1.0 - v];
            if uv.iter().all(|c| c.is_finite()) { uv } else { Corner::NO_UV }
        });
        let colour = colours.as_ref().filter(|colours| at < colours.count).map_or([0; 4], |colours| {
            let [r, g, b] = colours.get(at).map(srgb);
            [r, g, b, 255]
        });
        corners.push(Corner { position, colour, uv });
    }
    sink.counts.vertices += count as u64;

    let indices = match primitive.indices() {
        Some(indices) => Some(Indices::read(container, &indices)?),
        None => None,
    };
    let length = indices.as_ref().map_or(count, |indices| indices.count);
    let corner = |at: usize| {
        let index = indices.as_ref().map_or(at as u32, |indices| indices.get(at));
        corners.get(index as usize).copied().ok_or_else(|| SceneError::IndexOutOfRange {
            path: path.to_owned(),
            place: indices.as_ref().map_or(place, |indices| Place::Byte(indices.offset)),
            kind: "vertex",
            index: i64::from(index),
            count: count as u64,
        })
    };
    let material = primitive.material().index().map_or(Triangle::NO_MATERIAL, |index| first + index as u32);
    let triangles = match primitive.mode() {
        Mode::Triangles => length / 3,
        _ => length.saturating_sub(2),
    };
    sink.counts.faces += triangles as u64;
    for at in 0..triangles {
        let [a, b, c] = match primitive.mode() {
            Mode::Triangles => [3 * at, 3 * at + 1, 3 * at + 2],
            Mode::TriangleFan => [0, at + 1, at + 2],
            // Every second triangle of a strip runs the other way.
            _ if at % 2 == 1 => [at + 1, at, at + 2],
            _ => [at, at + 1, at + 2],
        };
        let mut three = match [corner(a), corner(b), corner(c)] {
            [Ok(a), Ok(b), Ok(c)] => [a, b, c],
            [Err(fault), ..] | [_, Err(fault), _] | [.., Err(fault)] => {
                sink.broken(WarningKind::BrokenFace, fault)?;
                continue;
            }
        };
        if transform.mirrors() != mirrored {
            three.swap(1, 2);
        }
        sink.polygon(&three, material, path, place)?;
    }
    Ok(())
}
