//! 3D Tiles (OGC, versions 1.0 and 1.1) as a mesh: the tiles of the finest level, or of one that is fine enough.
//!
//! Tiles that lie on the Earth end in a plane that touches it: see `earth.rs`.

use crate::budget;
use crate::counts::{WarningKind, Warnings};
use crate::earth;
use crate::error::SceneError;
use crate::transform::Transform;
use crate::uri::{self, Target};
use gable_files::Reach;
use gable_geometry::{Crs, DVec3};
use serde::Deserialize;
use std::path::{Path, PathBuf};

/// Tilesets that name each other, one within the other.
const DEPTH: usize = 32;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Tileset {
    #[serde(default)]
    asset: Asset,
    root: Tile,
}

#[derive(Default, Deserialize)]
#[serde(rename_all = "camelCase")]
struct Asset {
    /// Before version 1.0 of the standard: the axis of the models that points up.
    gltf_up_axis: Option<String>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Tile {
    transform: Option<[f64; 16]>,
    #[serde(default)]
    bounding_volume: Volume,
    #[serde(default)]
    geometric_error: f64,
    refine: Option<String>,
    content: Option<Content>,
    #[serde(default)]
    contents: Vec<Content>,
    #[serde(default)]
    children: Vec<Tile>,
    implicit_tiling: Option<serde_json::Value>,
}

#[derive(Default, Deserialize)]
struct Volume {
    #[serde(rename = "box")]
    cuboid: Option<Vec<f64>>,
    region: Option<Vec<f64>>,
    sphere: Option<Vec<f64>>,
}

#[derive(Deserialize)]
struct Content {
    uri: Option<String>,
    /// Before version 1.0 of the standard.
    url: Option<String>,
}

impl Volume {
    /// A point in it, and whether it is earth-centred whatever stands above it.
    fn middle(&self) -> Option<(DVec3, bool)> {
        if let Some(&[west, south, east, north, low, high]) = self.region.as_deref() {
            return Some((earth::point((south + north) / 2.0, (west + east) / 2.0, (low + high) / 2.0), true));
        }
        match self.cuboid.as_deref().or(self.sphere.as_deref()) {
            Some(&[x, y, z, ..]) => Some((DVec3::new(x, y, z), false)),
            _ => None,
        }
    }
}

/// A model of a tileset.
#[derive(Clone, Debug)]
pub(crate) struct Model {
    pub(crate) file: PathBuf,
    /// From the frame of the tile to that of the root.
    pub(crate) transform: Transform,
    /// Whether the model's z points up, not its y.
    pub(crate) z_up: bool,
}

/// What tilesets hold.
#[derive(Debug, Default)]
pub(crate) struct Models {
    pub(crate) models: Vec<Model>,
    /// The files that say so.
    pub(crate) files: Vec<PathBuf>,
    /// A point of the first root.
    middle: Option<DVec3>,
}

impl Models {
    /// Reads tilesets, down to tiles whose error is at most `error` metres.
    pub(crate) fn read(
        tilesets: &[PathBuf],
        reach: &Reach,
        error: f64,
        strict: bool,
        warnings: &mut Warnings,
    ) -> Result<Self, SceneError> {
        let mut walk = Walk { reach, error, strict, left: budget::JSON_OBJECTS, found: Self::default(), warnings };
        for path in tilesets {
            walk.tileset(path, &Transform::IDENTITY, 0)?;
        }
        let found = walk.found;
        match tilesets.first() {
            Some(path) if found.models.is_empty() => Err(SceneError::NoTriangles { path: path.clone() }),
            _ => Ok(found),
        }
    }

    /// The plane in which tiles on the Earth end, and the way there; none for tiles in a frame of their own.
    pub(crate) fn plane(&self, given: Option<&Crs>, path: &Path) -> Result<Option<(Crs, Transform)>, SceneError> {
        let Some(middle) = self.middle.filter(|middle| earth::is_on_earth(*middle)) else { return Ok(None) };
        let crs = match given {
            None => earth::plane_near(middle),
            Some(plane @ Crs::Enu { .. }) => plane.clone(),
            Some(other) => {
                let near = earth::plane_near(middle);
                let what = format!(
                    "its tiles lie on the Earth, and end in a local plane, not in {other}: leave --crs out, or say where \
                     the plane is to touch the Earth, such as --crs {near}"
                );
                return Err(SceneError::UnfitCrs { path: path.to_owned(), what });
            }
        };
        let Crs::Enu { latitude, longitude, height } = crs else { return Ok(None) };
        Ok(Some((crs, earth::to_plane(latitude, longitude, height))))
    }
}

struct Walk<'a> {
    reach: &'a Reach,
    error: f64,
    strict: bool,
    /// How many more tiles are looked at.
    left: usize,
    found: Models,
    warnings: &'a mut Warnings,
}

impl Walk<'_> {
    fn tileset(&mut self, path: &Path, above: &Transform, depth: usize) -> Result<(), SceneError> {
        let unsupported = |what: String| SceneError::Unsupported { path: path.to_owned(), what };
        if depth > DEPTH {
            return Err(SceneError::too_much(path, format!("more than {DEPTH} tilesets name each other in a row")));
        }
        let bytes = self.reach.read(path, budget::JSON)?;
        let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(&bytes);
        let tileset: Tileset = serde_json::from_slice(text)
            .map_err(|e| unsupported(format!("this is no tileset of 3D Tiles that can be read: {e}")))?;
        let z_up = match tileset.asset.gltf_up_axis.as_deref() {
            None | Some("Y" | "y") => false,
            Some("Z" | "z") => true,
            Some(other) => return Err(unsupported(format!("its models have {other} up: export them with y up"))),
        };
        self.found.files.push(path.to_owned());
        if self.found.middle.is_none() {
            let root = placed(above, &tileset.root);
            let middle = tileset.root.bounding_volume.middle();
            self.found.middle = middle.map(|(point, on_earth)| if on_earth { point } else { root.apply(point) });
        }
        self.tile(&tileset.root, above, false, path, z_up, depth)
    }

    fn tile(
        &mut self,
        tile: &Tile,
        above: &Transform,
        added: bool,
        path: &Path,
        z_up: bool,
        depth: usize,
    ) -> Result<(), SceneError> {
        self.left = self.left.checked_sub(1).ok_or_else(|| {
            SceneError::too_much(path, format!("the tilesets have more than {} tiles", budget::JSON_OBJECTS))
        })?;
        if tile.implicit_tiling.is_some() {
            let what = "its tiles are implicit (in subtree files), which is not read: export it with explicit tiles";
            return Err(SceneError::Unsupported { path: path.to_owned(), what: what.to_owned() });
        }
        let transform = placed(above, tile);
        // How a tile is refined goes on to those below.
        let added = tile.refine.as_ref().map_or(added, |refine| refine.eq_ignore_ascii_case("add"));
        let deeper = !tile.children.is_empty() && (self.error == 0.0 || tile.geometric_error > self.error);
        for content in tile.content.iter().chain(&tile.contents) {
            let Some(text) = content.uri.as_ref().or(content.url.as_ref()) else { continue };
            let result = self.content(text, &transform, !deeper || added, path, z_up, depth);
            match result {
                Err(fault) if !self.strict && (fault.is_damage() || matches!(fault, SceneError::NotFound { .. })) => {
                    self.warnings.add(WarningKind::BrokenFile, || fault.to_string());
                }
                other => other?,
            }
        }
        if deeper {
            tile.children.iter().try_for_each(|child| self.tile(child, &transform, added, path, z_up, depth))?;
        }
        Ok(())
    }

    /// A model, if it is to be shown, or another tileset.
    fn content(
        &mut self,
        text: &str,
        transform: &Transform,
        shown: bool,
        path: &Path,
        z_up: bool,
        depth: usize,
    ) -> Result<(), SceneError> {
        let folder = path.parent().unwrap_or(Path::new(""));
        let plain = text.split(['?', '#']).next().unwrap_or(text);
        let what = |what: String| SceneError::Unsupported { path: path.to_owned(), what };
        let file = match uri::resolve(folder, plain).map_err(what)? {
            Target::File(file) => file,
            Target::Bytes(_) => {
                return Err(what("a tile is written into it as a data URI: write it beside".to_owned()));
            }
        };
        if file.extension().is_some_and(|end| end.eq_ignore_ascii_case("json")) {
            return self.tileset(&file, transform, depth + 1);
        }
        if shown {
            self.reach.length(&file)?;
            self.found.models.push(Model { file, transform: *transform, z_up });
        }
        Ok(())
    }
}

/// The frame of a tile in that of the root.
fn placed(above: &Transform, tile: &Tile) -> Transform {
    let Some(m) = &tile.transform else { return *above };
    above.then(&[0, 1, 2, 3].map(|i| [m[4 * i], m[4 * i + 1], m[4 * i + 2], m[4 * i + 3]]))
}
