//! The parameters that a job can set.

use crate::Caller;
use axum::Json;
use gable_pipeline::Params;
use gable_pipeline::params::{Format, PRESETS, parameters};
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::ToSchema;

/// The format that every job writes besides those that are asked for: what the dashboard's viewer shows.
pub const FOR_THE_VIEWER: Format = Format::Tiles3d;

/// The parameter that lists the formats.
const FORMATS: &str = "output.formats";

/// A parameter.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ParameterView {
    #[schema(example = "sampling.step")]
    name: &'static str,
    group: &'static str,
    /// number, integer, switch, choice, list, text or file.
    kind: &'static str,
    unit: &'static str,
    default: String,
    #[serde(skip_serializing_if = "Option::is_none")]
    min: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max: Option<f64>,
    choices: &'static [&'static str],
    /// The methods of the stage that have it; empty if the stage itself does.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    methods: &'static [&'static str],
    /// Whether few users need it.
    expert: bool,
    /// Choices that every job takes, whatever is asked for: the dashboard's viewer shows 3D Tiles.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    always: Vec<&'static str>,
    help: &'static str,
}

/// A named set of values.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct PresetView {
    name: &'static str,
    help: &'static str,
    values: BTreeMap<&'static str, &'static str>,
}

/// All of both.
#[derive(Clone, Debug, Serialize, ToSchema)]
pub(crate) struct ParameterList {
    parameters: Vec<ParameterView>,
    presets: Vec<PresetView>,
}

/// Every parameter of a job, with unit, default and range, and the presets
#[utoipa::path(
    get, path = "/parameters", tag = "jobs",
    responses(
        (status = 200, description = "The list", body = ParameterList),
    )
)]
pub(crate) async fn list(_: Caller) -> Json<ParameterList> {
    let defaults = Params::default();
    // How many threads and how much memory is for the workers to say.
    let all = parameters().iter().filter(|p| p.group != "resources").map(|p| ParameterView {
        name: &p.name,
        group: p.group,
        kind: p.kind,
        unit: p.unit,
        default: p.value(&defaults),
        min: p.bounds.map(|b| b.min),
        max: p.bounds.map(|b| b.max),
        choices: &p.choices,
        methods: &p.methods,
        expert: p.is_expert,
        always: if p.name == FORMATS { vec![FOR_THE_VIEWER.name()] } else { Vec::new() },
        help: p.help,
    });
    let presets =
        PRESETS.iter().map(|p| PresetView { name: p.name, help: p.help, values: p.values.iter().copied().collect() });
    Json(ParameterList { parameters: all.collect(), presets: presets.collect() })
}
