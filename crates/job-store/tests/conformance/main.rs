//! What every database must do. The suite runs on SQLite, and on Postgres where its programs are installed.

mod cities;
mod postgres;
mod suite;

use gable_job_store::Store;

/// Notes a test that found nothing to work on.
#[allow(clippy::print_stdout, reason = "the reason for a skipped test is for whoever runs it")]
fn skip(name: &str, reason: &str) {
    println!("skipped {name}: {reason}");
    if let Ok(log) = std::env::var("GABLE_SKIP_LOG") {
        use std::io::Write;
        let mut file = std::fs::OpenOptions::new().append(true).create(true).open(log).expect("the skip log");
        writeln!(file, "skipped {name}: {reason}").expect("the skip log");
    }
}

async fn on_sqlite() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::connect(&format!("sqlite:{}", folder.path().join("jobs.db").display())).await;
    (folder, store.expect("SQLite opens"))
}

macro_rules! conformance {
    ($($part:ident::$name:ident),* $(,)?) => {
        mod sqlite {
            $(
                #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
                async fn $name() {
                    let (_folder, store) = super::on_sqlite().await;
                    super::$part::$name(&store).await;
                }
            )*
        }

        mod on_postgres {
            $(
                #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
                async fn $name() {
                    let Some(address) = super::postgres::database(stringify!($name)) else { return };
                    let store = gable_job_store::Store::connect(&address).await.expect("Postgres opens");
                    super::$part::$name(&store).await;
                    store.close().await;
                }
            )*
        }
    };
}

conformance!(
    suite::a_job_goes_through_its_stages,
    suite::a_repeated_submission_is_the_same_job,
    suite::higher_priority_first_then_older,
    suite::pause_cancel_and_retry,
    suite::a_late_result_is_refused,
    suite::a_silent_worker_loses_its_task,
    suite::a_task_that_always_fails_makes_the_job_partial,
    suite::a_required_task_that_fails_ends_the_job,
    suite::a_task_handed_back_loses_no_attempt,
    suite::many_workers_do_each_task_once,
    suite::random_deaths_change_nothing,
    suite::events_have_no_gaps,
    suite::figures_tell_what_was_done,
    suite::lists_are_paged,
    suite::artefacts_are_found_by_prefix,
    suite::artefacts_are_found_by_place,
    suite::workers_are_seen,
    suite::tokens_open_and_end,
    suite::wrong_requests_are_refused,
    cities::generations_hold_what_was_published,
    cities::readers_never_get_less_than_they_had,
    cities::outcomes_are_taken_over,
    cities::a_retry_begins_with_what_failed,
    cities::only_what_nothing_refers_to_is_removed,
);
