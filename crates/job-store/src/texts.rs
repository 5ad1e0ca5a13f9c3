//! Texts that come from what others have made: meshes, programs, errors.

/// A text as it can be kept: Postgres has no NUL in one. What is told to people has no other control characters either.
pub(crate) fn kept(text: &str) -> String {
    text.replace(|c: char| c.is_control() && !matches!(c, '\n' | '\t'), "\u{fffd}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_can_be_kept() {
        assert_eq!(kept("a\0b\u{1b}[31m\n\tc"), "a\u{fffd}b\u{fffd}[31m\n\tc");
        assert_eq!(kept("São\n"), "São\n");
    }
}
