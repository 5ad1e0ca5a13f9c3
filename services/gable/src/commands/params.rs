//! `gable params`: every parameter with unit, default and range.

use crate::cli::ParamsArgs;
use crate::exit::Outcome;
use crate::{table, terminal};
use gable_pipeline::Params;
use gable_pipeline::params::{GROUPS, PRESETS, Parameter, parameters};
use serde_json::json;

/// Lists the parameters.
pub(crate) fn run(args: &ParamsArgs) -> anyhow::Result<Outcome> {
    if args.markdown {
        terminal::stdout(&page());
        return Ok(Outcome::Success);
    }
    let params = super::assemble(&args.params)?;
    let defaults = Params::default();
    let filter = args.filter.as_deref().unwrap_or_default();
    let listed: Vec<_> = parameters().iter().filter(|p| p.name.contains(filter)).collect();
    if args.json {
        let presets: Vec<_> = PRESETS
            .iter()
            .map(|p| json!({ "name": p.name, "help": p.help, "values": p.values.iter().copied().collect::<std::collections::BTreeMap<_, _>>() }))
            .collect();
        let list: Vec<_> = listed.iter().map(|p| row(p, &params, &defaults)).collect();
        terminal::json(&json!({ "parameters": list, "presets": presets }));
    } else {
        terminal::stdout(&text(&listed, &params, &defaults));
    }
    Ok(Outcome::Success)
}

/// One parameter as JSON.
fn row(p: &Parameter, params: &Params, defaults: &Params) -> serde_json::Value {
    json!({
        "name": p.name,
        "group": p.group,
        "kind": p.kind,
        "unit": p.unit,
        "default": p.value(defaults),
        "value": p.value(params),
        "min": p.bounds.map(|b| b.min),
        "max": p.bounds.map(|b| b.max),
        "choices": p.choices,
        "methods": p.methods,
        "expert": p.is_expert,
        "help": p.help,
    })
}

/// The list as text: one table for each group.
fn text(listed: &[&Parameter], params: &Params, defaults: &Params) -> String {
    let mut text = String::new();
    for (group, help) in GROUPS {
        let members: Vec<_> = listed.iter().filter(|p| p.group == *group).collect();
        if members.is_empty() {
            continue;
        }
        text += &format!("[{group}] {help}\n\n");
        let mut rows = vec![["name", "value", "unit", "range", "help"].map(str::to_owned).to_vec()];
        for p in members {
            let changed = p.value(params) != p.value(defaults);
            let mark = if changed { format!(" (default {})", p.value(defaults)) } else { String::new() };
            let value = Some(p.value(params)).filter(|v| !v.is_empty()).unwrap_or_else(|| "-".to_owned());
            let only = match p.methods.as_slice() {
                [method] => format!(" Of the method {method} only."),
                _ => String::new(),
            };
            rows.push(vec![p.name.clone(), value + &mark, p.unit.to_owned(), p.range(), p.help.to_owned() + &only]);
        }
        text += &table::render(&rows);
        text.push('\n');
    }
    text += "Presets:\n";
    for preset in PRESETS {
        text += &format!("  {:8}  {}\n", preset.name, preset.help);
    }
    text
}

/// The list as a page: one table for each group.
fn page() -> String {
    let mut page =
        "# Parameters\n\nMade by `gable params --markdown`; `docs/configuration.md` tells how values come together.\n"
            .to_owned();
    for (group, help) in GROUPS {
        page += &format!("\n## {group}\n\n{help}\n\n| Name | Default | Unit | Range | Help |\n|---|---|---|---|---|\n");
        for p in parameters().iter().filter(|p| p.group == *group) {
            let range = match p.choices.as_slice() {
                [] => p.range(),
                choices => choices.join(", "),
            };
            let cells = [format!("`{}`", p.name), default(p), p.unit.to_owned(), range, p.help.to_owned() + &owners(p)];
            page += &format!("| {} |\n", cells.join(" | "));
        }
    }
    page += "\n## Presets\n\n| Name | Help | Values |\n|---|---|---|\n";
    for preset in PRESETS {
        let values: Vec<String> = preset.values.iter().map(|(name, value)| format!("`{name}={value}`")).collect();
        page += &format!("| `{}` | {} | {} |\n", preset.name, preset.help, values.join(", "));
    }
    page
}

/// The default, or those of the methods where they differ.
fn default(p: &Parameter) -> String {
    let defaults = p.defaults();
    if defaults.iter().all(|default| *default == defaults[0]) {
        return defaults[0].clone();
    }
    let each = p.methods.iter().zip(&defaults).map(|(method, default)| format!("{default} ({method})"));
    each.collect::<Vec<_>>().join(", ")
}

/// Whose parameter it is, where it is not the stage's own.
fn owners(p: &Parameter) -> String {
    if p.methods.is_empty() { String::new() } else { format!(" Of {}.", p.methods.join(", ")) }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_page_of_parameters_is_the_list() {
        let written = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/parameters.md"));
        let advice = "write it anew: gable params --markdown > docs/parameters.md";
        assert!(written.expect("docs/parameters.md") == super::page(), "{advice}");
    }
}
