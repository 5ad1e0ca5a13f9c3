#![doc = include_str!("../README.md")]

mod cache;
mod child;
mod error;
mod history;
mod protocol;
mod task;
mod worker;

pub use child::Limits;
pub use error::WorkerError;
pub use protocol::{Addition, BAD_INPUT, Ended, FAILED, History, Order, PHASE, Reads, Report, StageTime};
pub use worker::{Settings, Worker};
