//! `gable city` and `gable audit`: whose a city is, its generations, and who did what.

use super::jobs::text;
use crate::cli::{AuditArgs, CityAction, CityArgs, OneCityArgs, UploadAction, UploadArgs};
use crate::exit::Outcome;
use crate::remote::Remote;
use crate::{table, terminal};
use gable_coordinator::escaped;
use serde_json::{Value, json};

/// Generations that are shown.
const SHOWN: usize = 10;

/// Does what was asked for.
pub(crate) fn run(args: &CityArgs) -> anyhow::Result<Outcome> {
    match &args.action {
        CityAction::List(at) => {
            let page = Remote::new(&at.remote)?.get("/cities?limit=1000")?;
            tell(&page["cities"], args.json, &["name", "generation", "created"]);
        }
        CityAction::Show(of) => show(of, args.json)?,
        CityAction::Members(of) => members(&Remote::new(&of.remote)?.get(&place(of, "/members"))?, args.json),
        CityAction::Share { of, member, role } => {
            let path = place(of, &format!("/members/{}", escaped(member)));
            members(&Remote::new(&of.remote)?.put(&path, &json!({ "role": role }))?, args.json);
        }
        CityAction::Unshare { of, member } => {
            Remote::new(&of.remote)?.delete(&place(of, &format!("/members/{}", escaped(member))))?;
            say(&json!({ "removed": member }), args.json, &format!("{member} is no member of {} any more", of.city));
        }
        CityAction::DeleteGeneration { of, generation } => {
            Remote::new(&of.remote)?.delete(&place(of, &format!("/generations/{generation}")))?;
            let line = format!("generation {generation} of {} is gone", of.city);
            say(&json!({ "deleted": generation }), args.json, &line);
        }
        CityAction::Delete { of, confirm } => {
            Remote::new(&of.remote)?.delete(&place(of, &format!("?confirm={}", escaped(confirm))))?;
            say(&json!({ "deleted": of.city }), args.json, &format!("{} is gone", of.city));
        }
        CityAction::RollBack { of, generation } => {
            let body = json!({ "generation": generation });
            let made = Remote::new(&of.remote)?.post(&place(of, "/roll-back"), &[], Some(&body))?;
            let line = format!("generation {} of {} is what {generation} was", text(&made["number"]), of.city);
            say(&made, args.json, &line);
        }
    }
    Ok(Outcome::Success)
}

/// Lists or deletes meshes that were sent.
pub(crate) fn upload(args: &UploadArgs) -> anyhow::Result<Outcome> {
    match &args.action {
        UploadAction::List(at) => {
            let all = Remote::new(&at.remote)?.get("/uploads")?;
            tell(&all, args.json, &["id", "name", "city", "owner", "bytes", "files", "created"]);
        }
        UploadAction::Delete { id, at } => {
            Remote::new(&at.remote)?.delete(&format!("/uploads/{}", escaped(id)))?;
            say(&json!({ "deleted": id }), args.json, &format!("upload {id} is gone"));
        }
    }
    Ok(Outcome::Success)
}

/// Shows who did what.
pub(crate) fn audit(args: &AuditArgs) -> anyhow::Result<Outcome> {
    let mut path = format!("/audit?limit={}", args.limit);
    for (name, value) in [("who", &args.who), ("city", &args.city), ("before", &args.before)] {
        if let Some(value) = value {
            path += &format!("&{name}={}", escaped(value));
        }
    }
    let page = Remote::new(&args.remote)?.get(&path)?;
    let columns = ["at", "who", "address", "action", "target", "status", "city", "times", "id"];
    tell(&page["entries"], args.json, &columns);
    Ok(Outcome::Success)
}

fn place(of: &OneCityArgs, below: &str) -> String {
    format!("/cities/{}{below}", escaped(&of.city))
}

fn show(of: &OneCityArgs, json: bool) -> anyhow::Result<()> {
    let remote = Remote::new(&of.remote)?;
    let mut city = remote.get(&place(of, ""))?;
    let generations = remote.get(&place(of, &format!("/generations?limit={SHOWN}")))?;
    city["generations"] = generations["generations"].clone();
    if json {
        terminal::json(&city);
        return Ok(());
    }
    let columns = ["number", "made", "buildings", "added", "removed", "changed", "restored", "job"];
    terminal::stdout(&format!("{} {}\n", text(&city["name"]), text(&city["generation"])));
    tell(&city["generations"], false, &columns);
    Ok(())
}

fn members(list: &Value, json: bool) {
    tell(list, json, &["name", "role"]);
}

/// A list as JSON or as a table.
fn tell<const N: usize>(list: &Value, json: bool, columns: &[&str; N]) {
    if json {
        terminal::json(list);
        return;
    }
    let mut rows = vec![columns.map(str::to_owned).to_vec()];
    for one in list.as_array().into_iter().flatten() {
        rows.push(columns.map(|member| text(&one[member])).to_vec());
    }
    terminal::stdout(&table::render(&rows));
}

fn say(answer: &Value, json: bool, line: &str) {
    if json {
        terminal::json(answer);
    } else {
        terminal::stdout(line);
    }
}
