//! Well-known text, versions 1 and 2, as a tree. It is not checked any further: programs write it in many dialects.

/// Keywords inside of each other: real texts have about eight.
const DEPTH: usize = 32;

/// A keyword with what stands in its brackets.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Node {
    /// In capitals.
    pub(crate) keyword: String,
    /// Texts and numbers, in order.
    pub(crate) values: Vec<String>,
    /// What is nested, in order.
    pub(crate) children: Vec<Node>,
}

impl Node {
    /// The tree of a text; `None` if it is not whole.
    pub(crate) fn parse(text: &str) -> Option<Self> {
        let mut rest = text.trim();
        let node = node(&mut rest, DEPTH)?;
        rest.trim().is_empty().then_some(node)
    }

    /// The name: the first text.
    pub(crate) fn name(&self) -> &str {
        self.values.first().map_or("", String::as_str)
    }

    /// What is directly inside under one of some keywords.
    pub(crate) fn inside<'a>(&'a self, keywords: &'a [&str]) -> impl DoubleEndedIterator<Item = &'a Self> {
        self.children.iter().filter(|child| keywords.contains(&child.keyword.as_str()))
    }

    /// The code of EPSG that the whole has: what is nested deeper is the code of a part.
    pub(crate) fn epsg(&self) -> Option<u32> {
        let own = self.inside(&["AUTHORITY", "ID"]).find(|id| id.name().eq_ignore_ascii_case("EPSG"))?;
        own.values.get(1)?.parse().ok()
    }
}

fn node(rest: &mut &str, depth: usize) -> Option<Node> {
    let end = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_')?;
    let (keyword, after) = rest.split_at(end);
    if keyword.is_empty() || depth == 0 {
        return None;
    }
    let after = after.trim_start();
    let close = match after.chars().next()? {
        '[' => ']',
        '(' => ')',
        _ => return None,
    };
    *rest = after[1..].trim_start();
    let mut found = Node { keyword: keyword.to_ascii_uppercase(), ..Node::default() };
    loop {
        match rest.chars().next()? {
            c if c == close => {
                *rest = &rest[1..];
                return Some(found);
            }
            ',' => *rest = rest[1..].trim_start(),
            '"' => found.values.push(quoted(rest)?),
            ']' | ')' => return None,
            _ => {
                let end = rest.find([',', '[', '(', ']', ')'])?;
                if matches!(rest.as_bytes()[end], b'[' | b'(') {
                    found.children.push(node(rest, depth - 1)?);
                } else {
                    found.values.push(rest[..end].trim().to_owned());
                    *rest = &rest[end..];
                }
            }
        }
        *rest = rest.trim_start();
    }
}

/// A text in quotation marks, of which two stand for one.
fn quoted(rest: &mut &str) -> Option<String> {
    let mut text = String::new();
    let mut after = rest.strip_prefix('"')?;
    loop {
        let end = after.find('"')?;
        text += &after[..end];
        after = &after[end + 1..];
        match after.strip_prefix('"') {
            Some(more) => {
                text.push('"');
                after = more;
            }
            None => {
                *rest = after;
                return Some(text);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_code_of_the_whole_counts() {
        let whole = Node::parse(
            "PROJCS[\"a \"\"b\"\"\", GEOGCS(\"g\",AUTHORITY(\"EPSG\",\"4258\")),UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]],\n AUTHORITY[\"EPSG\",\"25832\"]]",
        )
        .unwrap();
        assert_eq!((whole.name(), whole.epsg()), ("a \"b\"", Some(25832)));
        assert_eq!(whole.inside(&["GEOGCS"]).next().unwrap().epsg(), Some(4258));
        let part = Node::parse("PROJCS[\"a\",UNIT[\"metre\",1,AUTHORITY[\"EPSG\",\"9001\"]]]").unwrap();
        assert_eq!(part.epsg(), None);
        assert_eq!(Node::parse("PROJCRS[\"a\",CS[Cartesian,2],ID[\"EPSG\",25832]]").unwrap().epsg(), Some(25832));
    }

    #[test]
    fn what_is_cut_or_endless_is_nothing() {
        for text in [
            "",
            "PROJCS",
            "PROJCS[",
            "PROJCS[\"a",
            "PROJCS[\"a\"",
            "PROJCS[\"a\"]x",
            "[\"a\"]",
            "A(\"b\"]",
            "Straße[1]",
        ] {
            assert_eq!(Node::parse(text), None, "{text}");
        }
        assert_eq!(Node::parse(&"A[".repeat(100_000)), None);
    }
}
