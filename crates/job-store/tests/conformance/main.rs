//! What every database must do. The suite runs on SQLite, and on Postgres where its programs are installed.

mod postgres;
mod suite;

use gable_job_store::Store;

async fn on_sqlite() -> (tempfile::TempDir, Store) {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Store::connect(&format!("sqlite:{}", folder.path().join("jobs.db").display())).await;
    (folder, store.expect("SQLite opens"))
}

macro_rules! conformance {
    ($($name:ident),* $(,)?) => {
        mod sqlite {
            $(
                #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
                async fn $name() {
                    let (_folder, store) = super::on_sqlite().await;
                    super::suite::$name(&store).await;
                }
            )*
        }

        mod on_postgres {
            $(
                #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
                async fn $name() {
                    let Some(address) = super::postgres::database(stringify!($name)) else { return };
                    let store = gable_job_store::Store::connect(&address).await.expect("Postgres opens");
                    super::suite::$name(&store).await;
                    store.close().await;
                }
            )*
        }
    };
}

conformance!(
    a_job_goes_through_its_stages,
    a_repeated_submission_is_the_same_job,
    higher_priority_first_then_older,
    pause_cancel_and_retry,
    a_late_result_is_refused,
    a_silent_worker_loses_its_task,
    a_task_that_always_fails_makes_the_job_partial,
    a_required_task_that_fails_ends_the_job,
    a_task_handed_back_loses_no_attempt,
    many_workers_do_each_task_once,
    random_deaths_change_nothing,
    events_have_no_gaps,
    lists_are_paged,
    artefacts_are_found_by_prefix,
    workers_are_seen,
    tokens_open_and_end,
    wrong_requests_are_refused,
);
