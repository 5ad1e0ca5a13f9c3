//! What a data set tells of itself.

use serde::{Deserialize, Serialize};

/// Metadata of a city, each only if it was given.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(default)]
pub struct Metadata {
    /// Identifier of the data set.
    pub identifier: Option<String>,
    /// The day that the data stand for, `YYYY-MM-DD`.
    pub reference_date: Option<String>,
    /// Who is responsible: name of a person or an organisation.
    pub contact_name: Option<String>,
    /// Address for electronic mail of whoever is responsible.
    pub contact_email: Option<String>,
    /// Where the data come from, and what was done to them.
    pub lineage: Option<String>,
}

impl Metadata {
    /// Whether nothing was given.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        *self == Self::default()
    }
}
