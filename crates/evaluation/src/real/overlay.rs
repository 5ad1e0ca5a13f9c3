//! A picture to look at: what was drawn and what was found, over the mesh seen from above.

use super::judged_objects::roofprint;
use super::outlines::OutlineClass;
use super::scene::RealScene;
use crate::Error;
use crate::height_raster::HeightRaster;
use crate::picture::{Colour, shade};
use crate::region::Ring;
use gable_city_model::CityModel;
use gable_geometry::{DVec2, DVec3, dvec2};
use image::{ExtendedColorType, ImageEncoder, codecs::jpeg::JpegEncoder};

/// Buildings that a person drew.
const TRUE: Colour = [0, 255, 255];
/// Buildings of the result.
const FOUND: Colour = [255, 30, 30];
/// Where a person is not sure.
const UNSURE: Colour = [255, 0, 255];
/// Limits of what is judged.
const AREA: Colour = [255, 255, 255];

const QUALITY: u8 = 85;

/// A JPEG of the scene: true buildings cyan, found ones red, what is not sure magenta, limits white. `colours` are those of the
/// mesh seen from above, for each pixel of the scene, row by row from the south; without any, the surface is shaded.
///
/// # Errors
/// If the picture cannot be encoded.
pub fn overlay_jpeg(scene: &RealScene, model: &CityModel, colours: Option<&[Colour]>) -> Result<Vec<u8>, Error> {
    let raster = &scene.surface;
    let mut picture: Vec<Colour> = match colours {
        Some(colours) => colours.to_vec(),
        None => {
            let heights = raster.z.iter().copied().filter(|z| z.is_finite());
            let [low, high] = heights.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], z| [a.min(z), b.max(z)]);
            (0..raster.z.len()).map(|at| shade(raster, at, low, high)).collect()
        }
    };
    for (class, colour) in [(OutlineClass::Unsure, UNSURE), (OutlineClass::Area, AREA), (OutlineClass::Building, TRUE)]
    {
        for outline in scene.outlines.of_class(class) {
            outline.rings.iter().for_each(|ring| draw(raster, ring, colour, &mut picture));
        }
    }
    for building in &model.buildings {
        let roof = roofprint(building, DVec3::from_array(model.origin));
        roof.rings().for_each(|ring| draw(raster, ring, FOUND, &mut picture));
    }
    let north_first = picture.chunks_exact(raster.width.max(1)).rev();
    let pixels: Vec<u8> = north_first.flatten().flatten().copied().collect();
    let mut out = Vec::new();
    let encoder = JpegEncoder::new_with_quality(&mut out, QUALITY);
    encoder.write_image(&pixels, raster.width as u32, raster.height as u32, ExtendedColorType::Rgb8)?;
    Ok(out)
}

/// Draws the sides of a ring, two pixels wide.
fn draw(raster: &HeightRaster, ring: &Ring, colour: Colour, picture: &mut [Colour]) {
    let place = |p: [f64; 2]| DVec2::from(p) / raster.step - dvec2(raster.x0 as f64, raster.y0 as f64);
    for k in 0..ring.len() {
        let (a, b) = (place(ring[k]), place(ring[(k + 1) % ring.len()]));
        let pieces = (2.0 * a.distance(b)).ceil().max(1.0) as usize;
        for piece in 0..=pieces {
            let p = a.lerp(b, piece as f64 / pieces as f64);
            for corner in [dvec2(-0.5, -0.5), dvec2(0.5, -0.5), dvec2(-0.5, 0.5), dvec2(0.5, 0.5)] {
                let at = (p + corner).floor();
                if at.x >= 0.0 && at.y >= 0.0 && at.x < raster.width as f64 && at.y < raster.height as f64 {
                    picture[at.y as usize * raster.width + at.x as usize] = colour;
                }
            }
        }
    }
}
