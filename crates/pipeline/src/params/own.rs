//! What was set of the parameters that methods declare.

use std::collections::BTreeMap;

/// Values by full name, `group.name`.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct OwnSettings(BTreeMap<String, OwnSetting>);

/// A value, and who wants it.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct OwnSetting {
    pub(super) text: String,
    /// A preset wants it: it holds for the methods that have such a parameter, and means nothing to others.
    pub(super) is_of_preset: bool,
}

impl OwnSettings {
    pub(super) fn insert(&mut self, name: &str, setting: OwnSetting) {
        self.0.insert(name.to_owned(), setting);
    }

    pub(super) fn get(&self, name: &str) -> Option<&OwnSetting> {
        self.0.get(name)
    }

    pub(super) fn iter(&self) -> impl Iterator<Item = (&String, &OwnSetting)> {
        self.0.iter()
    }
}
