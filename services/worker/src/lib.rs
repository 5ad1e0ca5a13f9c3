#![doc = include_str!("../README.md")]

mod cache;
mod child;
mod error;
mod protocol;
mod task;
mod worker;

pub use child::Limits;
pub use error::WorkerError;
pub use protocol::{Addition, BAD_INPUT, Order, PHASE, Reads, Report};
pub use worker::{Settings, Worker};
