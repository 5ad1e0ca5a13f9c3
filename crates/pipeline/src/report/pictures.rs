//! The pictures: orthophoto, labels, roofs by plane, footprints over the orthophoto, and views of the mesh
//! and of the model side by side; of the whole city, and of a few places closer up.

use super::{Overview, ReportSource};
use crate::PipelineError;
use crate::render::{Camera, Canvas, Light};
use gable_city_model::{Building, Face, Semantic, Shell};
use gable_geometry::{Box2, DVec2, DVec3, dvec2, dvec3};
use gable_raster::{GridWindow, Raster};
use gable_segmentation::Label;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder as _, RgbImage, RgbaImage};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// Pixels a side of a picture of the whole city.
const CITY_SIDE: usize = 1400;

/// Pixels a side of a close-up.
const CLOSE_SIDE: usize = 900;

/// Edge of a close-up, metres.
const CLOSE_EXTENT: f64 = 160.0;

/// Close-ups of a city.
pub(super) const CLOSE_UPS: usize = 3;

/// Endings of the file names of the pictures of an extent.
pub(super) const KINDS: [&str; 6] =
    ["model.png", "mesh.png", "orthophoto.jpg", "footprints.jpg", "labels.jpg", "roofs.jpg"];

/// Cells of the drawn surface along the longer side of a view.
const SURFACE_CELLS: usize = 700;

const WALL: [u8; 3] = [236, 229, 214];
const ROOF: [u8; 3] = [205, 104, 82];
const UNDERSIDE: [u8; 3] = [120, 120, 120];
const BARE: [u8; 3] = [222, 217, 205];
const GREEN: [u8; 3] = [196, 212, 172];

/// A finished picture.
pub(super) struct Picture {
    /// File name in the folder of pictures.
    pub(super) file: String,
    /// MIME type.
    pub(super) mime: &'static str,
    /// One line for people.
    pub(super) caption: &'static str,
    /// The encoded file.
    pub(super) bytes: Vec<u8>,
    /// Pixels across and down.
    pub(super) size: (u32, u32),
}

/// The pictures of one extent.
pub(super) struct PictureSet {
    /// Heading.
    pub(super) title: String,
    /// Pictures in the order in which they are shown.
    pub(super) pictures: Vec<Picture>,
}

/// Makes every picture. A city without data has none.
pub(super) fn make(source: &dyn ReportSource) -> Result<Vec<PictureSet>, PipelineError> {
    let bounds = source.bounds();
    if bounds.is_empty() {
        return Ok(Vec::new());
    }
    let mut busy = BTreeMap::new();
    let mut sets = vec![set(source, bounds, "city", "The whole city", CITY_SIDE, Some(&mut busy))?];
    if bounds.size().max_element() > 2.0 * CLOSE_EXTENT {
        let close = |(number, centre)| {
            let extent = Box2 { min: centre, max: centre }.grown(CLOSE_EXTENT / 2.0);
            let extent = Box2 { min: extent.min.max(bounds.min), max: extent.max.min(bounds.max) };
            let (name, title) = (format!("place-{}", number + 1), format!("Closer up, place {}", number + 1));
            set(source, extent, &name, &title, CLOSE_SIDE, None)
        };
        let close: Vec<_> = places(&busy).into_par_iter().enumerate().map(close).collect::<Result<_, _>>()?;
        sets.extend(close);
    }
    Ok(sets)
}

/// Where to look closer: the cells with most faces, no two of them neighbours.
fn places(busy: &BTreeMap<(i64, i64), u64>) -> Vec<DVec2> {
    let mut cells: Vec<_> = busy.iter().map(|(&cell, &faces)| (std::cmp::Reverse(faces), cell)).collect();
    cells.sort_unstable();
    let mut chosen: Vec<(i64, i64)> = Vec::new();
    for (_, cell) in cells {
        if chosen.iter().all(|c| (c.0 - cell.0).abs().max((c.1 - cell.1).abs()) > 1) {
            chosen.push(cell);
        }
        if chosen.len() == CLOSE_UPS {
            break;
        }
    }
    chosen.into_iter().map(|(x, y)| (dvec2(x as f64, y as f64) + 0.5) * CLOSE_EXTENT).collect()
}

/// The pictures of one extent, buildings visited once. `busy` counts faces by cells of [`CLOSE_EXTENT`].
fn set(
    source: &dyn ReportSource,
    bounds: Box2,
    name: &str,
    title: &str,
    side: usize,
    mut busy: Option<&mut BTreeMap<(i64, i64), u64>>,
) -> Result<PictureSet, PipelineError> {
    let window = Overview::window(bounds, source.step(), side);
    let overview = source.overview(window)?;
    let extent = window.bounds();
    let heights = height_range(&overview);
    let light = Light::default();

    let [a, b] = [extent.min.extend(heights[0]), extent.max.extend(heights[1])];
    let oblique = Camera::showing(28.0, 42.0, seen(&overview), side, side);
    let above = Camera::showing(0.0, 90.0, [a, b], side, side);
    let mut model = Canvas::new(oblique, &light, Some([a, b]));
    let mut roofs = Canvas::new(above, &light, None);
    model.clip(extent);
    let (base, coloured) = base_map(&overview);
    let mut outlined = base.clone();
    source.buildings(extent, &mut |building| {
        draw_model(&mut model, building);
        draw_roofs(&mut roofs, building);
        outline(&mut outlined, window, building);
        if let Some(busy) = busy.as_deref_mut() {
            count_faces(busy, building);
        }
    })?;
    let painted = |kind: &str, caption, (extension, mime, bytes, size): Encoded| Picture {
        file: format!("{name}-{kind}.{extension}"),
        mime,
        caption,
        bytes,
        size,
    };
    type Painter<'a> = Box<dyn FnOnce() -> Result<Picture, PipelineError> + Send + 'a>;
    let (overview, light, painted) = (&overview, &light, &painted);
    let painters: Vec<Painter<'_>> = vec![
        Box::new(move || {
            draw_terrain(&mut model, overview);
            Ok(painted("model", "The model: walls, roofs and terrain", png(&model.finish(light))?))
        }),
        Box::new(move || {
            // Photographs hold their own light and shadow.
            let photographic = Light { ambient: 0.8, creases: false, ..*light };
            let mut mesh = Canvas::new(oblique, &photographic, None);
            draw_surface(&mut mesh, overview);
            let caption = "The surface of the mesh, seen from the same place";
            Ok(painted("mesh", caption, png(&mesh.finish(&photographic))?))
        }),
        Box::new(move || {
            let caption = if coloured { "Orthophoto" } else { "The surface from above (the mesh has no colours)" };
            Ok(painted("orthophoto", caption, jpeg(&base)?))
        }),
        Box::new(move || {
            Ok(painted("footprints", "Footprints, by the level of detail that was written", jpeg(&outlined)?))
        }),
        Box::new(move || Ok(painted("labels", "Labels", jpeg(&labels(overview))?))),
        Box::new(move || {
            let caption = "Roofs by plane: hue is the direction of the slope, strength its steepness";
            let drawn = over(&hillshade(&overview.height), &roofs.finish(light));
            Ok(painted("roofs", caption, jpeg(&drawn)?))
        }),
    ];
    let pictures = painters.into_par_iter().map(|paint| paint()).collect::<Result<_, _>>()?;
    Ok(PictureSet { title: title.to_owned(), pictures })
}

/// Points of the surface and of the ground, enough of them to frame a view.
fn seen(overview: &Overview) -> impl Iterator<Item = DVec3> + '_ {
    let window = overview.height.window();
    let every = stride(window).max(4);
    let pixels =
        (0..window.height).step_by(every).flat_map(move |y| (0..window.width).step_by(every).map(move |x| (x, y)));
    pixels.flat_map(move |at| {
        let place = window.centre(at.0, at.1);
        let heights = [overview.height[at], overview.ground[at]];
        heights.into_iter().filter(|h| !h.is_nan()).map(move |h| place.extend(f64::from(h)))
    })
}

/// The orthophoto, white where there is no data, and whether there are colours at all; without, the shaded surface.
fn base_map(overview: &Overview) -> (RgbImage, bool) {
    let data = || overview.colour.values().iter().zip(overview.height.values()).filter(|(_, h)| !h.is_nan());
    let first = data().next().map(|(colour, _)| *colour);
    if data().all(|(colour, _)| Some(*colour) == first) {
        return (hillshade(&overview.height), false);
    }
    let mut colour = overview.colour.clone();
    for (colour, height) in colour.values_mut().iter_mut().zip(overview.height.values()) {
        if height.is_nan() {
            *colour = [255; 3];
        }
    }
    (photo(&colour), true)
}

/// Lowest and highest surface, without the outermost thousandths.
fn height_range(overview: &Overview) -> [f64; 2] {
    let mut heights: Vec<f32> = overview.height.values().iter().copied().filter(|h| !h.is_nan()).collect();
    if heights.is_empty() {
        return [0.0, 1.0];
    }
    let n = heights.len();
    let (_, &mut low, _) = heights.select_nth_unstable_by(n / 1000, f32::total_cmp);
    let (_, &mut high, _) = heights.select_nth_unstable_by(n - 1 - n / 10_000, f32::total_cmp);
    [f64::from(low), f64::from(high).max(f64::from(low) + 1.0)]
}

/// The shells of the best LOD with volume; the footprint where there is none.
fn best(building: &Building) -> &[Shell] {
    let lods = &building.lods;
    match (&lods.lod2[..], &lods.lod1[..]) {
        ([], []) => lods.footprint.as_slice(),
        ([], lod1) => lod1,
        (lod2, _) => lod2,
    }
}

/// The middle of a building's bounding box on the ground.
fn centre(building: &Building) -> Option<DVec2> {
    let corners = best(building).iter().flat_map(|shell| &shell.vertices).map(|v| v.truncate());
    let bounds = Box2::of(corners);
    (!bounds.is_empty()).then(|| (bounds.min + bounds.max) / 2.0)
}

/// Calls `draw` with the rings of a face.
fn with_rings(shell: &Shell, face: &Face, draw: impl FnOnce(&[&[DVec3]])) {
    let corner = |&i: &u32| shell.vertices.get(i as usize).copied().unwrap_or(DVec3::NAN);
    let rings: Vec<Vec<DVec3>> = face.rings.iter().map(|ring| ring.iter().map(corner).collect()).collect();
    draw(&rings.iter().map(Vec::as_slice).collect::<Vec<_>>());
}

fn draw_model(canvas: &mut Canvas, building: &Building) {
    for shell in best(building) {
        for face in &shell.faces {
            let colour = match face.semantic {
                Semantic::GroundSurface => UNDERSIDE,
                Semantic::WallSurface => WALL,
                Semantic::RoofSurface => ROOF,
            };
            with_rings(shell, face, |rings| canvas.fill(rings, colour));
        }
    }
}

fn draw_roofs(canvas: &mut Canvas, building: &Building) {
    for shell in best(building) {
        for face in shell.faces.iter().filter(|f| f.semantic != Semantic::WallSurface) {
            with_rings(shell, face, |rings| canvas.fill(rings, plane_colour(rings)));
        }
    }
}

/// Hue from the direction of the slope, saturation from its steepness.
fn plane_colour(rings: &[&[DVec3]]) -> [u8; 3] {
    let mut n = DVec3::ZERO;
    for ring in rings.iter().take(1) {
        for k in 1..ring.len().saturating_sub(1) {
            n += (ring[k] - ring[0]).cross(ring[k + 1] - ring[0]);
        }
    }
    let horizontal = n.truncate();
    let slope = horizontal.length().atan2(n.z.abs()).to_degrees();
    let azimuth = (horizontal.x * n.z.signum()).atan2(horizontal.y * n.z.signum()).to_degrees().rem_euclid(360.0);
    azimuth_colour(azimuth, slope)
}

/// The colour of a roof that falls towards `azimuth` by `slope`, both in degrees.
pub(super) fn azimuth_colour(azimuth: f64, slope: f64) -> [u8; 3] {
    let saturation = ((slope - 2.0) / 28.0).clamp(0.0, 1.0) * 0.75;
    let channel = |offset: f64| {
        let hue = ((azimuth + offset).rem_euclid(360.0) - 180.0).abs() / 60.0 - 1.0;
        225.0 * (1.0 - saturation + saturation * hue.clamp(0.0, 1.0))
    };
    [channel(0.0), channel(240.0), channel(120.0)].map(|v| v.round() as u8)
}

fn count_faces(busy: &mut BTreeMap<(i64, i64), u64>, building: &Building) {
    let Some(cell) = centre(building).map(|c| (c / CLOSE_EXTENT).floor()) else { return };
    let faces: usize = best(building).iter().map(|shell| shell.faces.len()).sum();
    *busy.entry((cell.x as i64, cell.y as i64)).or_insert(0) += faces as u64;
}

/// How many pixels of a raster make one cell of a drawn surface.
fn stride(window: GridWindow) -> usize {
    window.width.max(window.height).div_ceil(SURFACE_CELLS).max(1)
}

/// Fills the cells of a height raster, two triangles each; `colour(column, row)` is asked at the cell's corner.
fn draw_heights(canvas: &mut Canvas, heights: &Raster<f32>, colour: impl Fn(usize, usize) -> [u8; 3]) {
    let window = heights.window();
    let stride = stride(window);
    let point = |column: usize, row: usize| {
        let z = f64::from(heights[(column, row)]);
        (!z.is_nan()).then(|| window.centre(column, row).extend(z))
    };
    for row in (0..window.height.saturating_sub(stride)).step_by(stride) {
        for column in (0..window.width.saturating_sub(stride)).step_by(stride) {
            let (east, north) = (column + stride, row + stride);
            let (Some(a), Some(b), Some(c), Some(d)) =
                (point(column, row), point(east, row), point(east, north), point(column, north))
            else {
                continue;
            };
            let colour = colour(column + stride / 2, row + stride / 2);
            // The shorter diagonal follows ridges and eaves better.
            let split =
                if (a.z - c.z).abs() <= (b.z - d.z).abs() { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
            split.iter().for_each(|triangle| canvas.fill(&[triangle], colour));
        }
    }
}

fn draw_surface(canvas: &mut Canvas, overview: &Overview) {
    draw_heights(canvas, &overview.height, |x, y| overview.colour[(x, y)]);
}

fn draw_terrain(canvas: &mut Canvas, overview: &Overview) {
    draw_heights(canvas, &overview.ground, |x, y| match overview.label[(x, y)] {
        Some(Label::Grass | Label::Tree) => GREEN,
        _ => BARE,
    });
}

/// A raster as a picture, north up.
fn picture<T>(raster: &Raster<T>, colour: impl Fn(&T) -> [u8; 3]) -> RgbImage {
    let (width, height) = (raster.width(), raster.height());
    RgbImage::from_fn(width as u32, height as u32, |x, y| {
        image::Rgb(colour(&raster[(x as usize, height - 1 - y as usize)]))
    })
}

fn photo(colour: &Raster<[u8; 3]>) -> RgbImage {
    picture(colour, |&c| c)
}

/// Light from the north-west on the surface, as grey.
fn hillshade(heights: &Raster<f32>) -> RgbImage {
    let window = heights.window();
    let mut shade = Raster::filled(window, [255u8; 3]);
    let sun = dvec3(-0.5, 0.5, 1.0).normalize();
    for row in 0..window.height {
        for column in 0..window.width {
            let here = heights[(column, row)];
            if here.is_nan() {
                continue;
            }
            let slope = |x: usize, y: usize| {
                let there = heights[(x, y)];
                if there.is_nan() { 0.0 } else { f64::from(there - here) / window.step }
            };
            let (dx, dy) =
                (slope((column + 1).min(window.width - 1), row), slope(column, (row + 1).min(window.height - 1)));
            let lit = dvec3(-dx, -dy, 1.0).normalize().dot(sun).max(0.0);
            shade[(column, row)] = [(120.0 + 130.0 * lit) as u8; 3];
        }
    }
    photo(&shade)
}

fn labels(overview: &Overview) -> RgbImage {
    let mut out = picture(&overview.label, |label| label.map_or([255; 3], Label::colour));
    for (pixel, shade) in out.pixels_mut().zip(hillshade(&overview.height).pixels()) {
        (0..3).for_each(|c| pixel.0[c] = (u32::from(pixel.0[c]) * (120 + u32::from(shade.0[c])) / 375).min(255) as u8);
    }
    out
}

/// A picture laid over another, scaled to it.
fn over(base: &RgbImage, top: &RgbaImage) -> RgbImage {
    let mut out = base.clone();
    let (width, height) = (base.width().max(1), base.height().max(1));
    for (x, y, pixel) in out.enumerate_pixels_mut() {
        let (u, v) = (x * top.width() / width, y * top.height() / height);
        let [r, g, b, alpha] = top.get_pixel(u, v).0;
        let mix = |under: u8, upper: u8| {
            ((u32::from(under) * (255 - u32::from(alpha)) + u32::from(upper) * u32::from(alpha)) / 255) as u8
        };
        pixel.0 = [mix(pixel.0[0], r), mix(pixel.0[1], g), mix(pixel.0[2], b)];
    }
    out
}

/// Colours of the outlines: LOD2, LOD1, LOD0.
pub(super) const OUTLINES: [([u8; 3], &str); 3] =
    [([0, 229, 255], "LOD2"), ([255, 196, 0], "LOD1 only"), ([255, 64, 96], "LOD0 only")];

fn outline(canvas: &mut RgbImage, window: GridWindow, building: &Building) {
    let lods = &building.lods;
    let level = match (lods.lod2.is_empty(), lods.lod1.is_empty()) {
        (false, _) => 0,
        (true, false) => 1,
        (true, true) => 2,
    };
    let Some(footprint) = &lods.footprint else { return };
    let corner = window.bounds().min;
    let height = window.height as f64;
    let place = |p: DVec3| {
        let q = (p.truncate() - corner) / window.step;
        dvec2(q.x, height - q.y)
    };
    for face in &footprint.faces {
        with_rings(footprint, face, |rings| {
            for ring in rings {
                for k in 0..ring.len() {
                    line(canvas, place(ring[k]), place(ring[(k + 1) % ring.len()]), OUTLINES[level].0);
                }
            }
        });
    }
}

/// A line two pixels wide, with smooth edges.
fn line(canvas: &mut RgbImage, a: DVec2, b: DVec2, colour: [u8; 3]) {
    if !(a.is_finite() && b.is_finite()) {
        return;
    }
    let limit = dvec2(f64::from(canvas.width()), f64::from(canvas.height()));
    let low = (a.min(b) - 2.0).clamp(DVec2::ZERO, limit);
    let high = (a.max(b) + 3.0).clamp(DVec2::ZERO, limit);
    for y in low.y as u32..high.y as u32 {
        for x in low.x as u32..high.x as u32 {
            let distance = gable_geometry::point_segment_distance(dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5), a, b);
            let share = (1.5 - distance).clamp(0.0, 1.0);
            if share > 0.0 {
                let pixel = canvas.get_pixel_mut(x, y);
                (0..3).for_each(|c| {
                    let mixed = f64::from(pixel.0[c]) * (1.0 - share) + f64::from(colour[c]) * share;
                    pixel.0[c] = mixed.round() as u8;
                });
            }
        }
    }
}

type Encoded = (&'static str, &'static str, Vec<u8>, (u32, u32));

fn jpeg(image: &RgbImage) -> Result<Encoded, PipelineError> {
    let mut bytes = Vec::new();
    JpegEncoder::new_with_quality(&mut bytes, 86).encode_image(image).map_err(encoding)?;
    Ok(("jpg", "image/jpeg", bytes, image.dimensions()))
}

fn png(image: &RgbaImage) -> Result<Encoded, PipelineError> {
    let mut bytes = Vec::new();
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Default, FilterType::Adaptive)
        .write_image(image.as_raw(), image.width(), image.height(), ExtendedColorType::Rgba8)
        .map_err(encoding)?;
    Ok(("png", "image/png", bytes, image.dimensions()))
}

fn encoding(error: image::ImageError) -> PipelineError {
    PipelineError::Io { path: "pictures".into(), source: std::io::Error::other(error) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_slopes_differ_and_flat_is_grey() {
        assert_eq!(azimuth_colour(123.0, 1.0), [225; 3]);
        let (north, south) = (azimuth_colour(0.0, 40.0), azimuth_colour(180.0, 40.0));
        assert!((0..3).any(|c| north[c].abs_diff(south[c]) > 100));
        // A plane that falls to the east has its normal to the east.
        let ring = [dvec3(0.0, 0.0, 1.0), dvec3(1.0, 0.0, 0.0), dvec3(1.0, 1.0, 0.0), dvec3(0.0, 1.0, 1.0)];
        assert_eq!(plane_colour(&[&ring]), azimuth_colour(90.0, 45.0));
    }

    #[test]
    fn places_are_apart() {
        let busy = BTreeMap::from([((0, 0), 10), ((1, 0), 9), ((5, 5), 1), ((2, 0), 8)]);
        let found = places(&busy);
        assert_eq!(found, [dvec2(0.5, 0.5), dvec2(2.5, 0.5), dvec2(5.5, 5.5)].map(|p| p * CLOSE_EXTENT));
    }

    #[test]
    fn lines_are_clipped() {
        let mut image = RgbImage::new(10, 10);
        line(&mut image, dvec2(-50.0, 5.0), dvec2(50.0, 5.0), [255; 3]);
        line(&mut image, dvec2(f64::NAN, 5.0), dvec2(50.0, 5.0), [255; 3]);
        assert_eq!(
            (image.get_pixel(0, 5).0, image.get_pixel(9, 4).0, image.get_pixel(5, 8).0),
            ([255; 3], [255; 3], [0; 3])
        );
    }
}
