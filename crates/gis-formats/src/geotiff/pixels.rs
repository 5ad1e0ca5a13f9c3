//! What a pixel is: how it is described, halved and packed.

use super::container::{Directory, Value};
use super::{NO_HEIGHT, TILE};
use flate2::Compression;
use flate2::write::ZlibEncoder;
use std::fmt::Write as _;
use std::io::{self, Write as _};

/// A class of a raster of classes.
#[derive(Clone, Debug, PartialEq)]
pub struct Class {
    /// Its number.
    pub value: u8,
    /// Its name.
    pub name: String,
    /// Its colour in pictures.
    pub colour: [u8; 3],
}

/// What a pixel is.
#[derive(Clone, Debug, PartialEq)]
pub enum PixelKind {
    /// A colour, sRGB, with its opacity.
    Colour,
    /// A height in metres, or [`NO_HEIGHT`].
    Height,
    /// One of these classes, or 255.
    Class(Vec<Class>),
}

/// No class.
const NO_CLASS: u8 = 255;

/// The pixels of a tile, row by row from the north.
#[derive(Clone, Debug, PartialEq)]
pub enum Pixels {
    /// Red, green, blue, opacity.
    Colours(Vec<[u8; 4]>),
    /// Heights in metres; [`NO_HEIGHT`] where there is none.
    Heights(Vec<f32>),
    /// Numbers of classes; 255 where there is none.
    Classes(Vec<u8>),
}

impl PixelKind {
    /// A tile where nothing is.
    pub(super) fn blank(&self) -> Pixels {
        match self {
            Self::Colour => Pixels::Colours(vec![[0; 4]; TILE * TILE]),
            Self::Height => Pixels::Heights(vec![NO_HEIGHT; TILE * TILE]),
            Self::Class(_) => Pixels::Classes(vec![NO_CLASS; TILE * TILE]),
        }
    }

    /// The tags that tell what a pixel is.
    pub(super) fn describe(&self, directory: &mut Directory) {
        let short = |values: &[u16]| Value::Short(values.to_vec());
        // Deflate as zlib writes it.
        directory.put(259, short(&[8]));
        match self {
            Self::Colour => {
                directory.put(258, short(&[8; 4]));
                directory.put(262, short(&[2]));
                directory.put(277, short(&[4]));
                directory.put(317, short(&[2]));
                // The fourth sample is opacity that the colours are not multiplied by.
                directory.put(338, short(&[2]));
                directory.put(339, short(&[1; 4]));
            }
            Self::Height => {
                directory.put(258, short(&[32]));
                directory.put(262, short(&[1]));
                directory.put(277, short(&[1]));
                directory.put(317, short(&[3]));
                directory.put(339, short(&[3]));
                directory.put(42113, Value::Ascii(NO_HEIGHT.to_string()));
            }
            Self::Class(classes) => {
                directory.put(258, short(&[8]));
                directory.put(262, short(&[3]));
                directory.put(277, short(&[1]));
                directory.put(317, short(&[1]));
                // All red, then all green, then all blue.
                let mut colours = vec![0; 3 * 256];
                for class in classes {
                    for (channel, &v) in class.colour.iter().enumerate() {
                        colours[channel * 256 + usize::from(class.value)] = u16::from(v) * 257;
                    }
                }
                directory.put(320, Value::Short(colours));
                directory.put(339, short(&[1]));
                directory.put(42113, Value::Ascii(NO_CLASS.to_string()));
            }
        }
    }

    /// What GDAL reads beside the pixels.
    pub(super) fn metadata(&self, description: &str) -> String {
        let mut out = "<GDALMetadata>\n".to_owned();
        let escaped = |text: &str| text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;");
        // Writing to a string cannot fail.
        if *self == Self::Colour {
            let _ = writeln!(out, "<Item name=\"DESCRIPTION\">{}</Item>", escaped(description));
        } else {
            let text = escaped(description);
            let _ = writeln!(out, "<Item name=\"DESCRIPTION\" sample=\"0\" role=\"description\">{text}</Item>");
        }
        if *self == Self::Height {
            out.push_str("<Item name=\"UNITTYPE\" sample=\"0\" role=\"unittype\">metre</Item>\n");
        }
        if let Self::Class(classes) = self {
            for class in classes {
                let name = escaped(&class.name);
                let _ = writeln!(out, "<Item name=\"CLASS_{}\" sample=\"0\">{name}</Item>", class.value);
            }
        }
        out.push_str("</GDALMetadata>\n");
        out
    }
}

impl Pixels {
    /// Puts half of a tile's size in its place in a tile of the overview: `right` and `down` say in which quarter.
    pub(super) fn put_halved(&mut self, fine: &Self, right: bool, down: bool) {
        const HALF: usize = TILE / 2;
        for row in 0..HALF {
            let to = (row + if down { HALF } else { 0 }) * TILE + if right { HALF } else { 0 };
            for column in 0..HALF {
                let first = 2 * row * TILE + 2 * column;
                let four = [first, first + 1, first + TILE, first + TILE + 1];
                match (&mut *self, fine) {
                    (Self::Colours(coarse), Self::Colours(fine)) => coarse[to + column] = colour(four.map(|i| fine[i])),
                    (Self::Heights(coarse), Self::Heights(fine)) => coarse[to + column] = height(four.map(|i| fine[i])),
                    (Self::Classes(coarse), Self::Classes(fine)) => coarse[to + column] = class(four.map(|i| fine[i])),
                    // A layer is of one kind.
                    _ => {}
                }
            }
        }
    }

    /// Differences of neighbours, which are small, deflated.
    pub(super) fn packed(&self) -> io::Result<Vec<u8>> {
        let mut bytes = Vec::new();
        match self {
            Self::Colours(pixels) => {
                for row in pixels.chunks(TILE) {
                    let mut before = [0_u8; 4];
                    for &pixel in row {
                        bytes.extend((0..4).map(|i| pixel[i].wrapping_sub(before[i])));
                        before = pixel;
                    }
                }
            }
            Self::Heights(pixels) => {
                for row in pixels.chunks(TILE) {
                    // The first bytes of all numbers, then the second ones, and so on.
                    let mut before = 0_u8;
                    for byte in 0..4 {
                        for pixel in row {
                            let here = pixel.to_be_bytes()[byte];
                            bytes.push(here.wrapping_sub(before));
                            before = here;
                        }
                    }
                }
            }
            Self::Classes(pixels) => bytes.extend(pixels),
        }
        let mut encoder = ZlibEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(&bytes)?;
        encoder.finish()
    }
}

/// The mean of what is to be seen.
fn colour(four: [[u8; 4]; 4]) -> [u8; 4] {
    let opacity: u32 = four.iter().map(|p| u32::from(p[3])).sum();
    if opacity == 0 {
        return [0; 4];
    }
    let mean = |i: usize| {
        let sum: u32 = four.iter().map(|p| u32::from(p[i]) * u32::from(p[3])).sum();
        ((sum + opacity / 2) / opacity) as u8
    };
    [mean(0), mean(1), mean(2), ((opacity + 2) / 4) as u8]
}

/// The mean of the heights that there are.
fn height(four: [f32; 4]) -> f32 {
    let known = four.iter().filter(|&&z| z != NO_HEIGHT);
    let count = known.clone().count();
    if count == 0 { NO_HEIGHT } else { rounded(known.map(|&z| f64::from(z)).sum::<f64>() / count as f64) }
}

/// The class that most have; of several, the one of the lowest number.
fn class(four: [u8; 4]) -> u8 {
    let count = |value: u8| four.iter().filter(|&&v| v == value && v != NO_CLASS).count();
    let mut best = four[0];
    for value in four {
        if count(value) > count(best) || (count(value) == count(best) && value < best) {
            best = value;
        }
    }
    best
}

/// A height in steps of 2⁻¹⁰ m: finer than any mesh, and few digits to pack.
#[must_use]
pub(crate) fn rounded(height: f64) -> f32 {
    ((height * 1024.0).round() / 1024.0) as f32
}
