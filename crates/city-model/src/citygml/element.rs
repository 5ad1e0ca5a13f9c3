//! Elements of a document, one city object at a time.

use quick_xml::Reader;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};

/// Deeper nesting than any city object needs; refused, so that a hostile file cannot exhaust the stack.
const DEPTH: usize = 64;

/// An element with its content. Names are without prefixes.
#[derive(Debug, Default)]
pub(super) struct Element {
    pub(super) name: String,
    pub(super) attributes: Vec<(String, String)>,
    pub(super) children: Vec<Element>,
    /// Text between the children, joined.
    pub(super) text: String,
    /// Where in the file it ends its start tag, bytes.
    pub(super) offset: u64,
}

impl Element {
    pub(super) fn attribute(&self, name: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == name).map(|(_, value)| value.as_str())
    }

    pub(super) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|child| child.name == name)
    }

    /// This element and all below it, in the order of the file.
    pub(super) fn descendants(&self) -> Vec<&Self> {
        let mut found = Vec::new();
        let mut stack = vec![self];
        while let Some(element) = stack.pop() {
            found.push(element);
            stack.extend(element.children.iter().rev());
        }
        found
    }
}

/// Where and why a document could not be read.
pub(super) struct XmlError {
    pub(super) offset: u64,
    pub(super) reason: String,
}

/// Calls `visit` with every element whose name is in `wanted` (not with those inside it) and with the names of the
/// elements around it, and forgets it then. The root's name is returned.
pub(super) fn for_each<E: From<XmlError>>(
    text: &str,
    wanted: &[&str],
    mut visit: impl FnMut(Element) -> Result<(), E>,
) -> Result<String, E> {
    let mut reader = Reader::from_str(text);
    let mut root = String::new();
    // Open elements inside a wanted one; outside, only their number counts.
    let mut open: Vec<Element> = Vec::new();
    let mut outside = 0usize;
    loop {
        let failed = |reader: &Reader<&[u8]>, reason: String| XmlError { offset: reader.buffer_position(), reason };
        let event =
            reader.read_event().map_err(|e| XmlError { offset: reader.error_position(), reason: e.to_string() })?;
        match event {
            Event::Start(start) => {
                let name = start.local_name().as_ref().to_owned();
                if root.is_empty() {
                    root.clone_from(&name);
                }
                if open.is_empty() && !wanted.contains(&name.as_str()) {
                    outside += 1;
                } else {
                    if open.len() >= DEPTH {
                        return Err(failed(&reader, format!("elements are nested deeper than {DEPTH}")).into());
                    }
                    open.push(element(&start, reader.buffer_position())?);
                }
            }
            Event::Empty(start) => {
                let name = start.local_name();
                if root.is_empty() {
                    root = name.as_ref().to_owned();
                }
                let this = || element(&start, reader.buffer_position());
                match open.last_mut() {
                    Some(parent) => parent.children.push(this()?),
                    None if wanted.contains(&name.as_ref()) => visit(this()?)?,
                    None => {}
                }
            }
            Event::End(_) => match open.pop() {
                Some(done) => match open.last_mut() {
                    Some(parent) => parent.children.push(done),
                    None => visit(done)?,
                },
                None => outside = outside.saturating_sub(1),
            },
            Event::Text(text) => {
                if let Some(at) = open.last_mut() {
                    at.text.push_str(&text.xml10_content());
                }
            }
            Event::CData(text) => {
                if let Some(at) = open.last_mut() {
                    at.text.push_str(&text.xml10_content());
                }
            }
            Event::GeneralRef(reference) => {
                let resolved = match reference.resolve_char_ref() {
                    Ok(Some(c)) => Some(c.to_string()),
                    Ok(None) => {
                        quick_xml::escape::resolve_predefined_entity(&reference.xml10_content()).map(str::to_owned)
                    }
                    Err(_) => None,
                };
                let Some(resolved) = resolved else {
                    return Err(failed(&reader, "an entity is not known".to_owned()).into());
                };
                if let Some(at) = open.last_mut() {
                    at.text.push_str(&resolved);
                }
            }
            Event::Eof => {
                if !open.is_empty() || outside > 0 {
                    return Err(failed(&reader, "the file ends inside an element".to_owned()).into());
                }
                return Ok(root);
            }
            Event::Comment(_) | Event::Decl(_) | Event::PI(_) | Event::DocType(_) => {}
        }
    }
}

fn element(start: &BytesStart<'_>, offset: u64) -> Result<Element, XmlError> {
    let failed = |reason: String| XmlError { offset, reason };
    let mut attributes = Vec::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|e| failed(e.to_string()))?;
        let value = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|e| failed(e.to_string()))?;
        attributes.push((attribute.key.local_name().as_ref().to_owned(), value.into_owned()));
    }
    let name = start.local_name().as_ref().to_owned();
    Ok(Element { name, attributes, offset, ..Element::default() })
}
