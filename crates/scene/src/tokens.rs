//! A text file word by word, for formats whose lines need not be kept together.

use crate::error::{Place, SceneError, shown};
use crate::number::{parse_comma, parse_f64};
use std::io::BufRead;
use std::path::Path;

/// Longest word that is read; a longer one is a sign of a file that is not text.
const LONGEST: usize = 4096;

/// Reads words that blanks and line ends part.
pub(crate) struct Tokens<'a, R> {
    path: &'a Path,
    reader: R,
    /// Byte from which to the end of the line all is comment.
    comment: Option<u8>,
    /// Line of the next byte, from 1.
    line: u64,
    /// Whether the last line ended with CR, after which LF is no further line.
    after_return: bool,
    word: Vec<u8>,
    /// Whether the word is to be given again.
    again: bool,
    /// Numbers with a comma in place of their point.
    pub(crate) commas: u64,
}

impl<'a, R: BufRead> Tokens<'a, R> {
    /// Starts at a line, counted from 1.
    pub(crate) fn new(path: &'a Path, reader: R, comment: Option<u8>, line: u64) -> Self {
        Self { path, reader, comment, line, after_return: false, word: Vec::new(), again: false, commas: 0 }
    }

    /// The line of the last word, or of the next if that is on another.
    pub(crate) fn place(&self) -> Place {
        Place::Line(self.line)
    }

    /// Gives the last word once more.
    pub(crate) fn again(&mut self) {
        self.again = true;
    }

    /// The next word; `None` at the end of the file, which zero bytes are, too, or, with `same_line`, of the line.
    pub(crate) fn next(&mut self, same_line: bool) -> Result<Option<&[u8]>, SceneError> {
        if std::mem::take(&mut self.again) {
            return Ok(Some(self.word.as_slice()));
        }
        self.word.clear();
        let mut comment = false;
        loop {
            let buffer = self.reader.fill_buf().map_err(|e| SceneError::read(self.path, e))?;
            if buffer.is_empty() {
                break;
            }
            let mut used = 0;
            let mut done = false;
            for &byte in buffer {
                let rest_of_line_end = self.after_return && byte == b'\n';
                self.after_return &= rest_of_line_end;
                if rest_of_line_end {
                    self.after_return = false;
                } else if matches!(byte, b'\n' | b'\r') {
                    if !self.word.is_empty() || same_line {
                        done = true;
                        break;
                    }
                    self.line += 1;
                    self.after_return = byte == b'\r';
                    comment = false;
                } else if byte == 0 {
                    done = true;
                    break;
                } else if comment {
                } else if byte.is_ascii_whitespace() {
                    if !self.word.is_empty() {
                        done = true;
                        break;
                    }
                } else if Some(byte) == self.comment {
                    if !self.word.is_empty() {
                        done = true;
                        break;
                    }
                    comment = true;
                } else {
                    self.word.push(byte);
                }
                used += 1;
            }
            self.reader.consume(used);
            if done {
                break;
            }
            if self.word.len() > LONGEST {
                let word = shown(&self.word);
                return Err(SceneError::syntax(self.path, self.place(), format!("{word} is no number")));
            }
        }
        Ok((!self.word.is_empty()).then_some(self.word.as_slice()))
    }

    /// Passes over the rest of the line.
    pub(crate) fn skip_line(&mut self) -> Result<(), SceneError> {
        while self.next(true)?.is_some() {}
        Ok(())
    }

    /// The next word as a number; an error that says `what` was expected otherwise.
    pub(crate) fn number(&mut self, what: &str) -> Result<f64, SceneError> {
        let mut comma = false;
        let mut with_comma = |word: &[u8]| {
            comma = true;
            parse_comma(word)
        };
        let parsed =
            self.next(false)?.map(|word| parse_f64(word).or_else(|| with_comma(word)).ok_or_else(|| shown(word)));
        self.commas += u64::from(comma);
        match parsed {
            Some(Ok(value)) => Ok(value),
            Some(Err(word)) => {
                Err(SceneError::syntax(self.path, self.place(), format!("{word} stands where {what} is expected")))
            }
            None => Err(SceneError::truncated(self.path, self.place(), format!("where {what} is expected"))),
        }
    }

    /// The next number on this line, if the line has one more word and it is a number.
    pub(crate) fn number_on_line(&mut self) -> Result<Option<f64>, SceneError> {
        Ok(self.next(true)?.and_then(|word| parse_f64(word).or_else(|| parse_comma(word))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_lines_and_comments_are_told_apart() {
        let text = b"a b # c\n\n  d#e\nf 1.5 x";
        for capacity in [1, 2, 3, 100] {
            let reader = std::io::BufReader::with_capacity(capacity, text.as_slice());
            let mut tokens = Tokens::new(Path::new("t"), reader, Some(b'#'), 1);
            let mut next = |same_line| {
                let word = tokens.next(same_line).expect("reads").map(|w| String::from_utf8_lossy(w).into_owned());
                let Place::Line(line) = tokens.place() else { unreachable!() };
                (word, line)
            };
            let some = |word: &str, line: u64| (Some(word.to_owned()), line);
            assert_eq!(next(false), some("a", 1));
            assert_eq!(next(true), some("b", 1));
            assert_eq!(next(true), (None, 1));
            assert_eq!(next(false), some("d", 3));
            assert_eq!(next(true), (None, 3));
            assert_eq!(next(false), some("f", 4));
            assert_eq!(tokens.number("n").expect("a number"), 1.5);
            let error = tokens.number("n").expect_err("no number").to_string();
            assert_eq!(error, "t: line 4: \"x\" stands where n is expected");
            let error = tokens.number("n").expect_err("the end").to_string();
            assert!(error.starts_with("t: line 4: the file ends too early, where n is expected"), "{error}");
        }
    }
}
