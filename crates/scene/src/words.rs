//! The text of small files in the encoding that they declare.

use encoding_rs::{Encoding, UTF_8, WINDOWS_1252};

/// Decodes a text: by its byte order mark, else by what its XML declaration says, else as UTF-8, and as Latin-1 (Windows 1252) where it
/// is none. UTF-16 without a mark is known by its zero bytes.
pub(crate) fn decode(bytes: &[u8]) -> String {
    if let Some((encoding, mark)) = Encoding::for_bom(bytes) {
        return encoding.decode_without_bom_handling(&bytes[mark..]).0.into_owned();
    }
    let encoding = match bytes {
        [b'<', 0, ..] => encoding_rs::UTF_16LE,
        [0, b'<', ..] => encoding_rs::UTF_16BE,
        _ => declared(bytes).unwrap_or(UTF_8),
    };
    let (text, broken) = encoding.decode_without_bom_handling(bytes);
    if broken { WINDOWS_1252.decode_without_bom_handling(bytes).0.into_owned() } else { text.into_owned() }
}

/// What `<?xml … encoding="…"?>` says.
fn declared(bytes: &[u8]) -> Option<&'static Encoding> {
    let head = &bytes[..bytes.len().min(200)];
    let head = head.trim_ascii_start();
    if !head.starts_with(b"<?xml") {
        return None;
    }
    let end = memchr::memchr(b'>', head)?;
    let head = std::str::from_utf8(&head[..end]).ok()?;
    let label = head.split("encoding").nth(1)?.split(['"', '\'']).nth(1)?;
    let encoding = Encoding::for_label(label.as_bytes())?;
    // What is read byte by byte up to here is no UTF-16, whatever it says.
    Some(if encoding == encoding_rs::UTF_16LE || encoding == encoding_rs::UTF_16BE { UTF_8 } else { encoding })
}

/// The numbers of a text, apart by blanks, commas or semicolons. Where semicolons or blanks are there to keep them apart and there is
/// no point, a comma is a decimal one.
pub(crate) fn numbers(text: &str) -> Option<Vec<f64>> {
    let text = text.trim().trim_end_matches([',', ';']);
    let apart = |c: char| c.is_whitespace() || c == ';';
    let decimal_commas = !text.contains('.')
        && text.contains(',')
        && text.split(apart).filter(|w| !w.is_empty()).all(|w| w.matches(',').count() <= 1 && !w.ends_with(','))
        && text.split(apart).filter(|w| !w.is_empty()).count() > 1;
    let parse = |word: &str| {
        let value: f64 = if decimal_commas { word.replace(',', ".").parse() } else { word.parse() }.ok()?;
        value.is_finite().then_some(value)
    };
    text.split(|c: char| apart(c) || (c == ',' && !decimal_commas)).filter(|w| !w.is_empty()).map(parse).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_in_their_encodings() {
        let utf16 = |text: &str| text.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>();
        assert_eq!(decode("\u{feff}é".as_bytes()), "é");
        assert_eq!(decode(b"\xe9"), "é");
        assert_eq!(
            decode(b"<?xml version='1.0' encoding='ISO-8859-1'?>\xe9"),
            "<?xml version='1.0' encoding='ISO-8859-1'?>é"
        );
        assert_eq!(
            decode(b"<?xml version=\"1.0\" encoding=\"GBK\"?>\xb2\xe2"),
            "<?xml version=\"1.0\" encoding=\"GBK\"?>测"
        );
        let marked = [b"\xff\xfe".as_slice(), &utf16("<a>é</a>")].concat();
        assert_eq!(decode(&marked), "<a>é</a>");
        assert_eq!(decode(&utf16("<a/>")), "<a/>");
        // A declaration that cannot be true.
        assert_eq!(
            decode(b"<?xml version=\"1.0\" encoding=\"UTF-16\"?><a/>"),
            "<?xml version=\"1.0\" encoding=\"UTF-16\"?><a/>"
        );
    }

    #[test]
    fn numbers_in_their_forms() {
        let expected = Some(vec![691_000.5, 5_334_000.0, -3.0]);
        for text in [
            "691000.5,5334000,-3",
            " 691000.5 , 5334000.0 ,-3 ",
            "691000.5;5334000;-3;",
            "691000.5 5334000 -3\n",
            "691000,5;5334000,0;-3",
            "691000,5 5334000,0 -3",
        ] {
            assert_eq!(numbers(text), expected, "{text}");
        }
        assert_eq!(numbers("691000, 5334000, 0"), Some(vec![691_000.0, 5_334_000.0, 0.0]));
        assert_eq!(numbers("1,2"), Some(vec![1.0, 2.0]));
        assert_eq!(numbers(""), Some(vec![]));
        for wrong in ["a", "1 nan", "1 2 inf", "1..2"] {
            assert_eq!(numbers(wrong), None, "{wrong}");
        }
    }
}
