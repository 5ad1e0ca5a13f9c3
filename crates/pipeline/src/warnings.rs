//! What was put up with in the input, said to people: at the terminal as it is found, and in the report.

use crate::Observer;
use crate::geography;
use crate::params::{Format, Params};
use crate::stages::holes::Hole;
use crate::stages::split::Blocks;
use crate::stages::vectors;
use gable_blocks::SplitReport;
use gable_geometry::{Crs, DVec3};
use gable_scene::WarningKind;
use serde::{Deserialize, Serialize};

/// Places of a warning that are named.
const NAMED: usize = 5;

/// Something that is wrong in the input, and what became of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct InputWarning {
    /// What is wrong, in the singular.
    pub what: String,
    /// What was done about it.
    pub consequence: String,
    /// How often.
    pub count: u64,
    /// The first places: files, lines, coordinates.
    pub places: Vec<String>,
}

impl InputWarning {
    fn new(what: &str, consequence: &str, count: u64, places: Vec<String>) -> Self {
        Self { what: what.to_owned(), consequence: consequence.to_owned(), count, places }
    }

    /// How many places are not named.
    #[must_use]
    pub fn more(&self) -> u64 {
        if self.places.is_empty() { 0 } else { self.count.saturating_sub(self.places.len() as u64) }
    }

    /// One line, and a further one for each place.
    #[must_use]
    pub fn text(&self) -> String {
        let mut text = format!("{} × {}: {}", self.count, self.what, self.consequence);
        for place in &self.places {
            text += &format!("\n    {place}");
        }
        if self.more() > 0 {
            text += &format!("\n    and {} more", self.more());
        }
        text
    }
}

/// What stands beside a kind of warning: its name, and what becomes of it.
fn said(kind: WarningKind) -> (&'static str, &'static str) {
    match kind {
        WarningKind::MissingMaterialLibrary => ("missing material library (MTL)", "its materials are grey"),
        WarningKind::UnknownMaterial => ("face with an unknown material", "grey"),
        WarningKind::MissingTexture => ("missing texture", "what it covers is grey"),
        WarningKind::MissingTextureCoordinates => ("textured face without texture coordinates", "grey"),
        WarningKind::DegenerateFace => ("degenerate face (no area)", "left out"),
        WarningKind::IgnoredStatement => ("statement that is not understood", "passed over"),
        WarningKind::IgnoredFile => ("mesh file of another format", "passed over"),
        WarningKind::CoarserFile => ("mesh file of a place that another shows finer", "passed over"),
        WarningKind::OverlappingFiles => (
            "pair of mesh files that cover the same place",
            "both are read: give the better one alone if they are two models of it",
        ),
        WarningKind::EmptyFile => ("mesh file without triangles", "passed over"),
        WarningKind::CoarseCoordinates => (
            "coordinate axis that was rounded",
            "shapes are no finer than these steps: export with an origin near the mesh, or in double precision",
        ),
        WarningKind::ScaledUnits => ("reference system in feet", "the coordinates became metres"),
        WarningKind::UnusedGeoreference => (
            "file that tells where meshes lie, but of none that is read",
            "not used: say where they lie by --origin and --crs",
        ),
        WarningKind::BrokenVertex => {
            ("vertex that is no number", "faces that use it are left out: --strict refuses such a mesh")
        }
        WarningKind::BrokenFace => {
            ("face of a vertex that is broken, or is not there", "left out: --strict refuses such a mesh")
        }
        WarningKind::ZeroBytes => {
            ("file that ends in zero bytes", "read up to them: see whether it is a complete copy")
        }
        WarningKind::FoundElsewhere => (
            "file that the mesh names otherwise, or not at all",
            "taken from where one of its name lies: see whether it is the right one",
        ),
        WarningKind::DecimalComma => ("number with a comma in place of its point", "read as if it had a point"),
        WarningKind::BrokenFile => (
            "mesh file that is damaged, or cannot be read",
            "read up to the fault, so that its place is not whole: copy it again, or refuse such a mesh by --strict",
        ),
    }
}

/// What the reading and the split found.
pub(crate) fn of_split(report: &SplitReport) -> Vec<InputWarning> {
    let mut out = Vec::new();
    for warning in report.counts.warnings.entries() {
        let (what, consequence) = said(warning.kind);
        out.push(InputWarning::new(what, consequence, warning.count, warning.examples.clone()));
    }
    let defects = report.defects;
    let far = report.outliers;
    let mut add = |what: &str, consequence: &str, count: u64| {
        if count > 0 {
            out.push(InputWarning::new(what, consequence, count, Vec::new()));
        }
    };
    add("sliver (a face narrower than 0.1 mm)", "left out", defects.slivers);
    add("duplicate face", "left out but the first", defects.duplicates);
    add(
        "floating part (at most 5 m, clear of everything by 0.5 m)",
        &format!("left out, {} triangles in all", defects.floating_triangles),
        defects.floating_parts,
    );
    add(
        "part of the mesh far away from the city",
        &format!("left out, {} triangles, up to {:.0} m off", far.triangles, far.reach),
        far.parts,
    );
    add("triangle more than 262 km away", "left out", far.beyond_lattice);
    out
}

/// Textures that could not be decoded, with their reasons.
pub(crate) fn of_textures(failures: &[(std::path::PathBuf, String)]) -> Option<InputWarning> {
    let named = failures.iter().take(NAMED);
    // The reason mostly starts with the path.
    let places = named.map(|(path, why)| match why.starts_with(&*path.to_string_lossy()) {
        true => why.clone(),
        false => format!("{}: {why}", path.display()),
    });
    let warning =
        InputWarning::new("undecodable texture", "what it covers is grey", failures.len() as u64, places.collect());
    (!failures.is_empty()).then_some(warning)
}

/// What the mesh does not tell: its reference system, and the colours of what it shows.
pub(crate) fn of_scene(crs: &Crs, coloured: bool) -> Vec<InputWarning> {
    let mut out = Vec::new();
    if *crs == Crs::Unknown {
        let what = "mesh that does not tell its reference system";
        let consequence =
            "its coordinates are kept, and the result names no system: say which it is by --crs EPSG:code";
        out.push(InputWarning::new(what, consequence, 1, Vec::new()));
    }
    if !coloured {
        let what = "mesh without textures, or with few";
        let consequence = "ground, trees and buildings are told apart by geometry alone, which finds less";
        out.push(InputWarning::new(what, consequence, 1, Vec::new()));
    }
    out
}

/// What is odd about where the city lies on Earth, and what its heights were taken for in 3D Tiles.
pub(crate) fn of_place(blocks: &Blocks, params: &Params) -> Vec<InputWarning> {
    let crs = &blocks.frame().crs;
    let (low, high) = blocks.extent();
    let centre = DVec3::from_array(blocks.frame().origin) + (low + high) / 2.0;
    let mut out = Vec::new();
    let found = geography::judge(crs, centre);
    out.extend(found.map(|(what, consequence)| InputWarning::new(what, &consequence, 1, Vec::new())));
    if params.output.formats.iter().any(|format| matches!(format, Format::Tiles3d | Format::MeshTiles3d)) {
        let heights = geography::zero(crs, centre, params.geoid().ok().flatten());
        out.extend(heights.said.map(|said| InputWarning::new(said.0, &said.1, 1, Vec::new())));
    }
    if params.output.formats.contains(&Format::GeoJson) && vectors::projection(crs).is_none() {
        let what = "reference system without longitude and latitude";
        let consequence = "no GeoJSON is written, which has nothing else: say which system it is by --crs EPSG:code";
        out.push(InputWarning::new(what, consequence, 1, Vec::new()));
    }
    out
}

/// Holes, largest first; `origin` is that of the local frame.
pub(crate) fn of_holes(holes: &[Hole], origin: [f64; 3]) -> Option<InputWarning> {
    let area: f64 = holes.iter().map(|h| h.area).sum();
    let place = |hole: &Hole| {
        format!("{:.1} m² at {:.1} {:.1}", hole.area, hole.centre.x + origin[0], hole.centre.y + origin[1])
    };
    let warning = InputWarning::new(
        "hole in the mesh (over 1 m², seen from above)",
        &format!("{area:.0} m² in all have no surface"),
        holes.len() as u64,
        holes.iter().take(NAMED).map(place).collect(),
    );
    (!holes.is_empty()).then_some(warning)
}

/// Tells warnings to the observer and adds them to the list.
pub(crate) fn tell(
    observer: &dyn Observer,
    found: impl IntoIterator<Item = InputWarning>,
    list: &mut Vec<InputWarning>,
) {
    for warning in found {
        observer.warning(&warning.text());
        list.push(warning);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_mesh_does_not_tell_is_said() {
        let said = |crs: &Crs, coloured| of_scene(crs, coloured).iter().map(InputWarning::text).collect::<Vec<_>>();
        assert!(said(&Crs::Epsg(7415), true).is_empty());
        let all = said(&Crs::Unknown, false);
        assert_eq!(all.len(), 2, "{all:?}");
        assert!(all[0].contains("--crs EPSG:code") && all[1].contains("geometry alone"), "{all:?}");
        assert_eq!(said(&Crs::Epsg(7415), false), all[1..]);
    }

    #[test]
    fn some_places_are_named_and_the_rest_counted() {
        let some = InputWarning::new("missing texture", "grey", 7, vec!["a.jpg".to_owned(), "b.jpg".to_owned()]);
        assert_eq!(some.text(), "7 × missing texture: grey\n    a.jpg\n    b.jpg\n    and 5 more");
        assert_eq!(InputWarning::new("duplicate face", "left out", 3, vec![]).text(), "3 × duplicate face: left out");
    }
}
