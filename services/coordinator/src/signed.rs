//! Links that are signed: whoever has one reads what it names, without a token, until it ends.
//!
//! A link says what it opens, who made it and when it ends, and bears an HMAC-SHA256 of that under a secret that the coordinators of a
//! database share. Nothing is kept of it. It opens no more than its maker may see at the time it is used, so it ends with their token or
//! their membership as well, and all of them end when the secret is replaced.

use base64::Engine as _;
use base64::engine::general_purpose::URL_SAFE_NO_PAD;
use hmac::{Hmac, KeyInit as _, Mac as _};
use serde::{Deserialize, Serialize};
use sha2::Sha256;

/// What a link opens.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Grant {
    pub(crate) of: Opened,
    /// The file, or the folder, which ends with `/`.
    pub(crate) path: String,
    /// Who has made it.
    pub(crate) by: String,
    /// When it ends, milliseconds since 1970.
    pub(crate) until: i64,
}

/// Of what a link opens files.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Opened {
    /// Of a city: of this generation, or of the one that readers see.
    City(String, Option<i64>),
    /// Of the result of a job.
    Job(String),
}

impl Grant {
    /// The link's text.
    pub(crate) fn signed(&self, secret: &str) -> Option<String> {
        let said = URL_SAFE_NO_PAD.encode(serde_json::to_vec(self).ok()?);
        let tag = URL_SAFE_NO_PAD.encode(mac(secret, &said)?.finalize().into_bytes());
        Some(format!("{said}.{tag}"))
    }

    /// What the text of a link says, if it was signed with this secret.
    pub(crate) fn read(text: &str, secret: &str) -> Option<Self> {
        let (said, tag) = text.split_once('.')?;
        // Takes the same time wherever the first difference is.
        mac(secret, said)?.verify_slice(&URL_SAFE_NO_PAD.decode(tag).ok()?).ok()?;
        serde_json::from_slice(&URL_SAFE_NO_PAD.decode(said).ok()?).ok()
    }

    /// Whether it opens a file.
    pub(crate) fn opens(&self, path: &str) -> bool {
        if self.path.ends_with('/') { path.starts_with(&self.path) } else { path == self.path }
    }
}

fn mac(secret: &str, said: &str) -> Option<Hmac<Sha256>> {
    // What is signed with this secret is nothing but links.
    let mut mac = Hmac::<Sha256>::new_from_slice(secret.as_bytes()).ok()?;
    mac.update(said.as_bytes());
    Some(mac)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grant(path: &str) -> Grant {
        Grant { of: Opened::City("delft".to_owned(), None), path: path.to_owned(), by: "ann".to_owned(), until: 7 }
    }

    #[test]
    fn what_was_signed_is_read_and_nothing_else() {
        let made = grant("3dtiles/");
        let text = made.signed("secret").unwrap();
        assert_eq!(Grant::read(&text, "secret"), Some(made.clone()));
        assert_eq!(Grant::read(&text, "other"), None);
        let (said, tag) = text.split_once('.').unwrap();
        let more = URL_SAFE_NO_PAD.encode(serde_json::to_vec(&Grant { until: 8, ..made }).unwrap());
        for forged in [
            format!("{more}.{tag}"),
            format!("{said}."),
            said.to_owned(),
            format!("{said}.{}", &tag[..20]),
            String::new(),
        ] {
            assert_eq!(Grant::read(&forged, "secret"), None, "{forged}");
        }
    }

    #[test]
    fn a_folder_opens_what_is_in_it_and_a_file_itself() {
        let folder = grant("3dtiles/");
        assert!(folder.opens("3dtiles/tileset.json") && folder.opens("3dtiles/0/0_0.glb"));
        assert!(!folder.opens("3dtiles") && !folder.opens("tiles/0_0.gml") && !folder.opens("3dtiles2/x"));
        let file = grant("city.gml");
        assert!(file.opens("city.gml") && !file.opens("city.gml2") && !file.opens("city.gml/x"));
    }
}
