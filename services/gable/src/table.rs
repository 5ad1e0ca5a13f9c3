//! Plain tables at the terminal.

use std::fmt::Write as _;

/// Lays out rows in columns; the first row is the head. Columns whose cells below the head are all numbers
/// are aligned to the right.
pub(crate) fn render(rows: &[Vec<String>]) -> String {
    let columns = rows.iter().map(Vec::len).max().unwrap_or(0);
    let cell = |row: &[String], c: usize| row.get(c).cloned().unwrap_or_default();
    let width = |c: usize| rows.iter().map(|r| cell(r, c).chars().count()).max().unwrap_or(0);
    let numeric = |c: usize| {
        rows.len() > 1
            && rows[1..].iter().all(|r| {
                let text = cell(r, c);
                text.is_empty() || text == "-" || text.starts_with(|d: char| d.is_ascii_digit() || d == '-')
            })
    };
    let layout: Vec<_> = (0..columns).map(|c| (width(c), numeric(c))).collect();
    let mut text = String::new();
    for (index, row) in rows.iter().enumerate() {
        let mut line = String::new();
        for (c, &(width, right)) in layout.iter().enumerate() {
            let value = cell(row, c);
            let gap = if c == 0 { "" } else { "  " };
            // Writing to a String cannot fail.
            let _ = if right { write!(line, "{gap}{value:>width$}") } else { write!(line, "{gap}{value:<width$}") };
        }
        text += line.trim_end();
        text.push('\n');
        if index == 0 {
            let rule: Vec<_> = layout.iter().map(|(width, _)| "-".repeat(*width)).collect();
            text += &rule.join("  ");
            text.push('\n');
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_to_the_right() {
        let rows = [["name", "m"], ["a", "1.5"], ["bcd", "12.25"]].map(|r| r.map(str::to_owned).to_vec());
        assert_eq!(render(&rows), "name      m\n----  -----\na       1.5\nbcd   12.25\n");
    }
}
