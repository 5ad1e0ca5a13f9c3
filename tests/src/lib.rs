//! What the end-to-end tests share: the real binary, synthetic cities made once, and the comparison of results.

mod binary;
mod city;
mod node;
#[path = "../../crates/job-store/tests/conformance/postgres.rs"]
mod postgres;
mod proxy;
mod result;
#[path = "../../crates/job-store/tests/conformance/s3_server.rs"]
mod s3_server;
mod service;
mod skip;
mod valid;

pub use binary::{Finished, gable, run_gable, start_gable, use_binary};
pub use city::{case, town};
pub use node::run_node;
pub use proxy::Proxy;
pub use result::{Tile, bytes_of_models, footprint_iou, footprints, read_city, tiles};
pub use service::{AS_A_JOB, Database, Files, Process, Service, files_of, pause_postgres, same_models, signal};
pub use skip::{schemas, skip, test_data};
pub use valid::{assert_citygml, assert_cityjson, assert_solids};
