//! Nodes of a glTF file in double precision: the library reads them in single, which steps by half a metre at the size of UTM coordinates.

use gable_geometry::{DVec3, dvec3};
use serde::Deserialize;

/// What is read of the JSON besides what the library reads.
#[derive(Deserialize)]
struct Root {
    #[serde(default)]
    nodes: Vec<Node>,
    #[serde(default)]
    extensions: Extensions,
    #[serde(default)]
    textures: Vec<Texture>,
}

#[derive(Deserialize)]
struct Texture {
    source: Option<usize>,
    #[serde(default)]
    extensions: TextureExtensions,
}

/// Images of types that glTF itself does not know.
#[derive(Default, Deserialize)]
struct TextureExtensions {
    #[serde(rename = "EXT_texture_webp")]
    webp: Option<Image>,
    #[serde(rename = "KHR_texture_basisu")]
    basis: Option<Image>,
    #[serde(rename = "MSFT_texture_dds")]
    dds: Option<Image>,
}

#[derive(Deserialize)]
struct Image {
    source: Option<usize>,
}

impl Texture {
    /// The image that is most likely to be read.
    fn image(&self) -> Option<usize> {
        let more = &self.extensions;
        let others = [&more.webp, &more.basis, &more.dds].into_iter().flatten().filter_map(|image| image.source);
        self.source.into_iter().chain(others).next()
    }
}

#[derive(Deserialize)]
struct Node {
    matrix: Option<[f64; 16]>,
    translation: Option<[f64; 3]>,
    rotation: Option<[f64; 4]>,
    scale: Option<[f64; 3]>,
}

#[derive(Default, Deserialize)]
struct Extensions {
    #[serde(rename = "CESIUM_RTC")]
    rtc: Option<Rtc>,
}

#[derive(Deserialize)]
struct Rtc {
    center: [f64; 3],
}

/// Where the nodes of a file are.
#[derive(Debug, Default)]
pub(crate) struct Nodes {
    /// Matrices of the nodes, by columns.
    pub(crate) matrices: Vec<[[f64; 4]; 4]>,
    /// `CESIUM_RTC`: what all positions are relative to.
    pub(crate) centre: Option<DVec3>,
    /// The image of each texture.
    pub(crate) images: Vec<Option<usize>>,
}

impl Nodes {
    /// Reads them of the file's JSON.
    pub(crate) fn read(json: &[u8]) -> Result<Self, serde_json::Error> {
        let root: Root = serde_json::from_slice(json)?;
        let centre = root.extensions.rtc.map(|rtc| DVec3::from_array(rtc.center));
        let images = root.textures.iter().map(Texture::image).collect();
        Ok(Self { matrices: root.nodes.iter().map(matrix).collect(), centre, images })
    }
}

fn matrix(node: &Node) -> [[f64; 4]; 4] {
    if let Some(m) = &node.matrix {
        let column = |i: usize| [m[4 * i], m[4 * i + 1], m[4 * i + 2], m[4 * i + 3]];
        return [0, 1, 2, 3].map(column);
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let [sx, sy, sz] = node.scale.unwrap_or([1.0; 3]);
    let [tx, ty, tz] = node.translation.unwrap_or_default();
    [
        [sx * (1.0 - 2.0 * (y * y + z * z)), sx * 2.0 * (x * y + z * w), sx * 2.0 * (x * z - y * w), 0.0],
        [sy * 2.0 * (x * y - z * w), sy * (1.0 - 2.0 * (x * x + z * z)), sy * 2.0 * (y * z + x * w), 0.0],
        [sz * 2.0 * (x * z + y * w), sz * 2.0 * (y * z - x * w), sz * (1.0 - 2.0 * (x * x + y * y)), 0.0],
        [tx, ty, tz, 1.0],
    ]
}

/// Highest place that a city lies at, metres.
const HIGHEST: f64 = 12_000.0;

/// The centre of `CESIUM_RTC` in a world whose z is up.
///
/// It is added after y up was turned to z up, as Cesium does. Some programs write it in the frame of the positions all the same: where the
/// model is y up and the height would be that of no place on Earth, while that of the other reading is, it is turned like them.
pub(crate) fn world_centre(centre: DVec3, y_up: bool) -> DVec3 {
    if y_up && centre.z.abs() > HIGHEST && centre.y.abs() <= HIGHEST {
        dvec3(centre.x, -centre.z, centre.y)
    } else {
        centre
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_keep_their_digits() {
        let json = br#"{"nodes":[{"translation":[691000.123,40.5,-5334000.456]},{"rotation":[0.70710678118654757,0,0,0.70710678118654757],"scale":[2,2,2]},
            {"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,691000.123,1,2,1]},{}],"extensions":{"CESIUM_RTC":{"center":[691000.123,5334000.456,40]}}}"#;
        let nodes = Nodes::read(json).unwrap();
        assert_eq!(nodes.matrices[0][3], [691_000.123, 40.5, -5_334_000.456, 1.0]);
        // A quarter about x brings y to z.
        let [_, y, ..] = nodes.matrices[1];
        assert!((y[2] - 2.0).abs() < 1e-12 && y[1].abs() < 1e-12, "{y:?}");
        assert_eq!(nodes.matrices[2][3], [691_000.123, 1.0, 2.0, 1.0]);
        assert_eq!(nodes.matrices[3][0], [1.0, 0.0, 0.0, 0.0]);
        assert_eq!(nodes.centre, Some(dvec3(691_000.123, 5_334_000.456, 40.0)));
    }

    #[test]
    fn a_centre_is_read_in_the_frame_that_makes_sense() {
        let world = dvec3(691_000.0, 5_334_000.0, 40.0);
        assert_eq!(world_centre(world, true), world);
        assert_eq!(world_centre(dvec3(691_000.0, 40.0, -5_334_000.0), true), world);
        assert_eq!(world_centre(world, false), world);
        // Earth-centred: no reading is a height.
        let earth = dvec3(4.0e6, 6.0e5, 4.9e6);
        assert_eq!(world_centre(earth, true), earth);
    }
}
