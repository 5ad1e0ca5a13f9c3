//! From a scene to block files, in one streamed pass.

use crate::defects::{Defects, Inspection, inspect};
use crate::error::BlocksError;
use crate::extent::{Outliers, extent};
use crate::file::write_block;
use crate::grid::{BlockCore, BlockGrid, GridSpec, Reach};
use crate::spill::{Segment, Spill, SpillWriter};
use crate::triangle::{BlockMesh, BlockTriangle, UNITS_PER_METRE};
use gable_geometry::{Box2, DVec3, Frame, dvec2};
use gable_scene::{Content, Counts, Material, Scene, SceneError, Triangle};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};

/// Half the width of the coordinate lattice, metres: 2³¹ units.
const LATTICE: f64 = 262_144.0;

/// How a scene is to be split.
#[derive(Clone, Debug, PartialEq)]
pub struct SplitOptions {
    /// The grid.
    pub grid: GridSpec,
    /// Edge of a pixel, metres: block borders lie on its multiples.
    pub step: f64,
}

/// One block of a split.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct BlockEntry {
    /// The pixels that it is responsible for.
    pub core: BlockCore,
    /// Name of its file in the folder of the split.
    pub file: String,
    /// Triangles in it.
    pub triangles: u64,
    /// Bytes of its file.
    pub bytes: u64,
}

/// What a split gave.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SplitReport {
    /// The grid, with the local frame.
    pub grid: BlockGrid,
    /// The blocks, row by row from the south, also the empty ones.
    pub blocks: Vec<BlockEntry>,
    /// What the triangles' material indices refer to.
    pub materials: Vec<Material>,
    /// What was read, and what was put up with.
    pub counts: Counts,
    /// Lowest local coordinates of the triangles that were kept, metres.
    pub min: [f64; 3],
    /// Highest local coordinates of the triangles that were kept, metres.
    pub max: [f64; 3],
    /// Triangles that were left out because they lie far off.
    pub outliers: Outliers,
    /// What is wrong with the mesh itself, and was left out.
    pub defects: Defects,
    /// Bytes of the temporary file.
    pub spilled: u64,
}

/// Splits a scene into block files `{column}_{row}.block` in a folder, which is made if it is not there.
///
/// Slivers, duplicates and floating parts are left out ([`Defects`]), and what lies far off ([`Outliers`]). A triangle
/// goes to each block whose core its bounding box meets, in the order of the scene, its
/// corners rounded to the coordinate lattice (0.12 mm) of the local frame. That frame hangs on the
/// whole metre south-west of the scene, so neither corners nor order depend on the grid, and no byte
/// depends on the threads.
///
/// The scene is read once. Its triangles pass through a temporary file in the same folder (about 20
/// bytes each), which vanishes at the end, also when the program is killed. Memory: about 400 MB,
/// the scene's own, and one block for each thread. O(n log n) time.
///
/// # Errors
/// If the scene is bad, the grid cannot be made, or the folder cannot be written. Block files are
/// only written once the whole scene was read and found good.
pub fn split(scene: &Scene, folder: &Path, options: &SplitOptions) -> Result<SplitReport, BlocksError> {
    let fault = |e| BlocksError::write(folder, e);
    std::fs::create_dir_all(folder).map_err(fault)?;
    let mut intake = Intake { writer: SpillWriter::new(folder).map_err(fault)?, anchor: None, beyond: 0 };
    let Content { counts, materials } =
        scene.for_each_chunk(|chunk| chunk.iter().try_for_each(|triangle| intake.take(triangle)).map_err(fault))?;
    let Intake { writer, anchor, beyond } = intake;
    let spill = writer.finish().map_err(fault)?;
    let too_wide = || {
        let extent = DVec3::from_array(counts.max) - DVec3::from_array(counts.min);
        BlocksError::TooWide { extent: extent.x.max(extent.y), limit: LATTICE }
    };
    if 2 * beyond > counts.triangles {
        return Err(too_wide());
    }
    let (Some(anchor), Some(mut found)) = (anchor, extent(&spill.segments)) else {
        let path = scene.files().first().map_or_else(PathBuf::new, Clone::clone);
        return Err(SceneError::NoTriangles { path }.into());
    };
    found.outliers.beyond_lattice = beyond;

    let metres = |corner: [i32; 3]| DVec3::from_array(corner.map(f64::from)) / UNITS_PER_METRE;
    let frame = Frame::near(anchor + metres(found.min), scene.crs().clone());
    // Both are whole metres, so the shift is a whole number of lattice units.
    let shift = (anchor - DVec3::from_array(frame.origin)).to_array().map(|metres| (metres * UNITS_PER_METRE) as i64);
    let local = |corner: [i32; 3]| shifted(corner, shift).ok_or_else(too_wide);
    let (min, max) = (metres(local(found.min)?), metres(local(found.max)?));
    let bounds = Box2 { min: dvec2(min.x, min.y), max: dvec2(max.x, max.y) };
    let segments: Vec<Segment> =
        spill.segments.iter().zip(&found.kept).filter(|(_, kept)| **kept).map(|(segment, _)| *segment).collect();
    let kept = segments.iter().map(|segment| u64::from(segment.count)).sum();
    let grid = BlockGrid::new(frame, bounds, kept, options.step, options.grid)?;

    let cores: Vec<BlockCore> = grid.cores().collect();
    let inspection = inspect(&spill, &segments).map_err(fault)?;
    let blocks: Result<Vec<BlockEntry>, BlocksError> = cores
        .par_iter()
        .map(|core| {
            let mesh = gather(&spill, &segments, &inspection, core, options.step, shift).map_err(fault)?;
            let file = core.file_name();
            let bytes = write_block(&folder.join(&file), &mesh)?;
            Ok(BlockEntry { core: *core, file, triangles: mesh.triangles.len() as u64, bytes })
        })
        .collect();
    Ok(SplitReport {
        grid,
        blocks: blocks?,
        materials,
        counts,
        min: min.to_array(),
        max: max.to_array(),
        outliers: found.outliers,
        defects: inspection.defects,
        spilled: spill.length,
    })
}

/// Where the scene's triangles come in.
struct Intake {
    writer: SpillWriter,
    /// World coordinates of the spill's lattice origin: the whole metre below the first vertex, z 0.
    anchor: Option<DVec3>,
    /// Triangles beyond the lattice.
    beyond: u64,
}

impl Intake {
    fn take(&mut self, triangle: &Triangle) -> io::Result<()> {
        let first = triangle.corners[0];
        let anchor = *self.anchor.get_or_insert_with(|| DVec3::new(first.x.floor(), first.y.floor(), 0.0));
        let mut corners = [[0; 3]; 3];
        for (corner, world) in corners.iter_mut().zip(triangle.corners) {
            let local = world - anchor;
            // Half a metre is kept free for rounding.
            if local.abs().max_element() > LATTICE - 0.5 {
                self.beyond += 1;
                return Ok(());
            }
            // Rounded half up, the same way on both sides of the origin.
            *corner = (local * UNITS_PER_METRE + 0.5).floor().to_array().map(|c| c as i32);
        }
        self.writer.push(BlockTriangle {
            corners,
            uv: triangle.uv.unwrap_or_default(),
            material: triangle.material,
            colours: triangle.colours.map_or([[0; 4]; 3], |colours| colours.map(|[r, g, b]| [r, g, b, 255])),
        })
    }
}

/// The triangles that meet a core, in the order of the scene, in the local frame.
fn gather(
    spill: &Spill,
    segments: &[Segment],
    inspection: &Inspection,
    core: &BlockCore,
    step: f64,
    shift: [i64; 3],
) -> io::Result<BlockMesh> {
    let reach = Reach::of(core, step);
    let meets = |min: [i32; 3], max: [i32; 3]| match (shifted(min, shift), shifted(max, shift)) {
        (Some(min), Some(max)) => reach.meets(min, max),
        _ => false,
    };
    let mut found: Vec<(u64, BlockTriangle)> = Vec::new();
    for segment in segments.iter().filter(|s| meets(s.min, s.max)) {
        for (place, mut triangle) in spill.read(segment)? {
            let (min, max) = triangle.bounds();
            if meets(min, max) && !inspection.leaves_out(place) {
                triangle.corners = triangle.corners.map(|c| shifted(c, shift).unwrap_or(c));
                found.push((place, triangle));
            }
        }
    }
    found.sort_unstable_by_key(|(place, _)| *place);
    Ok(BlockMesh { triangles: found.into_iter().map(|(_, triangle)| triangle).collect() })
}

/// A corner moved on the lattice; `None` beyond its end.
fn shifted(corner: [i32; 3], shift: [i64; 3]) -> Option<[i32; 3]> {
    let axis = |i: usize| i32::try_from(i64::from(corner[i]) + shift[i]).ok();
    Some([axis(0)?, axis(1)?, axis(2)?])
}
