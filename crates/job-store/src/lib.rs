#![doc = include_str!("../README.md")]

mod artifacts;
mod blobs;
mod cities;
mod claims;
mod collect;
mod database;
mod error;
mod events;
mod figures;
mod jobs;
mod names;
mod outcomes;
mod stages;
mod tasks;
mod tokens;
mod workers;

pub use artifacts::Artifact;
pub use blobs::{BlobId, Blobs};
pub use cities::{BuildingFilter, Change, ChangeKind, City, CityBuilding, Generation, Publication};
pub use claims::{Claim, Finished, Order, Retry};
pub use collect::Collected;
pub use database::Store;
pub use error::JobStoreError;
pub use events::{Event, EventKind};
pub use figures::{Attempt, Attempts, Figures, Queue};
pub use jobs::{Job, JobFilter, JobState, NewJob, Submitted};
pub use tasks::{NewTask, Task, TaskCounts, TaskState};
pub use tokens::{Scope, TokenRecord};
pub use workers::Worker;
