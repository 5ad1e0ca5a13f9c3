//! `gable schedule`: jobs by the clock, of a service on another machine.

use super::jobs::{settings, text};
use crate::cli::{CreateArgs, ListArgs, NameArgs, ScheduleAction, ScheduleArgs};
use crate::exit::Outcome;
use crate::remote::Remote;
use crate::{table, terminal};
use gable_coordinator::escaped;
use serde_json::{Value, json};

/// Runs that are shown.
const SHOWN: usize = 10;

/// Does what was asked for.
pub(crate) fn run(args: &ScheduleArgs) -> anyhow::Result<Outcome> {
    match &args.action {
        ScheduleAction::Create(args) => create(args)?,
        ScheduleAction::List(args) => list(args)?,
        ScheduleAction::Show(args) => show(args)?,
        ScheduleAction::Run(args) => {
            let run = Remote::new(&args.remote)?.post(&format!("{}/run", place(&args.name)), &[], None)?;
            tell(&run, args.json, &text(&run["job"]));
        }
        ScheduleAction::Delete(args) => {
            Remote::new(&args.remote)?.delete(&place(&args.name))?;
            tell(&json!({ "deleted": args.name }), args.json, &format!("{} is removed", args.name));
        }
    }
    Ok(Outcome::Success)
}

fn place(name: &str) -> String {
    format!("/schedules/{}", escaped(name))
}

fn tell(answer: &Value, json: bool, line: &str) {
    if json {
        terminal::json(answer);
    } else {
        terminal::stdout(line);
    }
}

fn create(args: &CreateArgs) -> anyhow::Result<()> {
    let mut job = json!({ "source": args.source, "city": args.city, "parameters": settings(&args.settings)? });
    if let Some(preset) = &args.preset {
        job["preset"] = preset.as_str().into();
    }
    let body = json!({
        "cron": args.cron, "zone": args.zone, "missed": args.missed, "enabled": !args.disabled, "job": job,
    });
    let made = Remote::new(&args.remote)?.put(&place(&args.name), &body)?;
    let next = made["next"][0].as_str().map_or_else(|| "does not tick".to_owned(), |n| format!("ticks next at {n}"));
    tell(&made, args.json, &format!("{} {next}", args.name));
    Ok(())
}

fn list(args: &ListArgs) -> anyhow::Result<()> {
    let all = Remote::new(&args.remote)?.get("/schedules?limit=1000")?;
    let mut rows = vec![["name", "city", "cron", "zone", "next", "runs", "last job"].map(str::to_owned).to_vec()];
    for one in all.as_array().into_iter().flatten() {
        let row = [
            &one["name"],
            &one["job"]["city"],
            &one["cron"],
            &one["zone"],
            &one["next"][0],
            &one["runs"],
            &one["last_job"],
        ];
        rows.push(row.map(text).to_vec());
    }
    tell(&all, args.json, &table::render(&rows));
    Ok(())
}

fn show(args: &NameArgs) -> anyhow::Result<()> {
    let remote = Remote::new(&args.remote)?;
    let mut shown = remote.get(&place(&args.name))?;
    let runs = remote.get(&format!("{}/runs?limit={SHOWN}", place(&args.name)))?;
    let mut lines = String::new();
    for member in ["name", "owner", "cron", "zone", "missed", "enabled"] {
        lines += &format!("{member:<10}{}\n", text(&shown[member]));
    }
    for next in shown["next"].as_array().into_iter().flatten() {
        lines += &format!("{:<10}{}\n", "next", text(next));
    }
    let columns = ["number", "due", "at", "outcome", "job"];
    let mut rows = vec![columns.map(str::to_owned).to_vec()];
    for run in runs.as_array().into_iter().flatten() {
        rows.push(columns.map(|member| text(&run[member])).to_vec());
    }
    shown["last_runs"] = runs;
    tell(&shown, args.json, &format!("{lines}\n{}", table::render(&rows)));
    Ok(())
}
