//! What a task's result depends on, as one hash; and the finished city in its report.

use crate::protocol::{Building, CityReport, History};
use crate::version::version;
use gable_job_store::{Artifact, BlobId, CityBuilding, Claim, JobStoreError, Publication};
use std::path::Path;

/// Changes whenever results of earlier builds of the same version must not be taken over.
const OUTCOME: u32 = 1;

/// The key of a task's result: equal keys mean equal results. The job, its source and its parameters count only as far as
/// they have come into the task's input.
pub(crate) fn key(claim: &Claim, input: &serde_json::Value, read: &[Artifact], history: Option<&History>) -> String {
    let program = format!("gable {} outcome {OUTCOME}", version());
    let mut text = vec![program, claim.stage.to_string(), claim.unit.clone(), input.to_string()];
    for artifact in read {
        text.extend([artifact.path.clone(), artifact.blob.to_string()]);
    }
    // What divides the parts that may be many.
    text.push(String::new());
    for failed in history.iter().flat_map(|h| &h.failed) {
        text.extend([failed.stage.to_string(), failed.unit.clone(), failed.reason.clone()]);
    }
    // As JSON, so that no two lists are the same text.
    BlobId::of(serde_json::Value::from(text).to_string().as_bytes()).to_string()
}

/// The city that a child has reported.
pub(crate) async fn publication(report: &CityReport, folder: &Path) -> Result<Publication, JobStoreError> {
    let file = folder.join(&report.buildings);
    let wrong = |source| JobStoreError::File { path: file.clone(), source };
    let text = tokio::fs::read_to_string(&file).await.map_err(wrong)?;
    let lines = text.lines().filter(|line| !line.is_empty());
    let buildings = lines.map(|line| {
        let Building { id, hash, tile: [ix, iy], bbox, lod, roof_type, height_m, area_m2, attributes } =
            serde_json::from_str(line).map_err(|e| wrong(e.into()))?;
        let (tile, attributes) = (format!("{ix}_{iy}"), attributes.to_string());
        Ok(CityBuilding { id, hash, tile, bbox, lod, roof_type, height: height_m, area: area_m2, attributes })
    });
    Ok(Publication { crs: report.crs.clone(), buildings: buildings.collect::<Result<_, JobStoreError>>()? })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::Ended;
    use serde_json::json;

    #[test]
    fn the_key_tells_all_that_counts() {
        let claim = |job: &str, unit: &str| Claim {
            job: job.to_owned(),
            city: "delft".to_owned(),
            request: "{}".to_owned(),
            stage: 1,
            unit: unit.to_owned(),
            input: String::new(),
            fence: 1,
            attempt: 1,
            node: "n".to_owned(),
        };
        let read = |path: &str, content: &str| Artifact {
            path: path.to_owned(),
            blob: BlobId::of(content.as_bytes()),
            bytes: 1,
        };
        let failed = |unit: &str| History {
            failed: vec![Ended { stage: 1, unit: unit.to_owned(), reason: String::new() }],
            ..History::default()
        };
        let first = key(&claim("j", "0_0"), &json!({"a": 1}), &[read("x", "1")], None);
        assert_eq!(first, key(&claim("k", "0_0"), &json!({"a": 1}), &[read("x", "1")], Some(&History::default())));
        let others = [
            key(&claim("j", "0_1"), &json!({"a": 1}), &[read("x", "1")], None),
            key(&claim("j", "0_0"), &json!({"a": 2}), &[read("x", "1")], None),
            key(&claim("j", "0_0"), &json!({"a": 1}), &[read("x", "2")], None),
            key(&claim("j", "0_0"), &json!({"a": 1}), &[read("y", "1")], None),
            key(&claim("j", "0_0"), &json!({"a": 1}), &[], None),
            key(&claim("j", "0_0"), &json!({"a": 1}), &[read("x", "1")], Some(&failed("0_0"))),
            key(&claim("j", "0_0"), &json!({"a": 1}), &[read("x", "1")], Some(&failed("0_1"))),
        ];
        let different: std::collections::BTreeSet<_> = others.iter().collect();
        assert!(different.len() == others.len() && !different.contains(&first));
    }
}
