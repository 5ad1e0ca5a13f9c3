//! Reading scenes, from files to triangles.

mod budgets;
mod files;
mod formats;
mod messages;
mod oracle;
mod places;
mod robustness;
mod town;
