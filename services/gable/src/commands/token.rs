//! `gable token`: who may use the service.

use crate::cli::{NewTokenArgs, TokenAction, TokenArgs};
use crate::exit::{Outcome, UsageError};
use crate::{service, table, terminal};
use gable_coordinator::{NewToken, PERSON, create_token, rotate_token};
use gable_job_store::Store;
use std::time::{Duration, SystemTime};

/// Longest name of a token, bytes.
const LONGEST: usize = 200;

/// Makes, lists or revokes.
pub(crate) fn run(args: &TokenArgs) -> anyhow::Result<Outcome> {
    service::block_on(async {
        let store = service::open_database(&args.at).await?;
        match &args.action {
            TokenAction::Create(new) => create(&store, new, args.json).await,
            TokenAction::List => list(&store, args.json).await,
            TokenAction::Rotate { name, grace } => rotate(&store, name, *grace, args.json).await,
            TokenAction::Revoke { name } => match store.remove_token(name).await? {
                true => Ok(()),
                false => Err(none(name)),
            },
        }
    })?;
    Ok(Outcome::Success)
}

async fn create(store: &Store, args: &NewTokenArgs, json: bool) -> anyhow::Result<()> {
    let name = args.name.trim();
    if !gable_coordinator::is_name(name) {
        let text = "the name has to have 1 to 200 bytes, without control characters and marks that are not seen, and not to be . or ..";
        return Err(UsageError(text.to_owned()).into());
    }
    for (start, what) in [("group:", "a group"), (PERSON, "somebody who has signed in")] {
        if name.starts_with(start) {
            return Err(UsageError(format!("{name:?} is how members of cities name {what}: take another name")).into());
        }
    }
    for group in &args.groups {
        let plain = |c: char| c.is_alphanumeric() || "._-".contains(c);
        if group.is_empty() || group.len() > LONGEST || !group.chars().all(plain) {
            return Err(UsageError(format!("--group {group:?}: a group has letters, digits, and . _ -")).into());
        }
    }
    let expires = args.days.map(end).transpose()?;
    let new = NewToken {
        name: name.to_owned(),
        scope: args.scope,
        groups: args.groups.clone(),
        max_jobs: args.max_jobs,
        expires,
    };
    let token = create_token(store, &new).await?.ok_or_else(|| {
        UsageError(format!("there is a token {name:?} already: rotate or revoke it, or take another name"))
    })?;
    tell(&token, json.then(|| serde_json::json!({ "name": name, "scope": args.scope, "token": token })));
    Ok(())
}

async fn rotate(store: &Store, name: &str, grace: f64, json: bool) -> anyhow::Result<()> {
    let wrong = || UsageError(format!("--grace {grace}: give a number of hours, 0 or above"));
    let grace = Duration::try_from_secs_f64(grace * 3600.0).map_err(|_| wrong())?;
    let token = rotate_token(store, name, grace).await?.ok_or_else(|| none(name))?;
    tell(&token, json.then(|| serde_json::json!({ "name": name, "token": token })));
    Ok(())
}

fn tell(token: &str, json: Option<serde_json::Value>) {
    match json {
        Some(answer) => terminal::json(&answer),
        None => {
            terminal::stdout(token);
            terminal::stderr_line("keep it: it is not shown again");
        }
    }
}

fn none(name: &str) -> anyhow::Error {
    UsageError(format!("there is no token {name:?}: gable token list has all")).into()
}

/// The time after so many days, milliseconds since 1970.
fn end(days: f64) -> Result<i64, UsageError> {
    let wrong = || UsageError(format!("--days {days}: give a number above 0"));
    let span = Duration::try_from_secs_f64(days * 86_400.0).ok().filter(|s| !s.is_zero()).ok_or_else(wrong)?;
    let end = SystemTime::now().checked_add(span).and_then(|t| t.duration_since(SystemTime::UNIX_EPOCH).ok());
    end.and_then(|t| i64::try_from(t.as_millis()).ok()).ok_or_else(wrong)
}

async fn list(store: &Store, json: bool) -> anyhow::Result<()> {
    let tokens = store.tokens().await?;
    let time = gable_coordinator::time;
    if json {
        let list: Vec<_> = tokens
            .iter()
            .map(|t| {
                serde_json::json!({ "name": t.name, "scope": t.scope, "groups": t.groups, "max_jobs": t.max_jobs,
                    "created": time(t.created), "expires": t.expires.map(time) })
            })
            .collect();
        terminal::json(&list);
        return Ok(());
    }
    let mut rows = vec![["name", "scope", "groups", "max jobs", "created", "expires"].map(str::to_owned).to_vec()];
    rows.extend(tokens.into_iter().map(|t| {
        let most = t.max_jobs.map_or_else(|| "-".to_owned(), |n| n.to_string());
        let expires = t.expires.map_or_else(|| "-".to_owned(), time);
        vec![t.name, t.scope.name().to_owned(), t.groups.join(", "), most, time(t.created), expires]
    }));
    terminal::stdout(&table::render(&rows));
    Ok(())
}
