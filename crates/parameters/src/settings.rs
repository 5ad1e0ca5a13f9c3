//! Values that were given, before they are typed.

use crate::declaration::Parameters;
use std::collections::BTreeMap;

/// Values that differ from a method's defaults, as text by name.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Settings(BTreeMap<String, String>);

impl Settings {
    /// Gives a parameter a value.
    pub fn insert(&mut self, name: &str, text: &str) {
        self.0.insert(name.to_owned(), text.to_owned());
    }

    /// The value that a parameter was given.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&str> {
        self.0.get(name).map(String::as_str)
    }

    /// The parameters of one owner with these values.
    ///
    /// # Errors
    /// The first value that the owner cannot read, or that is none of its own.
    pub fn typed<P: Parameters>(&self) -> Result<P, String> {
        let mut params = P::default();
        for (name, text) in &self.0 {
            params.set(name, text).map_err(|expected| format!("{name} = {text}: give {expected}"))?;
        }
        Ok(params)
    }
}
