#![doc = include_str!("../README.md")]

mod api;
mod auth;
mod pages;
mod problem;
mod source;
mod state;

pub use api::{document, router};
pub use auth::{Caller, NewToken, Scope, create_token};
pub use problem::Problem;
pub use source::{SourceError, resolve};
pub use state::{Coordinator, Limits};
