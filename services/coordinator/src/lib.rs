#![doc = include_str!("../README.md")]

mod access;
mod api;
mod audit;
mod auth;
mod base;
mod cors;
mod cron;
mod extract;
mod feed;
#[cfg(feature = "fuzzing")]
#[doc(hidden)]
pub mod fuzzing;
mod headers;
mod listen;
mod names;
mod ogc;
mod outbound;
mod pages;
mod problem;
mod receiving;
mod rights;
mod scheduler;
mod shared;
mod sign_in;
mod signed;
mod state;
mod tile;
mod unpack;
mod visitor;
mod webhooks;

pub use api::{FOR_THE_VIEWER, document, probes, router};
pub use audit::{Gathered, keep_audit};
pub use auth::{Caller, NewToken, create_first_token, create_token, rotate_token};
pub use cors::{Origin, checked_origin};
pub use feed::Feed;
pub use listen::{Patience, Places, serve};
pub use names::is_name;
pub use pages::{escaped, time};
pub use problem::Problem;
pub use receiving::Receiving;
pub use scheduler::tick;
pub use sign_in::{Grants, PERSON, RoleOfGroup, SignIn, SignInRefused, SignInSettings};
pub use state::{Answers, Coordinator, Limits};
pub use visitor::TrustedProxy;
pub use webhooks::deliver;
