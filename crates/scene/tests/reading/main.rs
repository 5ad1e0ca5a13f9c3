//! Reading scenes, from files to triangles.

mod budgets;
mod files;
mod formats;
mod messages;
mod oracle;
mod robustness;
mod town;
