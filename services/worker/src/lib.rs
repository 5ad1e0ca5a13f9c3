#![doc = include_str!("../README.md")]

mod cache;
mod child;
mod error;
mod health;
mod history;
mod log;
mod outcome;
mod places;
mod protocol;
mod task;
mod tell;
mod version;
mod worker;

pub use child::Limits;
pub use error::WorkerError;
pub use health::{Health, REST};
pub use protocol::{
    Addition, BAD_INPUT, Building, CityReport, Ended, FAILED, History, Needs, OBJECTS, Order, PHASE, Report, StageTime,
    UPLOAD,
};
pub use version::version;
pub use worker::{Settings, Worker};
