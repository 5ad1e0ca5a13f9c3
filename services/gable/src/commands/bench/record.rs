//! What is kept of one row of one scene.

use super::number;
use gable_evaluation::Evaluation;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// Time and memory of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct Cost {
    /// Wall-clock seconds.
    pub(crate) wall: f64,
    /// Seconds of all cores together.
    pub(crate) core: f64,
    /// Largest resident memory, bytes.
    pub(crate) peak_memory_bytes: u64,
}

/// A stage of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Stage {
    pub(crate) name: String,
    pub(crate) wall: f64,
    pub(crate) core: f64,
}

/// Time and memory of a run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Timing {
    pub(crate) stages: Vec<Stage>,
    /// All of it; core seconds are the sum of the stages'.
    pub(crate) whole: Cost,
    pub(crate) pixels: u64,
    pub(crate) threads: u64,
}

impl Timing {
    pub(crate) fn micros_per_pixel(&self) -> f64 {
        if self.pixels == 0 { 0.0 } else { self.whole.core * 1e6 / self.pixels as f64 }
    }
}

/// The figures of an evaluation that stand in the table; lengths in metres, shares in [0, 1].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Figures {
    pub(crate) label_mean_iou: f64,
    /// The same within 1 m of borders.
    pub(crate) border_mean_iou: f64,
    pub(crate) building_iou: f64,
    pub(crate) tree_iou: f64,
    /// Completeness and correctness by number, from 50 m² and from 10 m².
    pub(crate) found_50: [f64; 2],
    pub(crate) found_10: [f64; 2],
    /// Mean IoU of the footprints of connected blocks from 50 m².
    pub(crate) block_iou_50: f64,
    /// Mean IoU of the footprints of single buildings.
    pub(crate) building_footprint_iou: f64,
    /// Median over buildings from 50 m² of the RMSE of roof heights.
    pub(crate) roof_rmse_50: f64,
    /// The same within matched planes.
    pub(crate) plane_rmse_50: f64,
    /// Truth to model, RMS, found buildings from 50 m².
    pub(crate) truth_to_model_50: f64,
    /// Against truth, over connected blocks that have both.
    pub(crate) polygons: f64,
    pub(crate) roof_polygons: f64,
    pub(crate) triangles: f64,
    /// Share of valid solids at LOD2, missing ones counted as not valid.
    pub(crate) valid: f64,
}

/// What stands in the table: a row that was measured, or one that was not.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub(crate) enum Entry {
    Measured(Box<Record>),
    LeftOut(LeftOut),
}

impl Entry {
    /// Scene, row and variant.
    pub(crate) fn key(&self) -> (&str, &str, Option<&str>) {
        match self {
            Self::Measured(r) => (&r.scene, &r.row, r.variant.as_deref()),
            Self::LeftOut(l) => (&l.scene, &l.row, None),
        }
    }

    pub(crate) fn order(&self) -> [usize; 3] {
        match self {
            Self::Measured(r) => r.order,
            Self::LeftOut(l) => l.order,
        }
    }
}

/// A row of a scene that was left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct LeftOut {
    pub(crate) scene: String,
    pub(crate) row: String,
    pub(crate) order: [usize; 3],
    pub(crate) reason: String,
}

/// How a scene is sensed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sensing {
    /// Faces for each m² of ground.
    pub(crate) density: f64,
    /// Slope of the ground, metres per metre.
    pub(crate) slope: f64,
    pub(crate) texture: bool,
    /// Strength of the noise; 1 as on real meshes.
    pub(crate) noise: f64,
}

/// Whether blocks of other sizes give the same buildings.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Grids {
    /// Buildings that either run has.
    pub(crate) buildings: u64,
    /// Share with the same id in both, and footprints whose IoU is at least 0.98.
    pub(crate) same: f64,
}

/// One row of one scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Record {
    pub(crate) scene: String,
    pub(crate) row: String,
    /// What is other than in the scene itself.
    pub(crate) variant: Option<String>,
    /// Places of scene, row and variant in the table.
    pub(crate) order: [usize; 3],
    /// Where the buildings come from.
    pub(crate) source: String,
    pub(crate) seed: u64,
    pub(crate) sensing: Sensing,
    pub(crate) mesh_faces: u64,
    pub(crate) area_km2: f64,
    pub(crate) date: String,
    pub(crate) cores: usize,
    pub(crate) build: String,
    pub(crate) synth: Cost,
    pub(crate) run: Timing,
    pub(crate) eval_seconds: f64,
    pub(crate) figures: Figures,
    /// The same run on one thread, where asked for.
    pub(crate) one_thread: Option<Cost>,
    /// 1×1 blocks against 16×16, where asked for.
    pub(crate) grids: Option<Grids>,
}

/// From the JSON of `gable eval`.
pub(crate) fn figures(json: &Value) -> anyhow::Result<Figures> {
    let e: Evaluation = serde_json::from_value(json.clone())?;
    let labels = e.labels.as_ref().ok_or_else(|| anyhow::anyhow!("the evaluation has no labels"))?;
    let class = |name: &str| labels.all.classes.iter().find(|c| c.name == name).and_then(|c| c.iou).unwrap_or(0.0);
    let found = |from: f64| {
        let rates = e.objects.iter().find(|d| d.from_m2 == from).map(|d| d.per_object);
        rates.map_or([0.0; 2], |r| [r.completeness, r.correctness])
    };
    Ok(Figures {
        label_mean_iou: labels.all.mean_iou,
        border_mean_iou: labels.border.mean_iou,
        building_iou: class("building"),
        tree_iou: class("tree"),
        found_50: found(50.0),
        found_10: found(10.0),
        block_iou_50: e.footprints.blocks_from_50.mean_iou,
        building_footprint_iou: e.footprints.buildings.mean_iou,
        roof_rmse_50: e.roofs.height_rmse_median_from_50,
        plane_rmse_50: e.roofs.height_rmse_of_planes_median_from_50,
        truth_to_model_50: e.distances.truth_to_model_found_from_50.rms,
        polygons: e.complexity.against_truth.polygons,
        roof_polygons: e.complexity.against_truth.roof_polygons,
        triangles: e.complexity.against_truth.triangles,
        valid: e.validity.lod2,
    })
}

/// From the JSON of `gable run`.
pub(crate) fn timing(json: &Value) -> anyhow::Result<Timing> {
    let stages = json["stages"].as_array().cloned().unwrap_or_default();
    let stages: Vec<Stage> = stages
        .iter()
        .map(|s| {
            let name = s["stage"].as_str().unwrap_or_default().to_owned();
            Ok(Stage { name, wall: number(s, &["wall"])?, core: number(s, &["core"])? })
        })
        .collect::<anyhow::Result<_>>()?;
    let core = stages.iter().map(|s| s.core).sum();
    let peak_memory_bytes = json["peak_memory_bytes"].as_u64().unwrap_or(0);
    Ok(Timing {
        whole: Cost { wall: number(json, &["seconds"])?, core, peak_memory_bytes },
        pixels: json["pixels"].as_u64().unwrap_or(0),
        threads: json["threads"].as_u64().unwrap_or(0),
        stages,
    })
}
