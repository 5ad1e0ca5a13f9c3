//! PLY files (Stanford): text or binary, colours and texture coordinates at the vertices or the faces' corners.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::error::{Place, SceneError};
use crate::lookup::{Found, Lookup};
use crate::material::{GREY, Material, TextureSource};
use crate::paged::Paged;
use crate::placement::Placement;
use crate::ply_header::{self, Element, Encoding, Header, Property};
use crate::sink::{Corner, Halt, Sink};
use crate::texture;
use crate::tokens::Tokens;
use crate::triangle::Triangle;
use crate::values::{Reader, Values, skip, skip_one};
use gable_files::Reach;
use gable_geometry::DVec3;
use std::io::BufReader;
use std::path::Path;

fn open(path: &Path, reach: &Reach) -> Result<(Header, Reader), SceneError> {
    let file = reach.open(path)?;
    let mut reader = BufReader::with_capacity(1 << 20, file);
    let header = ply_header::read(path, &mut reader)?;
    Ok((header, reader))
}

/// A material for each texture that the header names.
pub(crate) fn read_materials(path: &Path, reach: &Reach, warnings: &mut Warnings) -> Result<Vec<Material>, SceneError> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let (header, _) = open(path, reach)?;
    let mut lookup = Lookup::new(reach);
    let material = |name: String| {
        let Found { path: file, elsewhere, .. } = lookup.find(&[folder], name.as_bytes());
        if elsewhere {
            warnings.add(WarningKind::FoundElsewhere, || format!("{}: {name}: {}", path.display(), file.display()));
        }
        let texture = match texture::image_type(&file, reach) {
            Ok(()) => Some(TextureSource::File(file)),
            Err(why) => {
                warnings.add(WarningKind::MissingTexture, || format!("{}: {why}", file.display()));
                None
            }
        };
        Material { name, texture, colour: GREY }
    };
    Ok(header.textures.into_iter().map(material).collect())
}

/// Streams one file. The vertices stand in memory, the faces do not.
pub(crate) fn stream(
    path: &Path,
    reach: &Reach,
    first: u32,
    placement: Placement,
    sink: &mut Sink<'_>,
) -> Result<(), Halt> {
    let (header, reader) = open(path, reach)?;
    check_is_mesh(path, &header)?;
    let mut values = match header.encoding {
        Encoding::Ascii => Values::Text(Tokens::new(path, reader, None, header.lines + 1)),
        encoding => Values::Binary { path, reader, offset: header.length, big: encoding == Encoding::Big },
    };
    let mut vertices: Option<Paged<Vertex>> = None;
    let mut faces = false;
    for element in &header.elements {
        match element.name.as_str() {
            "vertex" => vertices = Some(read_vertices(path, element, &mut values, placement, sink)?),
            "face" => {
                let Some(vertices) = &vertices else {
                    let what = "the faces stand before the vertices, which is not read: write the vertices first";
                    return Err(SceneError::Unsupported { path: path.to_owned(), what: what.to_owned() }.into());
                };
                let materials = first..first + header.textures.len() as u32;
                read_faces(path, element, &mut values, vertices, materials, sink)?;
                faces = true;
            }
            _ if element.properties.is_empty() => {}
            // What follows the faces is not wanted.
            _ if faces => break,
            _ => {
                for _ in 0..element.count {
                    skip(&mut values, &element.properties)?;
                }
            }
        }
    }
    if let Values::Text(tokens) = &values
        && tokens.commas > 0
    {
        sink.commas(tokens.commas, path);
    }
    if !faces && header.elements.iter().any(|e| e.name == "tristrips") {
        let what = "it holds triangle strips, which are not read: write it with faces";
        return Err(SceneError::Unsupported { path: path.to_owned(), what: what.to_owned() }.into());
    }
    Ok(())
}

/// The error for a file of points without faces.
fn check_is_mesh(path: &Path, header: &Header) -> Result<(), SceneError> {
    let count = |name: &str| header.elements.iter().filter(|e| e.name == name).map(|e| e.count).sum::<u64>();
    let points = count("vertex");
    if points == 0 || count("face") > 0 || count("tristrips") > 0 {
        return Ok(());
    }
    let what = format!("it is a point cloud: it has {points} points and no faces: give the mesh that was made of it");
    Err(SceneError::Unsupported { path: path.to_owned(), what })
}

#[derive(Clone, Copy)]
struct Vertex {
    position: DVec3,
    colour: [u8; 4],
    uv: [f32; 2],
}

/// What a vertex property means.
#[derive(Clone, Copy, PartialEq)]
enum Role {
    Position(usize),
    Colour(usize),
    Uv(usize),
    Other,
}

fn role(name: &str) -> Role {
    match name {
        "x" => Role::Position(0),
        "y" => Role::Position(1),
        "z" => Role::Position(2),
        "red" | "r" | "diffuse_red" => Role::Colour(0),
        "green" | "g" | "diffuse_green" => Role::Colour(1),
        "blue" | "b" | "diffuse_blue" => Role::Colour(2),
        "u" | "s" | "texture_u" | "texture_s" => Role::Uv(0),
        "v" | "t" | "texture_v" | "texture_t" => Role::Uv(1),
        _ => Role::Other,
    }
}

fn read_vertices(
    path: &Path,
    element: &Element,
    values: &mut Values<'_>,
    placement: Placement,
    sink: &mut Sink<'_>,
) -> Result<Paged<Vertex>, Halt> {
    let roles: Vec<Role> =
        element.properties.iter().map(|p| if p.list.is_some() { Role::Other } else { role(&p.name) }).collect();
    let has = |wanted: [Role; 3]| wanted.iter().all(|role| roles.contains(role));
    if !has([0, 1, 2].map(Role::Position)) {
        let what = "its vertices have no x, y and z";
        return Err(SceneError::Unsupported { path: path.to_owned(), what: what.to_owned() }.into());
    }
    let coloured = has([0, 1, 2].map(Role::Colour));
    let textured = roles.contains(&Role::Uv(0)) && roles.contains(&Role::Uv(1));
    let fractions = element.properties.iter().zip(&roles).any(|(p, r)| *r == Role::Colour(0) && p.item.is_float());
    if element.count > budget::VERTICES {
        return Err(SceneError::too_many_vertices(path).into());
    }
    let mut vertices = Paged::default();
    for _ in 0..element.count {
        let (mut position, mut colour, mut uv) = ([0.0; 3], [0.0; 3], [0.0; 2]);
        let place = values.place();
        let mut fault: Option<SceneError> = None;
        for (property, role) in element.properties.iter().zip(&roles) {
            match *role {
                Role::Position(axis) => {
                    position[axis] = values.next(property.item, "a vertex coordinate")?;
                    if !position[axis].is_finite() {
                        let place = if let Place::Line(_) = place { values.place() } else { place };
                        let value = position[axis].to_string();
                        fault.get_or_insert(SceneError::NotFinite { path: path.to_owned(), place, value });
                    }
                }
                Role::Colour(channel) => colour[channel] = values.next(property.item, "a vertex colour")?,
                Role::Uv(axis) => uv[axis] = values.next(property.item, "a texture coordinate")?,
                Role::Other => skip_one(values, property)?,
            }
        }
        if let Some(fault) = fault {
            sink.broken(WarningKind::BrokenVertex, fault)?;
        }
        // Fractions run to 1, but some programs write 0 to 255 as floats.
        let scale = if fractions && colour.iter().all(|c| *c <= 1.0) { 255.0 } else { 1.0 };
        let [r, g, b] = colour.map(|c| (c * scale).round().clamp(0.0, 255.0) as u8);
        let [x, y, z] = position;
        vertices.push(Vertex {
            position: sink.vertex(DVec3::new(x, y, z), &placement),
            colour: if coloured { [r, g, b, 255] } else { [0; 4] },
            uv: if textured { uv.map(finite) } else { Corner::NO_UV },
        });
        sink.counts.vertices += 1;
    }
    Ok(vertices)
}

/// The number, or what stands for "none".
fn finite(value: f64) -> f32 {
    let value = value as f32;
    if value.is_finite() { value } else { f32::NAN }
}

fn read_faces(
    path: &Path,
    element: &Element,
    values: &mut Values<'_>,
    vertices: &Paged<Vertex>,
    materials: std::ops::Range<u32>,
    sink: &mut Sink<'_>,
) -> Result<(), Halt> {
    let is_corners = |p: &Property| p.list.is_some() && matches!(p.name.as_str(), "vertex_indices" | "vertex_index");
    if !element.properties.iter().any(is_corners) {
        let what = "its faces have no list vertex_indices";
        return Err(SceneError::Unsupported { path: path.to_owned(), what: what.to_owned() }.into());
    }
    let mut corners: Vec<Corner> = Vec::new();
    let mut wedges: Vec<f32> = Vec::new();
    for _ in 0..element.count {
        corners.clear();
        wedges.clear();
        let mut material = materials.start;
        let mut fault: Option<SceneError> = None;
        let mut place = values.place();
        for property in &element.properties {
            match (property.list, property.name.as_str()) {
                (Some(kind), "vertex_indices" | "vertex_index") => {
                    let length = values.length(path, kind)?;
                    if let Place::Line(_) = place {
                        place = values.place();
                    }
                    corners.clear();
                    for _ in 0..length {
                        let index = values.next(property.item, "a vertex of a face")?;
                        let found =
                            if index >= 0.0 && index.fract() == 0.0 { vertices.get(index as usize) } else { None };
                        let Some(Vertex { position, colour, uv }) = found.copied() else {
                            fault.get_or_insert(SceneError::IndexOutOfRange {
                                path: path.to_owned(),
                                place,
                                kind: "vertex",
                                index: index as i64,
                                count: vertices.len() as u64,
                            });
                            continue;
                        };
                        corners.push(Corner { position, colour, uv });
                    }
                }
                (Some(kind), "texcoord") => {
                    let length = values.length(path, kind)?;
                    for _ in 0..length {
                        wedges.push(finite(values.next(property.item, "a texture coordinate")?));
                    }
                }
                (None, "texnumber") => {
                    let number = values.next(property.item, "the number of a texture")?;
                    let known = number >= 0.0 && number < f64::from(materials.end - materials.start);
                    material = if known { materials.start + number as u32 } else { u32::MAX };
                }
                _ => skip_one(values, property)?,
            }
        }
        sink.counts.faces += 1;
        if let Some(fault) = fault {
            sink.broken(WarningKind::BrokenFace, fault)?;
            continue;
        }
        if wedges.len() == 2 * corners.len() {
            for (corner, uv) in corners.iter_mut().zip(wedges.chunks_exact(2)) {
                corner.uv = [uv[0], uv[1]];
            }
        }
        let known = materials.contains(&material);
        if !known && !materials.is_empty() {
            sink.warn(WarningKind::UnknownMaterial, path, place);
        }
        sink.polygon(&corners, if known { material } else { Triangle::NO_MATERIAL }, path, place)?;
    }
    Ok(())
}
