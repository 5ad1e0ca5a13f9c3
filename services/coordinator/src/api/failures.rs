//! What failed in a job: each reason once, with the units that it holds for and what can be done.

use super::blocks::kind_of;
use super::jobs::stage_name;
use gable_job_store::{Cause, Task, TaskState};
use serde::Serialize;
use utoipa::ToSchema;

/// Most units that are named for one reason.
const NAMED: usize = 100;

/// A reason for which units failed.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(crate) struct FailureView {
    /// The reason of the first of them; those of the others differ in names and numbers only.
    reason: String,
    /// What can be done about it, where that is known, with the option of the program or the parameter of the job.
    #[serde(skip_serializing_if = "Option::is_none")]
    what_to_do: Option<&'static str>,
    /// How many units.
    count: usize,
    /// The units, in the order of the stages; at most 100.
    units: Vec<FailedUnitView>,
}

/// A unit that failed.
#[derive(Clone, Debug, PartialEq, Serialize, ToSchema)]
pub(crate) struct FailedUnitView {
    #[schema(example = "segment")]
    stage: &'static str,
    /// What it is: scene, block, patch, tile or city.
    #[schema(example = "patch")]
    kind: &'static str,
    #[schema(example = "patch_3_7")]
    unit: String,
    /// How often it was begun.
    attempts: i64,
}

/// The reasons of all units that failed, in the order of the stages. A unit that failed because others had failed is told with those.
pub(super) fn grouped(tasks: &[Task]) -> Vec<FailureView> {
    let mut groups: Vec<(String, FailureView)> = Vec::new();
    for task in tasks.iter().filter(|task| task.state == TaskState::Failed) {
        let reason = task.reason.as_deref().filter(|r| !r.is_empty()).unwrap_or("no reason is known");
        let form = form(reason);
        let kind = kind_of(task.stage);
        let unit =
            FailedUnitView { stage: stage_name(task.stage), kind, unit: task.unit.clone(), attempts: task.attempts };
        // A later stage that had nothing to work with gives the reason of the earlier one within its own.
        let known = groups.iter_mut().find(|(earlier, _)| form.contains(earlier.as_str()));
        match known {
            Some((_, group)) => {
                group.count += 1;
                if group.units.len() < NAMED {
                    group.units.push(unit);
                }
            }
            None => {
                let what_to_do = Cause::of(reason).map(|cause| advice(cause, kind));
                groups.push((form, FailureView { reason: reason.to_owned(), what_to_do, count: 1, units: vec![unit] }));
            }
        }
    }
    groups.into_iter().map(|(_, group)| group).collect()
}

/// A reason without what differs from unit to unit: each word with a digit in it is the same.
fn form(reason: &str) -> String {
    let mut form = String::new();
    let is_word = |c: char| c.is_alphanumeric() || "_-./".contains(c);
    let mut rest = reason;
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c| is_word(c) != is_word(first)).unwrap_or(rest.len());
        let (part, others) = rest.split_at(end);
        form += if part.chars().any(|c| c.is_ascii_digit()) { "#" } else { part };
        rest = others;
    }
    form
}

/// What can be done about a cause at a kind of unit.
fn advice(cause: Cause, kind: &str) -> &'static str {
    match (cause, kind) {
        (Cause::Memory, "block" | "tile") => {
            "Start the workers with a larger --task-memory, or submit the job with smaller blocks (parameter grid.block_size)."
        }
        (Cause::Memory, "patch") => {
            "Start the workers with a larger --task-memory, or submit the job with smaller patches (parameter segmentation.patch)."
        }
        (Cause::Memory, _) => {
            "Start the workers with a larger --task-memory, or submit the job with larger pixels (parameter sampling.step)."
        }
        (Cause::Time, "block" | "tile") => {
            "Start the workers with a larger --task-time, or submit the job with smaller blocks (parameter grid.block_size)."
        }
        (Cause::Time, "patch") => {
            "Start the workers with a larger --task-time, or submit the job with smaller patches (parameter segmentation.patch)."
        }
        (Cause::Time, _) => {
            "Start the workers with a larger --task-time, or submit the job with larger pixels (parameter sampling.step)."
        }
        (Cause::Died, _) => {
            "Look at the log of a unit. A program that the system kills has most often met the end of the machine's memory: start the \
             workers with fewer --slots. Then retry the job, which does again only what failed."
        }
        (Cause::Silent, _) => {
            "The worker was stopped, or its machine was lost or stood still for longer than --lease. Look at the list of workers, then retry \
             the job, which does again only what failed."
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failed(stage: i64, unit: &str, reason: &str) -> Task {
        Task {
            stage,
            unit: unit.to_owned(),
            state: TaskState::Failed,
            attempts: 3,
            worker: None,
            phase: None,
            reason: Some(reason.to_owned()),
            started: None,
            finished: None,
        }
    }

    fn told(tasks: &[Task]) -> Vec<(String, Option<&'static str>, Vec<(&'static str, String)>)> {
        let units = |f: &FailureView| f.units.iter().map(|u| (u.kind, u.unit.clone())).collect();
        grouped(tasks).iter().map(|f| (f.reason.clone(), f.what_to_do, units(f))).collect()
    }

    #[test]
    fn a_reason_is_told_once() {
        let done = Task { state: TaskState::Done, ..failed(1, "1_0", "an earlier attempt") };
        let found = told(&[
            failed(1, "0_0", "used 4099 MB of memory, more than the limit of 4096 MB"),
            done,
            failed(1, "3_7", "used 5012 MB of memory, more than the limit of 4096 MB"),
            failed(2, "city", "sample of every block: used 4099 MB of memory, more than the limit of 4096 MB"),
            failed(3, "patch_0_1", "segment of patch_0_1: a fault in it: index 7 is wrong"),
            failed(3, "patch_-1_4", "segment of patch_-1_4: a fault in it: index 12 is wrong"),
        ]);
        assert_eq!(found.len(), 2, "{found:?}");
        let units = |list: &[(&'static str, &str)]| list.iter().map(|(k, u)| (*k, (*u).to_owned())).collect::<Vec<_>>();
        assert_eq!(found[0].2, units(&[("block", "0_0"), ("block", "3_7"), ("city", "city")]));
        assert!(found[0].1.unwrap().contains("--task-memory") && found[0].1.unwrap().contains("grid.block_size"));
        assert_eq!(found[1].2, units(&[("patch", "patch_0_1"), ("patch", "patch_-1_4")]));
        assert_eq!(found[1].1, None, "the task says it itself");
    }

    #[test]
    fn of_many_units_some_are_named() {
        let tasks: Vec<Task> = (0..500).map(|n| failed(6, &format!("{n}_0"), &Cause::time(60.0))).collect();
        let found = grouped(&tasks);
        assert_eq!((found.len(), found[0].count, found[0].units.len()), (1, 500, NAMED));
        assert!(found[0].what_to_do.unwrap().contains("--task-time"));
    }

    #[test]
    fn other_reasons_are_told_apart() {
        assert_ne!(form("worker a fell silent"), form("took longer than the limit of 60 s"));
        assert_eq!(form("worker host-1-a2 fell silent"), form("worker host-7-ff9 fell silent"));
        assert_eq!(form(""), "");
    }
}
