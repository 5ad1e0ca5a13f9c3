//! The two things that a glTF file writes as a URI: a relative file name, and bytes in base 64.

use std::path::{Path, PathBuf};

/// What a URI stands for.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Target {
    File(PathBuf),
    Bytes(Vec<u8>),
}

/// Resolves a URI seen from a folder.
pub(crate) fn resolve(folder: &Path, uri: &str) -> Result<Target, String> {
    if let Some(data) = uri.strip_prefix("data:") {
        let start: String = uri.chars().take(40).collect();
        let (_, text) = data.split_once(";base64,").ok_or_else(|| format!("{start:?} is not in base 64"))?;
        return decode_base64(text).map(Target::Bytes).ok_or_else(|| format!("{start:?} is broken base 64"));
    }
    if uri.contains("://") {
        return Err(format!("{uri:?} is not a file beside it: fetch it first"));
    }
    Ok(Target::File(folder.join(decode_percent(uri))))
}

/// Replaces `%20` and the like.
fn decode_percent(text: &str) -> String {
    let bytes = text.as_bytes();
    let mut out = Vec::with_capacity(bytes.len());
    let mut at = 0;
    while at < bytes.len() {
        let hex = bytes.get(at + 1..at + 3).filter(|_| bytes[at] == b'%').and_then(|h| std::str::from_utf8(h).ok());
        match hex.and_then(|h| u8::from_str_radix(h, 16).ok()) {
            Some(byte) => {
                out.push(byte);
                at += 3;
            }
            None => {
                out.push(bytes[at]);
                at += 1;
            }
        }
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Base 64 as RFC 4648 has it; line ends between are passed over.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let mut out = Vec::with_capacity(text.len() / 4 * 3);
    let (mut bits, mut held) = (0u32, 0u32);
    let mut ended = false;
    for byte in text.bytes().filter(|b| !b.is_ascii_whitespace()) {
        let value = match byte {
            b'A'..=b'Z' => byte - b'A',
            b'a'..=b'z' => byte - b'a' + 26,
            b'0'..=b'9' => byte - b'0' + 52,
            b'+' | b'-' => 62,
            b'/' | b'_' => 63,
            b'=' => {
                ended = true;
                continue;
            }
            _ => return None,
        };
        if ended {
            return None;
        }
        bits = bits << 6 | u32::from(value);
        held += 6;
        if held >= 8 {
            held -= 8;
            out.push((bits >> held) as u8);
        }
    }
    // Six bits alone make no byte.
    (held < 6).then_some(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decodes_the_vectors_of_the_standard() {
        let vectors =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9v\nYmFy")];
        for (plain, coded) in vectors {
            assert_eq!(decode_base64(coded).as_deref(), Some(plain.as_bytes()));
        }
        assert_eq!(decode_base64("Zm9v!"), None);
        assert_eq!(decode_base64("Zg==Zg"), None);
        assert_eq!(decode_base64("Zm9vY"), None);
    }

    #[test]
    fn resolves_names_and_data() {
        let folder = Path::new("f");
        assert_eq!(resolve(folder, "a%20b.jpg"), Ok(Target::File(PathBuf::from("f/a b.jpg"))));
        assert_eq!(resolve(folder, "100%.jpg"), Ok(Target::File(PathBuf::from("f/100%.jpg"))));
        assert_eq!(resolve(folder, "data:image/png;base64,Zm8="), Ok(Target::Bytes(b"fo".to_vec())));
        assert!(resolve(folder, "https://example.org/a.bin").is_err_and(|e| e.contains("fetch it first")));
        assert!(resolve(folder, "data:text/plain,hello").is_err());
    }
}
