//! A thin layer over the XML writer: elements by name, coordinates as exact decimals.

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, BytesEnd, BytesStart, BytesText, Event};
use std::fmt::Write as _;
use std::io::{self, Write};

pub(super) struct Xml<W: Write> {
    writer: Writer<W>,
    buffer: String,
}

impl<W: Write> Xml<W> {
    pub(super) fn new(out: W) -> io::Result<Self> {
        let mut writer = Writer::new_with_indent(out, b' ', 1);
        writer.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
        Ok(Self { writer, buffer: String::new() })
    }

    pub(super) fn open(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.writer.write_event(Event::Start(start))
    }

    pub(super) fn close(&mut self, name: &str) -> io::Result<()> {
        self.writer.write_event(Event::End(BytesEnd::new(name)))
    }

    pub(super) fn empty(&mut self, name: &str, attributes: &[(&str, &str)]) -> io::Result<()> {
        let start = BytesStart::new(name).with_attributes(attributes.iter().copied());
        self.writer.write_event(Event::Empty(start))
    }

    /// An element with text. Characters that XML does not allow become U+FFFD.
    pub(super) fn leaf(&mut self, name: &str, attributes: &[(&str, &str)], text: &str) -> io::Result<()> {
        let forbidden = |c: char| (c < ' ' && !"\t\n\r".contains(c)) || matches!(c, '\u{fffe}' | '\u{ffff}');
        let clean: std::borrow::Cow<'_, str> =
            if text.contains(forbidden) { text.replace(forbidden, "\u{fffd}").into() } else { text.into() };
        self.open(name, attributes)?;
        self.writer.write_event(Event::Text(BytesText::new(&clean)))?;
        self.close(name)
    }

    /// A closed ring of lattice points of the world.
    pub(super) fn ring(&mut self, points: impl Iterator<Item = [i64; 3]> + Clone) -> io::Result<()> {
        let mut text = std::mem::take(&mut self.buffer);
        text.clear();
        for p in points.clone().chain(points.take(1)) {
            for v in p {
                if !text.is_empty() {
                    text.push(' ');
                }
                decimal(&mut text, v);
            }
        }
        self.open("gml:LinearRing", &[])?;
        self.leaf("gml:posList", &[("srsDimension", "3")], &text)?;
        self.buffer = text;
        self.close("gml:LinearRing")
    }

    pub(super) fn finish(self) -> io::Result<W> {
        let mut out = self.writer.into_inner();
        out.write_all(b"\n")?;
        out.flush()?;
        Ok(out)
    }
}

/// Appends ten-thousandths of a metre as metres, without superfluous zeros.
pub(super) fn decimal(text: &mut String, v: i64) {
    let (whole, mut rest) = (v.unsigned_abs() / 10_000, v.unsigned_abs() % 10_000);
    let sign = if v < 0 { "-" } else { "" };
    // Writing to a string cannot fail.
    let _ = if rest == 0 {
        write!(text, "{sign}{whole}")
    } else {
        let mut digits = 4;
        while rest % 10 == 0 {
            rest /= 10;
            digits -= 1;
        }
        write!(text, "{sign}{whole}.{rest:0digits$}")
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact_and_short() {
        for (v, expected) in
            [(0, "0"), (1, "0.0001"), (-1, "-0.0001"), (850_001_230, "85000.123"), (-25_000, "-2.5"), (70_000, "7")]
        {
            let mut text = String::new();
            decimal(&mut text, v);
            assert_eq!(text, expected);
            assert_eq!(text.parse::<f64>().unwrap(), v as f64 / 1e4);
        }
    }
}
