//! What may be the name of a city, a member, a token or a schedule.

/// Longest name, bytes.
pub(crate) const LONGEST: usize = 200;

/// Whether a text may be a name: people see all of it, in the order in which it stands, and it is no step in a path.
///
/// Refused are control characters, marks that turn the direction of what stands beside them, characters without width that make two
/// names look the same (those that join letters are part of some scripts, and may be), line breaks, and the names `.` and `..`.
#[must_use]
pub fn is_name(text: &str) -> bool {
    let of_a_length = !text.trim().is_empty() && text.len() <= LONGEST;
    of_a_length && !matches!(text.trim(), "." | "..") && !text.chars().any(is_unseen)
}

/// Whether a character shows nothing of itself, and changes how others look or where a line ends.
fn is_unseen(c: char) -> bool {
    let turns = matches!(c, '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}');
    let no_width = matches!(c, '\u{ad}' | '\u{180e}' | '\u{200b}' | '\u{2060}'..='\u{2064}' | '\u{206a}'..='\u{206f}' | '\u{feff}');
    let breaks = matches!(c, '\u{2028}' | '\u{2029}');
    // Tags, which repeat ASCII without showing it.
    let tags = matches!(c, '\u{e0000}'..='\u{e007f}');
    c.is_control() || turns || no_width || breaks || tags
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_what_they_look_like() {
        for good in ["delft", "São Paulo", "東京", "a/b", "…", "...", ".a", "می\u{200c}خواهم", "x y"] {
            assert!(is_name(good), "{good:?}");
        }
        let bad =
            ["", " ", ".", "..", " .. ", "a\0", "a\nb", "a\u{85}", "abc\u{202e}txt.exe", "a\u{200f}", "a\u{2066}b"];
        for bad in bad.into_iter().chain(["a\u{200b}", "\u{feff}a", "a\u{2028}b", "a\u{61c}", "a\u{e0041}", "a\u{ad}b"])
        {
            assert!(!is_name(bad), "{bad:?}");
        }
        assert!(is_name(&"x".repeat(200)) && !is_name(&"x".repeat(201)));
    }
}
