//! Object stores that speak S3.

use crate::JobStoreError;
use futures_util::TryStreamExt;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey};
use object_store::path::Path;
use object_store::prefix::PrefixStore;
use object_store::{BackoffConfig, ClientConfigKey, ObjectMeta, ObjectStore, ObjectStoreExt, RetryConfig};
use std::path::Component;
use std::sync::Arc;
use std::time::Duration;
use tokio::io::AsyncWriteExt;

/// A request is tried a few times here, for a hiccup; what is away for longer is waited for by callers, who know how long that
/// is worth while.
const RETRIES: usize = 2;
const RETRY_TIME: Duration = Duration::from_secs(5);

/// What may be fetched from a place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FetchLimits {
    /// Bytes.
    pub bytes: u64,
    /// Objects.
    pub objects: usize,
}

/// Lays what is at `s3://BUCKET/PREFIX` into a folder: the object of this name, or all objects below it under their names, with what
/// the variables `AWS_…` say of endpoint, region and keys. Gives the number of files.
///
/// # Errors
/// If the store does not answer, nothing is there or more than may be fetched, or an object has a name that no file may have.
pub async fn fetch_objects(
    place: &str,
    variables: impl IntoIterator<Item = (String, String)>,
    folder: &std::path::Path,
    limits: FetchLimits,
) -> Result<usize, JobStoreError> {
    let refused = |why: String| JobStoreError::Fetch { place: place.to_owned(), why };
    let rest = place.strip_prefix("s3://").ok_or_else(|| JobStoreError::Place(place.to_owned()))?;
    let (bucket, key) = rest.split_once('/').unwrap_or((rest, ""));
    let store = open(&format!("s3://{bucket}"), variables)?;
    let key = Path::parse(key).map_err(object_store::Error::from)?;
    let found =
        if key.as_ref().is_empty() { None } else { store.head(&key).await.map(Some).or_else(none_if_missing)? };
    let objects: Vec<(String, ObjectMeta)> = match found {
        Some(object) => vec![(key.filename().unwrap_or_default().to_owned(), object)],
        None => {
            let mut listed = Vec::new();
            let mut pages = store.list(Some(&key));
            while let Some(object) = pages.try_next().await? {
                if listed.len() == limits.objects {
                    return Err(refused(format!("it has more than {} objects", limits.objects)));
                }
                let parts = object.location.prefix_match(&key).into_iter().flatten();
                let name = parts.map(|p| p.as_ref().to_owned()).collect::<Vec<_>>().join("/");
                listed.push((name, object));
            }
            listed
        }
    };
    let bytes: u64 = objects.iter().map(|(_, object)| object.size).sum();
    if objects.is_empty() {
        return Err(refused("nothing is there".to_owned()));
    }
    if bytes > limits.bytes {
        return Err(refused(format!(
            "it has {} MB, more than the {} MB that may be fetched",
            bytes >> 20,
            limits.bytes >> 20
        )));
    }
    for (name, object) in &objects {
        if name.is_empty() || !std::path::Path::new(name).components().all(|c| matches!(c, Component::Normal(_))) {
            return Err(refused(format!("object {:?} has a name that no file may have", object.location.as_ref())));
        }
        let file = folder.join(name);
        let wrong = |source| JobStoreError::File { path: file.clone(), source };
        if let Some(parent) = file.parent() {
            tokio::fs::create_dir_all(parent).await.map_err(wrong)?;
        }
        let mut out = tokio::fs::File::create(&file).await.map_err(wrong)?;
        let mut pieces = store.get(&object.location).await?.into_stream();
        let mut left = object.size;
        while let Some(piece) = pieces.try_next().await? {
            // It has grown since it was listed.
            left = left
                .checked_sub(piece.len() as u64)
                .ok_or_else(|| refused(format!("object {:?} changes while it is read", object.location.as_ref())))?;
            out.write_all(&piece).await.map_err(wrong)?;
        }
        out.flush().await.map_err(wrong)?;
    }
    Ok(objects.len())
}

fn none_if_missing(error: object_store::Error) -> Result<Option<ObjectMeta>, object_store::Error> {
    if matches!(error, object_store::Error::NotFound { .. }) { Ok(None) } else { Err(error) }
}

/// The store at `s3://BUCKET/PREFIX`, with what the variables `AWS_…` say of endpoint, region and keys.
pub(crate) fn open(
    place: &str,
    variables: impl IntoIterator<Item = (String, String)>,
) -> Result<Arc<dyn ObjectStore>, JobStoreError> {
    let wrong = || JobStoreError::Place(place.to_owned());
    let rest = place.strip_prefix("s3://").ok_or_else(wrong)?;
    let (bucket, prefix) = rest.split_once('/').unwrap_or((rest, ""));
    if bucket.is_empty() || bucket.contains(['@', '?', '#']) || prefix.contains(['?', '#']) {
        return Err(wrong());
    }
    prepare_tls();
    let variables: Vec<(String, String)> = variables.into_iter().filter(|(_, value)| !value.is_empty()).collect();
    needed(&variables)?;
    let mut builder = AmazonS3Builder::new().with_bucket_name(bucket);
    for (name, value) in variables {
        // Such as AWS_PROFILE, which is for other programs.
        let known = name.starts_with("AWS_").then(|| name.to_ascii_lowercase().parse::<AmazonS3ConfigKey>());
        if let Some(Ok(key)) = known {
            builder = builder.with_config(key, value);
        }
    }
    let client = |key, value: &str| (AmazonS3ConfigKey::Client(key), value.to_owned());
    let mut settings = vec![
        client(ClientConfigKey::ConnectTimeout, "5 seconds"),
        // A large content may take long, but not stand still for long.
        client(ClientConfigKey::ReadTimeout, "20 seconds"),
        client(ClientConfigKey::Timeout, "1 hour"),
    ];
    // Who writes http:// means it.
    if builder.get_config_value(&AmazonS3ConfigKey::Endpoint).is_some_and(|e| e.starts_with("http://")) {
        settings.push(client(ClientConfigKey::AllowHttp, "true"));
    }
    for (key, value) in settings {
        builder = builder.with_config(key, value);
    }
    let backoff = BackoffConfig { max_backoff: Duration::from_secs(1), ..BackoffConfig::default() };
    let retry = RetryConfig { backoff, max_retries: RETRIES, retry_timeout: RETRY_TIME };
    let bucket = builder.with_retry(retry).build()?;
    let prefix = prefix.trim_matches('/');
    Ok(if prefix.is_empty() { Arc::new(bucket) } else { Arc::new(PrefixStore::new(bucket, prefix)) })
}

/// An error that says which variable is missing, unless there is something to show to the store. Without, whatever answers at the address of
/// the metadata of cloud machines would be asked for keys, which exists on few and has to be named.
fn needed(variables: &[(String, String)]) -> Result<(), JobStoreError> {
    let is_set = |name: &str| variables.iter().any(|(known, _)| known.eq_ignore_ascii_case(name));
    let missing = |names: &str| {
        Err(JobStoreError::Credentials(format!("S3 takes nobody without keys, and {names} in the environment")))
    };
    match (is_set("AWS_ACCESS_KEY_ID"), is_set("AWS_SECRET_ACCESS_KEY")) {
        (true, true) => return Ok(()),
        (true, false) => return missing("AWS_SECRET_ACCESS_KEY is not set"),
        (false, true) => return missing("AWS_ACCESS_KEY_ID is not set"),
        (false, false) => {}
    }
    let others = [
        "AWS_WEB_IDENTITY_TOKEN_FILE",
        "AWS_CONTAINER_CREDENTIALS_RELATIVE_URI",
        "AWS_CONTAINER_CREDENTIALS_FULL_URI",
        "AWS_METADATA_ENDPOINT",
        "AWS_SKIP_SIGNATURE",
    ];
    if others.into_iter().any(is_set) {
        return Ok(());
    }
    missing(
        "neither AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY are set, nor what names a role (AWS_WEB_IDENTITY_TOKEN_FILE, \
         AWS_CONTAINER_CREDENTIALS_FULL_URI; AWS_METADATA_ENDPOINT=http://169.254.169.254 on a machine of EC2)",
    )
}

/// Says which implementation of cryptography TLS takes, once for the process.
pub(crate) fn prepare_tls() {
    // An error means that it was said already.
    let _ = rustls::crypto::ring::default_provider().install_default();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_buckets_are_opened() {
        for wrong in
            ["gs://bucket", "s3://", "s3:///prefix", "http://host/bucket", "s3://key:secret@bucket", "s3://b?x=1"]
        {
            assert!(matches!(open(wrong, []), Err(JobStoreError::Place(p)) if p == wrong), "{wrong}");
        }
        for good in ["s3://bucket", "s3://bucket/", "s3://bucket/some/prefix/"] {
            assert!(open(good, keys(&["AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"])).is_ok(), "{good}");
        }
    }

    fn keys(names: &[&str]) -> Vec<(String, String)> {
        names.iter().map(|name| ((*name).to_owned(), "x".to_owned())).collect()
    }

    #[test]
    fn the_variable_that_is_missing_is_named() {
        let refused = |names: &[&str]| match open("s3://bucket", keys(names)) {
            Err(JobStoreError::Credentials(why)) => why,
            other => panic!("{other:?}"),
        };
        assert!(refused(&["AWS_ACCESS_KEY_ID"]).contains("AWS_SECRET_ACCESS_KEY is not set"));
        assert!(refused(&["AWS_SECRET_ACCESS_KEY"]).contains("AWS_ACCESS_KEY_ID is not set"));
        let none = refused(&["AWS_REGION", "PATH"]);
        assert!(none.contains("AWS_ACCESS_KEY_ID") && none.contains("AWS_METADATA_ENDPOINT"), "{none}");
        let empty = open("s3://bucket", [("AWS_ACCESS_KEY_ID".to_owned(), String::new())]);
        assert!(matches!(empty, Err(JobStoreError::Credentials(_))), "a variable that is empty is not set");
        assert!(open("s3://bucket", keys(&["AWS_METADATA_ENDPOINT"])).is_ok());
    }
}
