//! Attributes as property tables of `EXT_structural_metadata`.

use super::glb::Glb;
use crate::{Attributes, Value as Attribute};
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;

/// Stands for a number that is not there.
const NO_NUMBER: f64 = -9999.0;

/// A class and its table, under way.
#[derive(Debug, Default)]
pub(super) struct Table {
    class: Map<String, Value>,
    columns: Map<String, Value>,
    count: usize,
}

impl Table {
    pub(super) fn new(count: usize) -> Self {
        Self { count, ..Self::default() }
    }

    /// A column of texts, none of which is missing.
    pub(super) fn texts(&mut self, glb: &mut Glb, name: &str, values: &[&str], about: &str) {
        self.class.insert(name.to_owned(), json!({ "type": "STRING", "required": true, "description": about }));
        self.column_of_texts(glb, name, values);
    }

    /// A column of the values of an enumeration.
    pub(super) fn kinds(&mut self, glb: &mut Glb, name: &str, kind: &str, values: &[u8], about: &str) {
        let property = json!({ "type": "ENUM", "enumType": kind, "required": true, "description": about });
        self.class.insert(name.to_owned(), property);
        let view = glb.view(values, None);
        self.columns.insert(name.to_owned(), json!({ "values": view }));
    }

    /// A column of whole numbers.
    pub(super) fn numbers(&mut self, glb: &mut Glb, name: &str, values: &[u32], about: &str) {
        let property = json!({ "type": "SCALAR", "componentType": "UINT32", "required": true, "description": about });
        self.class.insert(name.to_owned(), property);
        let bytes: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
        let view = glb.view(&bytes, None);
        self.columns.insert(name.to_owned(), json!({ "values": view }));
    }

    /// A column for each attribute that any row has: numbers as FLOAT64, all else as text.
    pub(super) fn attributes(&mut self, glb: &mut Glb, rows: &[&Attributes]) {
        let names: BTreeSet<&String> = rows.iter().flat_map(|row| row.keys()).collect();
        for name in names {
            let id = property_id(name);
            if self.class.contains_key(&id) {
                continue;
            }
            let cells: Vec<Option<&Attribute>> = rows.iter().map(|row| row.get(name)).collect();
            let number = |cell: &Attribute| match cell {
                Attribute::Integer(v) => Some(*v as f64),
                Attribute::Number(v) => Some(*v),
                Attribute::Bool(_) | Attribute::Text(_) => None,
            };
            if cells.iter().flatten().all(|cell| number(cell).is_some_and(f64::is_finite)) {
                let values = cells.iter().map(|cell| cell.and_then(number).unwrap_or(NO_NUMBER));
                let view = glb.view(&values.flat_map(f64::to_le_bytes).collect::<Vec<u8>>(), None);
                let property = json!({
                    "type": "SCALAR", "componentType": "FLOAT64", "name": name, "noData": NO_NUMBER,
                });
                self.class.insert(id.clone(), property);
                self.columns.insert(id, json!({ "values": view }));
                continue;
            }
            let texts: Vec<String> = cells.iter().map(|cell| cell.map(text).unwrap_or_default()).collect();
            // A view may not be empty, and a column of nothing tells nothing.
            if texts.iter().all(String::is_empty) {
                continue;
            }
            self.class.insert(id.clone(), json!({ "type": "STRING", "name": name, "noData": "" }));
            let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
            self.column_of_texts(glb, &id, &texts);
        }
    }

    fn column_of_texts(&mut self, glb: &mut Glb, name: &str, values: &[&str]) {
        let mut offsets = vec![0_u32];
        let mut bytes = Vec::new();
        for value in values {
            bytes.extend(value.as_bytes());
            offsets.push(bytes.len() as u32);
        }
        let values = glb.view(&bytes, None);
        let offsets = glb.view(&offsets.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>(), None);
        self.columns.insert(name.to_owned(), json!({ "values": values, "stringOffsets": offsets }));
    }

    /// The class, and the table.
    pub(super) fn finish(self, class: &str) -> (Value, Value) {
        let table = json!({ "class": class, "name": class, "count": self.count, "properties": self.columns });
        (json!({ "properties": self.class }), table)
    }
}

fn text(value: &Attribute) -> String {
    match value {
        Attribute::Bool(v) => v.to_string(),
        Attribute::Integer(v) => v.to_string(),
        Attribute::Number(v) => v.to_string(),
        Attribute::Text(v) => v.clone(),
    }
}

/// A name as identifiers of properties may be: letters, digits and underscores, no digit first.
fn property_id(name: &str) -> String {
    let id: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    if id.starts_with(|c: char| c.is_ascii_digit()) || id.is_empty() { format!("_{id}") } else { id }
}
