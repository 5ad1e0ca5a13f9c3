//! The parameters that a job can set.

use crate::Caller;
use axum::Json;
use gable_pipeline::Params;
use gable_pipeline::params::{PARAMETERS, PRESETS};
use serde::Serialize;
use std::collections::BTreeMap;
use utoipa::ToSchema;

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
    let parameters = PARAMETERS.iter().filter(|p| p.group != "resources").map(|p| ParameterView {
        name: p.name,
        group: p.group,
        kind: p.kind,
        unit: p.unit,
        default: p.value(&defaults),
        min: p.bounds.map(|b| b.min),
        max: p.bounds.map(|b| b.max),
        choices: p.choices,
        help: p.help,
    });
    let presets =
        PRESETS.iter().map(|p| PresetView { name: p.name, help: p.help, values: p.values.iter().copied().collect() });
    Json(ParameterList { parameters: parameters.collect(), presets: presets.collect() })
}
