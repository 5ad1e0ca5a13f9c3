//! Files as the crate `tiff` reads them.

use super::*;
use gable_geometry::Crs;
use std::io::{Cursor, Read as _};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

const WIDTH: usize = 3 * TILE + 40;
const HEIGHT: usize = TILE + 100;

fn layers() -> Vec<RasterLayer> {
    let class = |value, name: &str| Class { value, name: name.to_owned(), colour: [10 * value, 20, 255] };
    let kinds =
        [PixelKind::Colour, PixelKind::Height, PixelKind::Class(vec![class(0, "ground"), class(3, "roof & wall")])];
    let layer = |kind| RasterLayer { description: "a <test>".to_owned(), kind, has_world_heights: true };
    kinds.into_iter().map(layer).collect()
}

/// Where nothing was seen: a corner, and the column of tiles in the east.
fn is_seen(x: usize, y: usize) -> bool {
    x < 3 * TILE && !(x < 100 && y < 100)
}

fn colour(x: usize, y: usize) -> [u8; 4] {
    if is_seen(x, y) { [(x % 256) as u8, (y % 256) as u8, (x / 7 + y) as u8, 255] } else { [0; 4] }
}

fn height(x: usize, y: usize) -> f32 {
    if is_seen(x, y) { rounded(512.0 + x as f64 * 0.037 - y as f64 * 0.11) } else { NO_HEIGHT }
}

fn class(x: usize, y: usize) -> u8 {
    if !is_seen(x, y) {
        255
    } else if x % 64 < 40 {
        3
    } else {
        0
    }
}

fn read(column: usize, row: usize) -> Result<Vec<Pixels>, Error> {
    let places: Vec<(usize, usize)> =
        (0..TILE * TILE).map(|i| (column * TILE + i % TILE, row * TILE + i / TILE)).collect();
    let inside = |(x, y): &(usize, usize)| *x < WIDTH && *y < HEIGHT;
    Ok(vec![
        Pixels::Colours(places.iter().map(|p| if inside(p) { colour(p.0, p.1) } else { [0; 4] }).collect()),
        Pixels::Heights(places.iter().map(|p| if inside(p) { height(p.0, p.1) } else { NO_HEIGHT }).collect()),
        Pixels::Classes(places.iter().map(|p| if inside(p) { class(p.0, p.1) } else { 255 }).collect()),
    ])
}

fn files(crs: &Crs) -> Vec<Vec<u8>> {
    let grid = RasterGrid { width: WIDTH, height: HEIGHT, west: 691_000.2, north: 5_334_000.4, step: 0.2 };
    let folder = tempfile::tempdir().unwrap();
    let mut set = CogSet::make(layers(), grid, folder.path(), read).unwrap();
    let mut file = |layer| {
        let mut bytes = Vec::new();
        set.write(layer, &GeoReference::of(crs), &mut bytes).unwrap();
        bytes
    };
    (0..3).map(&mut file).collect()
}

/// The classes of the picture that a decoder stands at: `tiff` does not read pictures with a palette, so its tiles are unpacked here.
fn classes(decoder: &mut Decoder<Cursor<&Vec<u8>>>, bytes: &[u8]) -> Vec<u8> {
    let (width, height) = decoder.dimensions().unwrap();
    let (width, height) = (width as usize, height as usize);
    let offsets = decoder.get_tag_u64_vec(Tag::TileOffsets).unwrap();
    let sizes = decoder.get_tag_u64_vec(Tag::TileByteCounts).unwrap();
    let mut out = vec![0; width * height];
    for (tile, (&offset, &size)) in offsets.iter().zip(&sizes).enumerate() {
        let mut unpacked = Vec::new();
        let packed = &bytes[offset as usize..(offset + size) as usize];
        flate2::read::ZlibDecoder::new(packed).read_to_end(&mut unpacked).unwrap();
        let (column, row) = (tile % width.div_ceil(TILE), tile / width.div_ceil(TILE));
        for (i, &value) in unpacked.iter().enumerate() {
            let (x, y) = (column * TILE + i % TILE, row * TILE + i / TILE);
            if x < width && y < height {
                out[y * width + x] = value;
            }
        }
    }
    out
}

#[test]
fn pixels_come_back_at_their_places() {
    let files = files(&Crs::Epsg(7415));
    for (layer, bytes) in files.iter().enumerate() {
        let mut decoder = Decoder::new(Cursor::new(bytes)).unwrap();
        assert_eq!(decoder.dimensions().unwrap(), (WIDTH as u32, HEIGHT as u32));
        if layer == 2 {
            let found = classes(&mut decoder, bytes);
            assert!(found.iter().enumerate().all(|(i, &c)| c == class(i % WIDTH, i / WIDTH)));
            assert_eq!(decoder.get_tag_u16_vec(Tag::ColorMap).unwrap()[3], 30 * 257, "red of the third class");
            continue;
        }
        match (layer, decoder.read_image().unwrap()) {
            (0, DecodingResult::U8(found)) => {
                for (i, pixel) in found.chunks(4).enumerate() {
                    assert_eq!(pixel, colour(i % WIDTH, i / WIDTH), "{i}");
                }
            }
            (1, DecodingResult::F32(found)) => {
                assert!(found.iter().enumerate().all(|(i, &z)| z == height(i % WIDTH, i / WIDTH)));
            }
            (layer, _) => panic!("layer {layer} is of another type"),
        }
        let scale = decoder.get_tag_f64_vec(Tag::ModelPixelScaleTag).unwrap();
        let corner = decoder.get_tag_f64_vec(Tag::ModelTiepointTag).unwrap();
        assert_eq!((scale[..2].to_vec(), corner[3..5].to_vec()), (vec![0.2, 0.2], vec![691_000.2, 5_334_000.4]));
        let keys = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap();
        let key = |key: u16| keys[4..].chunks(4).find(|entry| entry[0] == key).map(|entry| entry[3]);
        assert_eq!((key(1024), key(1025), key(3072), key(4096)), (Some(1), Some(1), Some(28992), Some(5709)));
    }
}

#[test]
fn overviews_have_the_mean_of_what_there_is() {
    let files = files(&Crs::Unknown);
    let mut decoder = Decoder::new(Cursor::new(&files[1])).unwrap();
    assert!(decoder.find_tag(Tag::GeoKeyDirectoryTag).unwrap().is_none(), "an unknown system is not named");
    assert!(decoder.more_images());
    decoder.next_image().unwrap();
    let (width, height_of) = (WIDTH.div_ceil(2), HEIGHT.div_ceil(2));
    assert_eq!(decoder.dimensions().unwrap(), (width as u32, height_of as u32));
    let DecodingResult::F32(half) = decoder.read_image().unwrap() else { panic!("no heights") };
    for (i, &found) in half.iter().enumerate() {
        let (x, y) = (2 * (i % width), 2 * (i / width));
        let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
        let known: Vec<f32> = four
            .iter()
            .filter(|p| p.0 < WIDTH && p.1 < HEIGHT && is_seen(p.0, p.1))
            .map(|p| height(p.0, p.1))
            .collect();
        let mean = known.iter().sum::<f32>() / known.len() as f32;
        let expected = if known.is_empty() { NO_HEIGHT } else { mean };
        assert!((found - expected).abs() < 0.001, "{x} {y}: {found} for {expected}");
    }
    let mut levels = 2;
    while decoder.more_images() {
        decoder.next_image().unwrap();
        levels += 1;
    }
    assert_eq!(levels, 3, "down to one tile");

    let mut decoder = Decoder::new(Cursor::new(&files[2])).unwrap();
    decoder.next_image().unwrap();
    let half = classes(&mut decoder, &files[2]);
    assert_eq!((half[0], half[60], half[width - 1]), (255, 0, 255));
    let mut decoder = Decoder::new(Cursor::new(&files[0])).unwrap();
    decoder.next_image().unwrap();
    let DecodingResult::U8(half) = decoder.read_image().unwrap() else { panic!("no colours") };
    let at = |x: usize, y: usize| &half[(y * width + x) * 4..][..4];
    assert_eq!((at(0, 0), at(100, 0)[3]), (&[0; 4][..], 255));
    // The mean of 200, 201 and of 0, 1.
    assert_eq!(at(100, 0)[..2], [201, 1]);
}

#[test]
fn what_is_coarse_stands_before_what_is_fine() {
    for bytes in files(&Crs::Epsg(25832)) {
        assert_eq!(bytes[..8], [b'I', b'I', 42, 0, 8, 0, 0, 0]);
        let mut decoder = Decoder::new(Cursor::new(&bytes)).unwrap();
        let mut first = Vec::new();
        loop {
            let offsets = decoder.get_tag_u64_vec(Tag::TileOffsets).unwrap();
            assert!(offsets.is_sorted());
            first.push(offsets[0]);
            if !decoder.more_images() {
                break;
            }
            decoder.next_image().unwrap();
        }
        assert!(first.is_sorted_by(|a, b| a > b), "{first:?}");
    }
}

#[test]
fn large_files_have_eight_bytes_for_a_place() {
    let mut directory = Directory::default();
    directory.put(324, Value::Offsets(vec![1 << 33, 5]));
    directory.put(256, Value::Long(vec![7]));
    let mut bytes = Vec::new();
    container::write_head(&[directory.clone(), directory], true, &mut bytes).unwrap();
    assert_eq!(bytes[..16], [b'I', b'I', 43, 0, 8, 0, 0, 0, 16, 0, 0, 0, 0, 0, 0, 0]);
    // Two entries, the second of which points behind them.
    assert_eq!(bytes[16..24], 2_u64.to_le_bytes());
    assert_eq!(bytes[24..28], [0, 1, 4, 0]);
    let place = u64::from_le_bytes(bytes[56..64].try_into().unwrap()) as usize;
    assert_eq!(bytes[place..place + 8], (1_u64 << 33).to_le_bytes());
    let next = u64::from_le_bytes(bytes[64..72].try_into().unwrap()) as usize;
    assert_eq!(bytes[next..next + 8], 2_u64.to_le_bytes());
}
