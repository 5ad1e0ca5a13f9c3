//! Putting a GLB together.

use serde_json::{Value, json};

/// What a buffer view is for, as glTF numbers it.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Target {
    Vertices = 34962,
    Indices = 34963,
}

/// The parts of a GLB: its binary chunk with views and accessors into it.
#[derive(Debug, Default)]
pub(crate) struct Glb {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Glb {
    /// Adds bytes as a view; gives its number. All views begin at multiples of eight, as tables of metadata ask.
    pub(crate) fn view(&mut self, bytes: &[u8], target: Option<Target>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(8), 0);
        let mut view = json!({ "buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len() });
        if let Some(target) = target {
            view["target"] = json!(target as u32);
        }
        self.bytes.extend_from_slice(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    /// Adds vectors of floats; gives the number of the accessor.
    pub(crate) fn vectors<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|v| v.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(Target::Vertices));
        let kind = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        let extreme = |pick: fn(f32, f32) -> f32, from: f32| -> Vec<f64> {
            (0..N).map(|i| f64::from(values.iter().fold(from, |m, v| pick(m, v[i])))).collect()
        };
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5126, "count": values.len(), "type": kind,
            "min": extreme(f32::min, f32::INFINITY), "max": extreme(f32::max, f32::NEG_INFINITY),
        }));
        self.accessors.len() - 1
    }

    /// Adds colours; gives the number of the accessor.
    pub(crate) fn colours(&mut self, values: &[[u8; 4]]) -> usize {
        let view = self.view(&values.concat(), Some(Target::Vertices));
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5121, "normalized": true, "count": values.len(), "type": "VEC4",
        }));
        self.accessors.len() - 1
    }

    /// Adds colours in linear light, opaque; gives the number of the accessor. A byte would not tell dark colours apart.
    pub(crate) fn light(&mut self, values: &[[u16; 3]]) -> usize {
        let bytes: Vec<u8> =
            values.iter().flat_map(|&[r, g, b]| [r, g, b, u16::MAX]).flat_map(u16::to_le_bytes).collect();
        let view = self.view(&bytes, Some(Target::Vertices));
        self.accessors.push(json!({
            "bufferView": view, "componentType": 5123, "normalized": true, "count": values.len(), "type": "VEC4",
        }));
        self.accessors.len() - 1
    }

    /// Adds indices, in two bytes where that is enough; gives the number of the accessor.
    pub(crate) fn indices(&mut self, values: &[u32]) -> usize {
        // The largest number of either width is kept for ends of strips.
        let short = values.iter().all(|&v| v < u32::from(u16::MAX));
        let bytes: Vec<u8> = match short {
            true => values.iter().flat_map(|&v| (v as u16).to_le_bytes()).collect(),
            false => values.iter().flat_map(|v| v.to_le_bytes()).collect(),
        };
        let view = self.view(&bytes, Some(Target::Indices));
        self.accessors.push(json!({
            "bufferView": view, "componentType": if short { 5123 } else { 5125 }, "count": values.len(), "type": "SCALAR",
        }));
        self.accessors.len() - 1
    }

    /// The file, `document` being the rest of its JSON.
    pub(crate) fn finish(mut self, mut document: Value) -> Vec<u8> {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        document["asset"] = json!({ "version": "2.0", "generator": concat!("gable ", env!("CARGO_PKG_VERSION")) });
        document["buffers"] = json!([{ "byteLength": self.bytes.len() }]);
        document["bufferViews"] = self.views.into();
        document["accessors"] = self.accessors.into();
        let mut json = document.to_string().into_bytes();
        // A content that begins at a multiple of eight keeps the alignment of its views inside other files.
        json.resize(json.len().next_multiple_of(8) + 4, b' ');
        let total = 12 + 8 + json.len() + 8 + self.bytes.len();
        let mut out = Vec::with_capacity(total);
        out.extend(b"glTF");
        out.extend(2_u32.to_le_bytes());
        out.extend((total as u32).to_le_bytes());
        out.extend((json.len() as u32).to_le_bytes());
        out.extend(b"JSON");
        out.extend(&json);
        out.extend((self.bytes.len() as u32).to_le_bytes());
        out.extend(b"BIN\0");
        out.extend(&self.bytes);
        out
    }
}
