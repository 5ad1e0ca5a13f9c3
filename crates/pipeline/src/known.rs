//! What is known of the buildings beforehand: footprints, and the planes of their roofs, from a city model.
//!
//! Footprints from a cadastre say where one building ends and the next begins, which no mesh tells. Roof planes are for
//! experiments: fed with those of a truth, a run shows what is lost after they are found.

use crate::stages::Context;
use crate::{PipelineError, budget};
use gable_city_model::{Attributes, Building, Face, ReadOptions, Semantic, Shell, read_cityjson_str};
use gable_geometry::{Box2, DVec2, DVec3, Frame, Plane, Polygon};
use gable_modeling::KnownRoof;
use gable_raster::{GridWindow, Raster};
use std::path::Path;

/// Attributes of a footprint that its building keeps.
const KEPT: [&str; 6] =
    ["class", "function", "usage", "yearOfConstruction", "storeysAboveGround", "storeysBelowGround"];
/// Roof surfaces steeper than this are walls, radians.
const STEEPEST: f64 = 1.5;
/// Planes whose slopes differ by less, and whose heights by less than [`SAME_HEIGHT`] on the polygon, are one.
const SAME_SLOPE: f64 = 1e-3;
/// See [`SAME_SLOPE`]; metres.
const SAME_HEIGHT: f64 = 0.01;

/// Polygons that belong to one building, in the local frame.
#[derive(Clone, Debug)]
pub(crate) struct Footprint {
    /// Name in the file.
    pub(crate) id: String,
    /// What it is told of the building that a mesh does not show, under CityGML's names.
    pub(crate) attributes: Attributes,
    pub(crate) polygons: Vec<Polygon>,
    pub(crate) bounds: Box2,
}

/// A roof surface.
#[derive(Clone, Debug)]
struct Roof {
    polygon: Polygon,
    bounds: Box2,
    plane: Plane,
}

/// Buildings of a CityJSON file, in its order.
#[derive(Clone, Debug)]
pub(crate) struct Known {
    pub(crate) footprints: Vec<Footprint>,
    roofs: Vec<Roof>,
}

impl Known {
    /// Reads a file. Buildings without a footprint at LOD0 stand on the ground surfaces of their LOD2 or LOD1.
    pub(crate) fn read(path: &Path, frame: &Frame, context: &Context<'_>) -> Result<Self, PipelineError> {
        let wrong = |reason: String| PipelineError::Input(format!("{}: {reason}", path.display()));
        let options = ReadOptions { origin: Some(frame.origin) };
        let text = context.reach.read_text(path, budget::CITY_MODEL);
        let text = text.map_err(|e| PipelineError::Input(e.to_string()))?;
        let model = read_cityjson_str(&text, path, &options).map_err(|e| PipelineError::Input(e.to_string()))?.model;
        let footprints: Vec<Footprint> = model.buildings.iter().filter_map(footprint).collect();
        if footprints.is_empty() {
            return Err(wrong("no building in this file has a footprint".to_owned()));
        }
        for footprint in &footprints {
            footprint.check(context.params.sampling.step).map_err(wrong)?;
        }
        Ok(Self { footprints, roofs: model.buildings.iter().flat_map(|b| &b.lods.lod2).flat_map(roofs).collect() })
    }

    /// Whether each pixel of a window lies in any footprint.
    pub(crate) fn built(&self, window: GridWindow) -> Raster<bool> {
        let bounds = window.bounds();
        let mut out = Raster::filled(window, false);
        for footprint in self.footprints.iter().filter(|f| f.bounds.intersects(&bounds)) {
            footprint.draw(&mut out);
        }
        out
    }

    /// The roof planes on a mask and which of them lies uppermost over each of its pixels; `None` if none does.
    pub(crate) fn roof(&self, mask: &Raster<bool>) -> Option<KnownRoof> {
        let window = mask.window();
        let bounds = window.bounds();
        let mut planes: Vec<Plane> = Vec::new();
        let mut labels = Raster::filled(window, u16::MAX);
        for roof in self.roofs.iter().filter(|r| r.bounds.intersects(&bounds)) {
            let mut number = None;
            for_each_pixel(window, &roof.bounds, |column, row, at| {
                if !mask[(column, row)] || !roof.polygon.contains(at) {
                    return;
                }
                let below = labels[(column, row)];
                if below != u16::MAX && planes[usize::from(below)].height(at) >= roof.plane.height(at) {
                    return;
                }
                let number = *number.get_or_insert_with(|| {
                    let same = planes.iter().position(|p| {
                        (p.a - roof.plane.a).hypot(p.b - roof.plane.b) < SAME_SLOPE
                            && (p.height(at) - roof.plane.height(at)).abs() < SAME_HEIGHT
                    });
                    same.unwrap_or_else(|| {
                        planes.push(roof.plane);
                        planes.len() - 1
                    })
                });
                labels[(column, row)] = number.min(usize::from(u16::MAX)) as u16;
            });
        }
        (!planes.is_empty() && planes.len() < usize::from(u16::MAX)).then_some(KnownRoof { planes, labels })
    }
}

impl Footprint {
    /// Refuses one that no building has: its pixels, and the work of drawing it, would be without end.
    fn check(&self, step: f64) -> Result<(), String> {
        let size = self.bounds.size();
        let pixels = (size.x / step + 2.0) * (size.y / step + 2.0);
        let corners: usize =
            self.polygons.iter().map(|p| p.outer.len() + p.holes.iter().map(Vec::len).sum::<usize>()).sum();
        if pixels <= budget::BUILDING_PIXELS as f64 && pixels * corners as f64 <= budget::FOOTPRINT_WORK {
            return Ok(());
        }
        Err(format!(
            "the footprint of {:?} measures {:.0} × {:.0} m and has {corners} corners, too much for one building: \
             is the file in metres, and in the reference system of the mesh?",
            self.id, size.x, size.y
        ))
    }

    /// Sets the pixels whose centres it contains.
    pub(crate) fn draw(&self, out: &mut Raster<bool>) {
        for polygon in &self.polygons {
            for_each_pixel(out.window(), &polygon.bounds(), |column, row, at| {
                if polygon.contains(at) {
                    out[(column, row)] = true;
                }
            });
        }
    }
}

/// The pixels of a window that a box touches, with their centres.
fn for_each_pixel(window: GridWindow, bounds: &Box2, mut visit: impl FnMut(usize, usize, DVec2)) {
    let low = (bounds.min / window.step).floor() - DVec2::new(window.x0 as f64, window.y0 as f64);
    let high = (bounds.max / window.step).ceil() - DVec2::new(window.x0 as f64, window.y0 as f64);
    let clamp = |v: f64, n: usize| v.clamp(0.0, n as f64) as usize;
    for row in clamp(low.y, window.height)..clamp(high.y, window.height) {
        for column in clamp(low.x, window.width)..clamp(high.x, window.width) {
            visit(column, row, window.centre(column, row));
        }
    }
}

fn footprint(building: &Building) -> Option<Footprint> {
    let lods = &building.lods;
    let ground = |shells: &[Shell]| flat(shells, |s| s == Semantic::GroundSurface);
    let choices: [&dyn Fn() -> Vec<Polygon>; 3] =
        [&|| flat(lods.footprint.as_slice(), |_| true), &|| ground(&lods.lod2), &|| ground(&lods.lod1)];
    let polygons = choices.iter().map(|choice| choice()).find(|p| !p.is_empty())?;
    let bounds = Box2::of(polygons.iter().flat_map(|p| p.outer.iter().copied()));
    let attributes = building.attributes.iter().filter(|(name, _)| KEPT.contains(&name.as_str()));
    let attributes = attributes.map(|(name, value)| (name.clone(), value.clone())).collect();
    Some(Footprint { id: building.id.clone(), attributes, polygons, bounds })
}

/// Faces seen from above.
fn flat(shells: &[Shell], keep: impl Fn(Semantic) -> bool) -> Vec<Polygon> {
    let faces = shells.iter().flat_map(|shell| shell.faces.iter().map(move |face| (shell, face)));
    faces.filter(|(_, face)| keep(face.semantic)).filter_map(|(shell, face)| polygon(shell, face)).collect()
}

/// A face seen from above.
fn polygon(shell: &Shell, face: &Face) -> Option<Polygon> {
    let mut rings = face.rings.iter().map(|r| r.iter().map(|&v| shell.vertices[v as usize].truncate()).collect());
    Some(Polygon { outer: rings.next()?, holes: rings.collect() })
}

fn roofs(shell: &Shell) -> Vec<Roof> {
    let mut out = Vec::new();
    for face in shell.faces.iter().filter(|f| f.semantic == Semantic::RoofSurface) {
        let normal = shell.vector_area(face);
        let Some(ring) = face.rings.first().filter(|r| !r.is_empty()) else { continue };
        let mean = ring.iter().map(|&v| shell.vertices[v as usize]).sum::<DVec3>() / ring.len() as f64;
        let plane = Plane::from_normal(normal, mean).filter(|p| normal.z > 0.0 && p.slope() < STEEPEST);
        let Some(plane) = plane else { continue };
        out.extend(polygon(shell, face).map(|polygon| Roof { bounds: polygon.bounds(), polygon, plane }));
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unobserved;
    use crate::params::Params;
    use crate::workspace::Workspace;
    use gable_files::Reach;
    use gable_geometry::{Crs, dvec2};

    /// Two houses wall to wall: x from 0 to 2 and from 2 to 4 m, y from 0 to 2 m; the second has a roof that rises with x.
    fn file(folder: &Path) -> std::path::PathBuf {
        let path = folder.join("known.city.json");
        let text = r#"{"type": "CityJSON", "version": "2.0", "transform": {"scale": [1, 1, 1], "translate": [100, 200, 0]},
            "vertices": [[0,0,0],[2,0,0],[2,2,0],[0,2,0],[4,0,0],[4,2,0],[0,0,5],[2,0,5],[2,2,5],[0,2,5],[4,0,7],[4,2,7]],
            "CityObjects": {
                "a": {"type": "Building", "geometry": [
                    {"type": "MultiSurface", "lod": "0", "boundaries": [[[0,1,2,3]]]},
                    {"type": "MultiSurface", "lod": "2", "boundaries": [[[6,7,8,9]]],
                     "semantics": {"surfaces": [{"type": "RoofSurface"}], "values": [0]}}]},
                "b": {"type": "Building", "geometry": [
                    {"type": "MultiSurface", "lod": "0", "boundaries": [[[1,4,5,2]]]},
                    {"type": "MultiSurface", "lod": "2", "boundaries": [[[7,10,11,8]]],
                     "semantics": {"surfaces": [{"type": "RoofSurface"}], "values": [0]}}]}}}"#;
        std::fs::write(&path, text).unwrap();
        path
    }

    fn read(path: &Path, frame: &Frame) -> Result<Known, PipelineError> {
        let folder = tempfile::tempdir().unwrap();
        let (params, workspace) = (Params::default(), Workspace::at(folder.path()).unwrap());
        let (observer, reach) = (&Unobserved, &Reach::everything());
        Known::read(path, frame, &Context { params: &params, observer, workspace: &workspace, reach })
    }

    /// The size of what a file says.
    fn sized(text: &str) -> String {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("known.city.json");
        std::fs::write(&path, text).unwrap();
        let frame = Frame { origin: [0.0; 3], crs: Crs::Unknown };
        read(&path, &frame).map_or_else(|e| e.to_string(), |known| format!("{} footprints", known.footprints.len()))
    }

    #[test]
    fn footprints_that_no_building_has_are_refused() {
        let square = |side: f64, scale: f64| {
            format!(
                r#"{{"type": "CityJSON", "version": "2.0", "transform": {{"scale": [{scale}, {scale}, 1], "translate": [0, 0, 0]}},
                "vertices": [[0,0,0],[{side},0,0],[{side},{side},0],[0,{side},0]],
                "CityObjects": {{"big": {{"type": "Building", "geometry": [
                    {{"type": "MultiSurface", "lod": "0", "boundaries": [[[0,1,2,3]]]}}]}}}}}}"#
            )
        };
        assert_eq!(sized(&square(1500.0, 1.0)), "1 footprints", "as large as the largest airport");
        for text in [square(10_000.0, 1.0), square(20.0, 1e3), square(2000.0, 1e3)] {
            let said = sized(&text);
            assert!(said.contains("the footprint of \"big\" measures") && said.contains("in metres"), "{said}");
        }
        let said = sized(&square(1e9, 1e6));
        assert!(said.contains("known.city.json"), "{said}");
        let mut corners = String::new();
        let mut ring = String::new();
        for i in 0..2_000_000 {
            corners += &format!("[{},{},0],", i % 1500, i / 1500);
            ring += &format!("{i},");
        }
        let many = square(1.0, 1.0).replace("\"vertices\": [", &format!("\"vertices\": [{corners}"));
        let many = many.replace("[[[0,1,2,3]]]", &format!("[[[{}]]]", ring.trim_end_matches(',')));
        assert!(sized(&many).contains("2000000 corners"), "{}", sized(&many));
    }

    #[test]
    fn footprints_and_roofs_come_in_the_local_frame() {
        let folder = tempfile::tempdir().unwrap();
        let frame = Frame { origin: [99.0, 200.0, 1.0], crs: Crs::Unknown };
        let known = read(&file(folder.path()), &frame).unwrap();
        assert_eq!(known.footprints.iter().map(|f| f.id.as_str()).collect::<Vec<_>>(), ["a", "b"]);
        let window = GridWindow { step: 1.0, x0: 0, y0: -1, width: 6, height: 3 };
        let built = known.built(window);
        assert_eq!(built.row(0), [false; 6]);
        assert_eq!(built.row(1), [false, true, true, true, true, false]);
        let mut one = Raster::filled(window, false);
        known.footprints[1].draw(&mut one);
        assert_eq!(one.row(2), [false, false, false, true, true, false]);

        let roof = known.roof(&built).unwrap();
        assert_eq!(roof.labels.row(1), [u16::MAX, 0, 0, 1, 1, u16::MAX]);
        assert!((roof.planes[0].height(dvec2(2.0, 1.0)) - 4.0).abs() < 1e-9);
        assert!((roof.planes[1].height(dvec2(4.0, 1.0)) - 5.0).abs() < 1e-9);
        assert!(known.roof(&Raster::filled(window, false)).is_none());
    }

    #[test]
    fn a_file_without_footprints_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("empty.city.json");
        std::fs::write(
            &path,
            r#"{"type": "CityJSON", "version": "2.0", "CityObjects": {}, "vertices": [],
            "transform": {"scale": [1, 1, 1], "translate": [0, 0, 0]}}"#,
        )
        .unwrap();
        let frame = Frame { origin: [0.0; 3], crs: Crs::Unknown };
        let message = read(&path, &frame).unwrap_err().to_string();
        assert!(message.contains("empty.city.json") && message.contains("footprint"), "{message}");
    }
}
