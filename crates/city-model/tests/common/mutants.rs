//! Files with a few changes that are always the same for a number: wrong numbers, and parts that are lost, doubled or damaged.

use gable_geometry::Counter;

/// What may stand in place of a number.
const NUMBERS: [&str; 20] = [
    "0",
    "-0",
    "-1",
    "1",
    "3",
    "0.1",
    "1e-300",
    "1e-9",
    "1e3",
    "1e6",
    "-1e6",
    "9999999",
    "-1e9",
    "1e15",
    "1e300",
    "-1e308",
    "2147483648",
    "4294967295",
    "18446744073709551615",
    "null",
];

/// A text with one to four changes.
pub(crate) fn mutant(text: &str, number: u64) -> String {
    let mut random = Counter::keyed(18, &[number as i64]);
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.index(4) {
        if bytes.is_empty() {
            break;
        }
        let at = random.index(bytes.len());
        let end = (at + 1 + random.index(40)).min(bytes.len());
        match random.index(10) {
            0..6 => replace_number(&mut bytes, at, NUMBERS[random.index(NUMBERS.len())]),
            6 => bytes[at] = random.index(256) as u8,
            7 => drop(bytes.drain(at..end)),
            8 => {
                let part = bytes[at..end].to_vec();
                let to = random.index(bytes.len());
                bytes.splice(to..to, part);
            }
            _ => bytes.truncate(at.max(bytes.len() / 2)),
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Replaces the first number from a place on.
fn replace_number(bytes: &mut Vec<u8>, from: usize, by: &str) {
    let is_number = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'-' | b'.');
    let Some(start) = bytes[from..].iter().position(is_number).map(|at| from + at) else { return };
    let end = bytes[start..].iter().position(|byte| !is_number(byte)).map_or(bytes.len(), |at| start + at);
    bytes.splice(start..end, by.bytes());
}
