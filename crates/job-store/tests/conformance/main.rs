//! What every database and every store of artefacts must do. The suites run on SQLite and on Postgres, and on a folder and on S3,
//! where servers of these are installed.

mod blobs;
mod cities;
mod nodes;
mod postgres;
mod removal;
mod s3_server;
mod schedules;
mod suite;
mod tenants;
mod uploads;
mod versions;

use gable_job_store::{Blobs, Store};

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
    suite::the_log_of_the_last_attempt_is_kept,
    suite::many_workers_do_each_task_once,
    suite::random_deaths_change_nothing,
    suite::events_have_no_gaps,
    suite::figures_tell_what_was_done,
    versions::a_job_stays_with_the_version_that_began_it,
    versions::a_job_whose_version_is_gone_begins_anew,
    versions::what_a_version_cannot_do_another_may,
    suite::lists_are_paged,
    suite::artefacts_are_found_by_prefix,
    suite::artefacts_are_found_by_place,
    suite::workers_are_seen,
    suite::tokens_open_and_end,
    suite::the_first_token_has_one_maker,
    suite::a_quota_holds_however_many_submit_at_once,
    suite::wrong_requests_are_refused,
    uploads::parts_are_kept_until_they_are_an_upload,
    uploads::quotas_of_uploads_hold_under_a_rush,
    cities::generations_hold_what_was_published,
    cities::readers_never_get_less_than_they_had,
    cities::outcomes_are_taken_over,
    cities::a_retry_begins_with_what_failed,
    cities::only_what_nothing_refers_to_is_removed,
    nodes::a_broken_node_leaves_tasks_to_others,
    nodes::a_task_fails_only_when_nodes_have_tried_it,
    nodes::losses_are_counted_apart,
    nodes::a_task_goes_to_a_node_that_has_what_it_needs,
    removal::an_unchanged_refresh_makes_no_generation,
    removal::generations_jobs_and_cities_are_deleted,
    removal::what_is_kept_no_longer_goes,
    removal::what_failed_keeps_its_blobs_for_a_while,
    tenants::a_city_is_of_whom_it_was_first,
    tenants::a_city_rolls_back_to_any_generation,
    tenants::tokens_rotate_by_name,
    tenants::sessions_hold_for_their_time,
    tenants::the_audit_log_is_kept_and_purged,
    schedules::a_tick_has_one_winner,
    schedules::runs_do_not_overlap,
    schedules::missed_and_changed_ticks_submit_nothing,
    schedules::messages_are_for_whom_they_concern,
    schedules::callbacks_are_told_of_their_job_only,
    schedules::a_message_is_sent_until_it_is_delivered,
);

/// Many processes that begin at the same time: each connects with a pool of its own.
async fn connect_at_once(address: &str) {
    let connections: Vec<_> = (0..8)
        .map(|_| {
            let address = address.to_owned();
            tokio::spawn(async move { Store::connect(&address).await.map_err(|e| e.to_string()) })
        })
        .collect();
    for connection in connections {
        let store = connection.await.expect("it ends").expect("it opens");
        assert!(!store.has_tokens().await.expect("asks"));
        store.close().await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn an_empty_database_is_opened_by_many_at_once_on_sqlite() {
    for _ in 0..5 {
        let folder = tempfile::tempdir().expect("a folder");
        connect_at_once(&format!("sqlite:{}", folder.path().join("jobs.db").display())).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 4)]
async fn an_empty_database_is_opened_by_many_at_once_on_postgres() {
    let Some(address) = postgres::database("opened_by_many") else { return };
    connect_at_once(&address).await;
}

macro_rules! conformance_of_blobs {
    ($($name:ident),* $(,)?) => {
        mod in_folder {
            $(
                #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
                async fn $name() {
                    let folder = tempfile::tempdir().expect("a folder");
                    let blobs = super::Blobs::in_folder(folder.path()).expect("opens");
                    super::blobs::$name(&blobs).await;
                }
            )*
        }

        mod on_s3 {
            $(
                #[tokio::test(flavor = "multi_thread", worker_threads = 4)]
                async fn $name() {
                    let name = stringify!($name).replace("_", "-");
                    let Some(bucket) = super::s3_server::bucket(&name[..name.len().min(60)]) else { return };
                    let variables = super::s3_server::Bucket::variables(bucket.port);
                    let blobs = super::Blobs::open(&format!("{}/some/prefix", bucket.place), variables).expect("opens");
                    super::blobs::$name(&blobs).await;
                }
            )*
        }
    };
}

conformance_of_blobs!(
    what_is_put_is_found_and_removed,
    files_go_in_and_out_as_streams,
    parts_are_those_of_the_content,
    a_file_that_changes_is_not_kept_under_its_old_name,
    many_writers_of_one_content_do_not_disturb_each_other,
);
