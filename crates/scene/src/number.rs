//! Numbers in text, fast for the form that meshes are written in.

/// Powers of ten that a double holds exactly.
const POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20,
    1e21, 1e22,
];

/// Parses a decimal number; `None` where `str::parse::<f64>` fails, else bit for bit what that gives.
///
/// A number whose digits make an integer of at most 2⁵³ and whose scale is a power of ten of at most
/// 10²² is one exact integer multiplied or divided by one exact power, which rounds once and
/// therefore rightly (Clinger 1990, "How to read floating point numbers accurately"). All others
/// are left to the standard library. What C programs write for what is no number (`-nan(ind)`, `1.#QNAN`, `1.#INF`) is read as such.
pub(crate) fn parse_f64(text: &[u8]) -> Option<f64> {
    match simple(text) {
        Some(value) => Some(value),
        None => std::str::from_utf8(text).ok()?.parse().ok().or_else(|| no_number(text)),
    }
}

/// A number with a comma in place of its point, as programs write it that follow the habits of a country. Two commas part thousands, or
/// words: they are no number.
#[cold]
pub(crate) fn parse_comma(text: &[u8]) -> Option<f64> {
    let at = memchr::memchr(b',', text)?;
    if text.len() > 64 || text.contains(&b'.') || !text[at + 1..].first().is_some_and(u8::is_ascii_digit) {
        return None;
    }
    let mut point = text.to_vec();
    point[at] = b'.';
    parse_f64(&point)
}

/// Not a number and infinity as C libraries write them: that of Microsoft in its old and its new form, and that of GNU.
#[cold]
fn no_number(text: &[u8]) -> Option<f64> {
    let lower = text.to_ascii_lowercase();
    let plain = lower.strip_prefix(b"-").or_else(|| lower.strip_prefix(b"+")).unwrap_or(&lower);
    // Zeros may follow where digits were asked for: 1.#QNAN0.
    let old = plain.strip_prefix(b"1.#").map(|rest| rest.trim_ascii_end());
    let starts =
        |word: &[u8]| old.is_some_and(|old| old.starts_with(word) && old[word.len()..].iter().all(|b| *b == b'0'));
    if starts(b"inf") {
        return Some(if lower.starts_with(b"-") { f64::NEG_INFINITY } else { f64::INFINITY });
    }
    let new = plain.starts_with(b"nan(") && plain.ends_with(b")");
    (new || [b"ind".as_slice(), b"qnan", b"snan"].into_iter().any(starts)).then_some(f64::NAN)
}

/// The value of `[+-]digits[.digits][e[+-]digits]` where one rounding is enough.
#[inline]
fn simple(text: &[u8]) -> Option<f64> {
    let (negative, digits) = match text {
        [b'-', rest @ ..] => (true, rest),
        [b'+', rest @ ..] => (false, rest),
        rest => (false, rest),
    };
    let mut mantissa = 0u64;
    let mut at = 0;
    while let Some(digit) = digit(digits, at) {
        mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
        at += 1;
    }
    let mut count = at;
    let mut scale = 0i32;
    if digits.get(at) == Some(&b'.') {
        at += 1;
        let start = at;
        while let Some(digit) = digit(digits, at) {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(digit);
            at += 1;
        }
        scale = -((at - start) as i32);
        count += at - start;
    }
    // Up to 19 digits cannot have wrapped.
    if count == 0 || count > 19 || mantissa > 1 << 53 {
        return None;
    }
    if let Some(b'e' | b'E') = digits.get(at) {
        at += 1;
        let down = match digits.get(at) {
            Some(b'-') => true,
            Some(b'+') => false,
            _ => {
                at -= 1;
                false
            }
        };
        at += 1;
        let start = at;
        let mut exponent = 0i32;
        while let Some(digit) = digit(digits, at) {
            exponent = exponent.wrapping_mul(10).wrapping_add(digit as i32);
            at += 1;
        }
        if at == start || at - start > 4 {
            return None;
        }
        scale += if down { -exponent } else { exponent };
    }
    if at != digits.len() {
        return None;
    }
    let power = *POWERS.get(scale.unsigned_abs() as usize)?;
    let value = if scale < 0 { mantissa as f64 / power } else { mantissa as f64 * power };
    Some(if negative { -value } else { value })
}

#[inline]
fn digit(text: &[u8], at: usize) -> Option<u64> {
    let digit = text.get(at)?.wrapping_sub(b'0');
    (digit < 10).then_some(u64::from(digit))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn agrees(text: &str) -> bool {
        parse_f64(text.as_bytes()).map(f64::to_bits) == text.parse::<f64>().ok().map(f64::to_bits)
    }

    #[test]
    fn agrees_with_the_standard_library_on_odd_forms() {
        for text in [
            "",
            "-",
            "+",
            ".",
            "-.",
            "1.",
            ".5",
            "-.5",
            "+1",
            "--1",
            "1e",
            "1e+",
            "1e5",
            "1E-5",
            "1.5e3",
            "e5",
            ".e1",
            "-0",
            "-0.0",
            "0e999999999999",
            "1e23",
            "1e22",
            "1e-22",
            "1e-23",
            "nan",
            "inf",
            "-infinity",
            "1e999",
            "9007199254740992",
            "9007199254740993",
            "99999999999999999999",
            "0.000000000000000000001",
            "123456789012345678901234567890.5",
            "1_000",
            "1,5",
            "0x10",
            " 1",
            "1 ",
            "5e-324",
            "2.2250738585072011e-308",
            "00000000000000000000000001.5",
            "１",
        ] {
            assert!(agrees(text), "{text:?}");
        }
    }

    #[test]
    fn a_comma_may_stand_for_the_point() {
        for (text, value) in [("0,5", 0.5), ("-691000,125", -691_000.125), (",5", 0.5), ("1,5e3", 1500.0)] {
            assert_eq!(parse_comma(text.as_bytes()), Some(value), "{text}");
        }
        for text in ["1,234,567", "1.234,5", "1,234.5", "1,", "1,x", "1, 2", ",", "", "5"] {
            assert_eq!(parse_comma(text.as_bytes()), None, "{text}");
        }
    }

    #[test]
    fn what_c_writes_for_no_number_is_none() {
        for text in ["-nan(ind)", "nan(snan)", "NaN(0x7ff)", "1.#QNAN", "-1.#IND", "-1.#IND00", "1.#SNAN"] {
            assert!(parse_f64(text.as_bytes()).is_some_and(f64::is_nan), "{text}");
        }
        assert_eq!(parse_f64(b"1.#INF"), Some(f64::INFINITY));
        assert_eq!(parse_f64(b"-1.#INF00"), Some(f64::NEG_INFINITY));
        for text in ["1.#", "1.#QNAN1", "nan(", "nano", "1.#INFX"] {
            assert_eq!(parse_f64(text.as_bytes()), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn agrees_with_the_standard_library(text in "[+-]?[0-9]{0,20}(\\.[0-9]{0,20})?([eE][+-]?[0-9]{0,5})?") {
            prop_assert!(agrees(&text), "{}", text);
        }

        #[test]
        fn agrees_on_coordinates(value in -1.0e7f64..1.0e7, decimals in 0usize..12) {
            let text = format!("{value:.decimals$}");
            prop_assert!(agrees(&text), "{}", text);
        }

        #[test]
        fn agrees_on_shortest_forms(value in any::<f64>()) {
            let (plain, scientific) = (format!("{value}"), format!("{value:e}"));
            prop_assert!(agrees(&plain) && agrees(&scientific));
        }

        #[test]
        fn agrees_on_any_bytes(text in proptest::collection::vec(any::<u8>(), 0..12)) {
            let expected = std::str::from_utf8(&text).ok().and_then(|t| t.parse::<f64>().ok());
            prop_assert_eq!(parse_f64(&text).map(f64::to_bits), expected.map(f64::to_bits));
        }
    }
}
