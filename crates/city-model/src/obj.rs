//! Wavefront OBJ of a model: triangles in local metres, z up, an object for each building and a material for each kind of surface.

use crate::surface_kinds::{KINDS, TERRAIN, kind, linear};
use crate::{CityModel, Error, Shell, quantised, triangulate};
use gable_geometry::DVec3;
use std::io::Write;

/// Writes the best level of detail of each building of a model, and its terrain, as OBJ; `materials` is the name of the file that
/// [`write_mtl`] writes.
///
/// Coordinates are those of the local frame, whose origin the head names: programs that keep 32 bits lose nothing.
///
/// # Errors
/// If the stream fails, or a geometry is malformed.
pub fn write_obj(model: &CityModel, materials: &str, out: &mut impl Write) -> Result<(), Error> {
    let [x, y, z] = model.origin;
    writeln!(out, "# {}", one_line(&model.title))?;
    writeln!(out, "# metres, z up; origin {x} {y} {z}, reference system {}", model.crs)?;
    writeln!(out, "mtllib {materials}")?;
    let mut first = 1;
    if let Some(terrain) = model.terrain.as_ref().filter(|terrain| !terrain.triangles.is_empty()) {
        let count = terrain.vertices.len();
        if terrain.triangles.iter().flatten().any(|&i| i as usize >= count) {
            return Err(Error::object(&terrain.id, "the terrain has a vertex index out of range"));
        }
        writeln!(out, "o {}", one_line(&terrain.id))?;
        vertices(&terrain.vertices, out)?;
        writeln!(out, "usemtl {}", TERRAIN.0)?;
        for corners in &terrain.triangles {
            triangle(*corners, first, out)?;
        }
        first += count;
    }
    for building in &model.buildings {
        let (_, shells) = building.best();
        if shells.is_empty() {
            continue;
        }
        writeln!(out, "o {}", one_line(&building.id))?;
        for shell in shells {
            if !shell.is_well_formed() {
                let reason = "a geometry has a vertex index out of range or a coordinate not finite";
                return Err(Error::object(&building.id, reason));
            }
            first += faces(&quantised(shell), first, out)?;
        }
    }
    Ok(out.flush()?)
}

/// The materials of [`write_obj`].
///
/// # Errors
/// If the stream fails.
pub fn write_mtl(out: &mut impl Write) -> Result<(), Error> {
    for (name, colour) in KINDS.into_iter().chain([TERRAIN]) {
        let [r, g, b] = linear(colour);
        writeln!(out, "newmtl {name}\nKd {r} {g} {b}\nKs 0 0 0\nillum 1\n")?;
    }
    Ok(out.flush()?)
}

/// Writes a shell; gives the number of its vertices.
fn faces(shell: &Shell, first: usize, out: &mut impl Write) -> Result<usize, Error> {
    vertices(&shell.vertices, out)?;
    let triangles = triangulate(shell);
    for (number, (name, _)) in KINDS.iter().enumerate() {
        let of_kind = |face: u32| usize::from(kind(shell.faces[face as usize].semantic)) == number;
        let mut is_named = false;
        for t in triangles.iter().filter(|t| of_kind(t.face)) {
            if !is_named {
                writeln!(out, "usemtl {name}")?;
                is_named = true;
            }
            triangle(t.corners, first, out)?;
        }
    }
    Ok(shell.vertices.len())
}

fn vertices(points: &[DVec3], out: &mut impl Write) -> Result<(), Error> {
    for p in points {
        // No negative zero.
        let [x, y, z] = p.to_array().map(|v| (v * 1e4).round() / 1e4 + 0.0);
        writeln!(out, "v {x} {y} {z}")?;
    }
    Ok(())
}

fn triangle(corners: [u32; 3], first: usize, out: &mut impl Write) -> Result<(), Error> {
    let [a, b, c] = corners.map(|i| first + i as usize);
    Ok(writeln!(out, "f {a} {b} {c}")?)
}

/// A name without what would end its line.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
