//! Which real meshes there are, and which of them may be tuned on.

use anyhow::Context as _;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// What a scene is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum Half {
    /// Parameters are tuned on it.
    Tuning,
    /// Only its figures are looked at.
    Testing,
}

impl Half {
    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Tuning => "tuning",
            Self::Testing => "testing",
        }
    }
}

/// A real mesh.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RealPlace {
    /// Its outlines are in `NAME.geojson`.
    pub(super) name: String,
    pub(super) half: Half,
    /// File or folder, below the folder of the data.
    pub(super) mesh: String,
}

/// The scenes of `scenes.json` in a folder, in its order.
pub(super) fn read(folder: &Path) -> anyhow::Result<Vec<RealPlace>> {
    let file = folder.join("scenes.json");
    let text = std::fs::read_to_string(&file).with_context(|| format!("{}: give --outlines", file.display()))?;
    serde_json::from_str(&text).with_context(|| file.display().to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The folder of the project's own outlines.
    const OURS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/real");

    #[test]
    fn half_of_the_scenes_are_for_testing_alone() {
        let places = read(Path::new(OURS)).unwrap();
        let names =
            |half: Half| -> Vec<&str> { places.iter().filter(|p| p.half == half).map(|p| p.name.as_str()).collect() };
        assert_eq!(names(Half::Tuning), ["yard", "farm", "block", "dayanta"]);
        assert_eq!(names(Half::Testing), ["wood", "campus", "halls", "frankfurt"]);
    }

    #[test]
    fn all_outlines_can_be_read() {
        for place in read(Path::new(OURS)).unwrap() {
            let file = format!("{}.geojson", place.name);
            let text = std::fs::read_to_string(Path::new(OURS).join(&file)).unwrap();
            gable_evaluation::real::Outlines::parse(&text, &file).unwrap();
        }
    }

    #[test]
    fn a_missing_list_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let error = format!("{:#}", read(folder.path()).unwrap_err());
        assert!(error.contains("scenes.json") && error.contains("--outlines"), "{error}");
        std::fs::write(folder.path().join("scenes.json"), r#"[{"name": "a", "half": "third", "mesh": "a"}]"#).unwrap();
        let error = format!("{:#}", read(folder.path()).unwrap_err());
        assert!(error.contains("scenes.json") && error.contains("third"), "{error}");
    }
}
