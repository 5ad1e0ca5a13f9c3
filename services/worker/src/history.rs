//! What a task is told of the stages before its own.

use crate::protocol::{Ended, History, StageTime};
use gable_job_store::{Task, TaskState};
use std::collections::BTreeMap;

/// What happened before `stage`.
pub(crate) fn before(stage: i64, tasks: &[Task]) -> History {
    let earlier = || tasks.iter().filter(|t| t.stage < stage);
    let ended = |state| {
        let of = move |t: &Task| Ended {
            stage: t.stage,
            unit: t.unit.clone(),
            reason: t.reason.clone().unwrap_or_default(),
        };
        earlier().filter(move |t| t.state == state).map(of).collect()
    };
    // First begin, last end, sum; milliseconds.
    let mut times: BTreeMap<i64, (i64, i64, i64)> = BTreeMap::new();
    for task in earlier() {
        if let (Some(begin), Some(end)) = (task.started, task.finished) {
            let time = times.entry(task.stage).or_insert((begin, end, 0));
            *time = (time.0.min(begin), time.1.max(end), time.2 + (end - begin));
        }
    }
    let seconds = |milliseconds: i64| milliseconds as f64 / 1000.0;
    let stages = times.into_iter().map(|(stage, (begin, end, sum))| StageTime {
        stage,
        wall: seconds(end - begin),
        sum: seconds(sum),
    });
    History { failed: ended(TaskState::Failed), reused: ended(TaskState::Reused), stages: stages.collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_what_is_over_before_is_told() {
        let task = |stage, unit: &str, state, times: Option<(i64, i64)>| Task {
            stage,
            unit: unit.to_owned(),
            state,
            attempts: 1,
            worker: None,
            phase: None,
            reason: (state == TaskState::Failed).then(|| "no memory".to_owned()),
            started: times.map(|t| t.0),
            finished: times.map(|t| t.1),
        };
        let tasks = [
            task(0, "scene", TaskState::Done, Some((0, 500))),
            task(1, "0_0", TaskState::Failed, Some((1000, 3000))),
            task(1, "0_1", TaskState::Reused, Some((1500, 1500))),
            task(1, "0_2", TaskState::Done, Some((2000, 4000))),
            task(2, "city", TaskState::Running, Some((5000, 0))),
            task(3, "0_0", TaskState::Failed, None),
        ];
        let history = before(2, &tasks);
        assert_eq!(history.failed, [Ended { stage: 1, unit: "0_0".to_owned(), reason: "no memory".to_owned() }]);
        assert_eq!(history.reused.iter().map(|e| e.unit.as_str()).collect::<Vec<_>>(), ["0_1"]);
        assert_eq!(
            history.stages,
            [StageTime { stage: 0, wall: 0.5, sum: 0.5 }, StageTime { stage: 1, wall: 3.0, sum: 4.0 }]
        );
    }
}
