//! The report: all figures with pictures, in one HTML file that needs nothing else.

use crate::error::positive;
use crate::evaluation::Pair;
use crate::height_raster::{HeightRaster, NONE};
use crate::objects::COVERED;
use crate::picture::{BLANK, Colour, base64, error_colour, png, shade};
use crate::table::{Section, sections};
use crate::{Error, Evaluation, Options};
use gable_city_model::CityModel;
use gable_geometry::{Box2, DVec3};
use std::fmt::Write;

/// Widest picture, pixels.
const WIDEST: f64 = 1600.0;
/// Buildings shown one by one.
const SHOWN: usize = 12;
/// Pixel of those pictures, metres.
const CLOSE: f64 = 0.2;

const BOTH: Colour = [186, 196, 186];
const MISSED: Colour = [202, 0, 32];
const INVENTED: Colour = [244, 150, 40];

/// The report of an evaluation as a HTML page: a map of buildings found, missed and invented, a map of the errors of roof heights,
/// the buildings whose roofs fit worst side by side, and all tables.
///
/// # Errors
/// If a picture cannot be encoded, or `roof_step` is not positive.
pub fn html_report(
    truth: &CityModel,
    result: &CityModel,
    evaluation: &Evaluation,
    options: &Options,
) -> Result<String, Error> {
    positive("roof_step", options.roof_step)?;
    let pair = Pair::new(truth, result, options)?;
    let mut page = String::from(HEAD);
    let _ =
        writeln!(page, "<h1>{}</h1>\n<p>measured against <b>{}</b></p>", escape(&result.title), escape(&truth.title));
    maps(&pair, &mut page)?;
    worst(&pair, &mut page)?;
    page.push_str("<h2>Figures</h2>\n<div class=\"tables\">\n");
    sections(evaluation).iter().for_each(|s| table(s, &mut page));
    page.push_str("</div>\n");
    for (title, ids) in [("Missed", &evaluation.missed), ("Invented", &evaluation.invented)] {
        let list: Vec<String> = ids.iter().map(|id| escape(id)).collect();
        let _ = writeln!(
            page,
            "<details><summary>{title}: {} buildings</summary><p>{}</p></details>",
            ids.len(),
            list.join(", ")
        );
    }
    page.push_str("</body></html>\n");
    Ok(page)
}

/// Roofs of both models on the same pixels.
fn roofs(pair: &Pair<'_>, bounds: Box2, step: f64) -> [HeightRaster; 2] {
    [&pair.truth, &pair.result].map(|city| {
        let mut raster = HeightRaster::covering(bounds, step);
        for i in city.near(bounds) {
            city.objects[i].roof().for_each(|f| raster.draw(f.corners, i as u32));
        }
        raster
    })
}

fn error_at(rasters: &[HeightRaster; 2], at: usize) -> Colour {
    match rasters.each_ref().map(|r| r.tag[at] != NONE) {
        [true, true] => error_colour(rasters[1].z[at] - rasters[0].z[at]),
        [true, false] => [90, 90, 90],
        [false, true] => [200, 186, 140],
        [false, false] => BLANK,
    }
}

fn maps(pair: &Pair<'_>, page: &mut String) -> Result<(), Error> {
    let plans = pair.truth.objects.iter().chain(&pair.result.objects).map(|o| o.plan()).filter(|b| !b.is_empty());
    let bounds = Box2::of(plans.flat_map(|b| [b.min, b.max])).grown(2.0);
    if bounds.is_empty() || !bounds.size().is_finite() {
        page.push_str("<p>No buildings.</p>\n");
        return Ok(());
    }
    let step = (bounds.size().max_element() / WIDEST).max(0.2);
    let rasters = roofs(pair, bounds, step);
    let covered = |at: usize, side: usize, shares: &[f64]| shares[rasters[side].tag[at] as usize] >= COVERED;
    let found = |at: usize| match rasters.each_ref().map(|r| r.tag[at] != NONE) {
        [false, false] => BLANK,
        [true, true] => BOTH,
        // Strong colours for whole buildings, weak ones for parts of buildings that were found.
        [true, false] if covered(at, 0, &pair.coverage.truth) => [226, 150, 150],
        [true, false] => MISSED,
        [false, true] if covered(at, 1, &pair.coverage.result) => [246, 214, 170],
        [false, true] => INVENTED,
    };
    let size = (rasters[0].width, rasters[0].height);
    page.push_str("<h2>Buildings</h2>\n<p class=\"key\">");
    for (colour, name) in [
        (BOTH, "in both"),
        (MISSED, "missed building"),
        ([226, 150, 150], "missed part"),
        (INVENTED, "invented building"),
        ([246, 214, 170], "invented part"),
    ] {
        key(colour, name, page);
    }
    page.push_str("</p>\n");
    picture(&png(size.0, size.1, found)?, "buildings found, missed and invented", page);
    page.push_str("<h2>Roof heights, result minus truth</h2>\n<p class=\"key\">");
    for (colour, name) in [
        (error_colour(-1.0), "1 m or more too low"),
        (error_colour(-0.25), "0.25 m too low"),
        (error_colour(0.0), "right"),
        (error_colour(0.25), "0.25 m too high"),
        (error_colour(1.0), "1 m or more too high"),
        ([90, 90, 90], "truth only"),
        ([200, 186, 140], "result only"),
    ] {
        key(colour, name, page);
    }
    page.push_str("</p>\n");
    picture(&png(size.0, size.1, |at| error_at(&rasters, at))?, "errors of roof heights", page);
    Ok(())
}

fn worst(pair: &Pair<'_>, page: &mut String) -> Result<(), Error> {
    let mut order: Vec<(f64, usize)> = (0..pair.fits.len())
        .filter(|&i| pair.fits[i].is_matched() && pair.truth.objects[i].area >= 10.0)
        .map(|i| (pair.fits[i].rmse(), i))
        .collect();
    order.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    if order.is_empty() {
        return Ok(());
    }
    page.push_str("<h2>Roofs that fit worst</h2>\n<p>Truth, result, result minus truth.</p>\n");
    for &(rmse, i) in order.iter().take(SHOWN) {
        let object = &pair.truth.objects[i];
        let bounds = object.plan().grown(2.0);
        let rasters = roofs(pair, bounds, (bounds.size().max_element() / 500.0).max(CLOSE));
        let heights = || object.facets.iter().flat_map(|f| f.corners).map(|p: DVec3| p.z);
        let (low, high) = heights().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), z| (l.min(z), h.max(z)));
        let (width, height) = (rasters[0].width, rasters[0].height);
        let _ = writeln!(page, "<figure><figcaption>{}: RMSE {rmse:.2} m</figcaption>", escape(&object.building.id));
        for raster in &rasters {
            picture(&png(width, height, |at| shade(raster, at, low, high))?, "heights", page);
        }
        picture(&png(width, height, |at| error_at(&rasters, at))?, "errors", page);
        page.push_str("</figure>\n");
    }
    Ok(())
}

fn picture(bytes: &[u8], what: &str, page: &mut String) {
    let _ = writeln!(page, "<img alt=\"{what}\" src=\"data:image/png;base64,{}\">", base64(bytes));
}

fn key([r, g, b]: Colour, name: &str, page: &mut String) {
    let _ = write!(page, "<i style=\"background:rgb({r},{g},{b})\"></i>{name} ");
}

fn table(section: &Section, page: &mut String) {
    let _ = write!(page, "<table><tr><th>{}</th>", escape(section.title));
    for column in &section.columns {
        let _ = write!(page, "<th>{}</th>", escape(column));
    }
    page.push_str("</tr>\n");
    for (name, cells) in &section.rows {
        let _ = write!(page, "<tr><td>{}</td>", escape(name));
        for cell in cells {
            let _ = write!(page, "<td>{}</td>", escape(cell));
        }
        page.push_str("</tr>\n");
    }
    page.push_str("</table>\n");
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

const HEAD: &str = r#"<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><title>City model report</title><style>
body { font: 15px/1.4 system-ui, sans-serif; max-width: 1640px; margin: 1.5em auto; padding: 0 1em; color: #222 }
img { max-width: 100%; image-rendering: pixelated; border: 1px solid #ddd }
figure { display: inline-block; margin: 0 1em 1em 0; vertical-align: top }
figure img { width: 300px }
figcaption { font-size: 13px; overflow-wrap: anywhere; max-width: 920px }
.key i { display: inline-block; width: 1em; height: 1em; margin: 0 .3em -.15em .8em; border: 1px solid #bbb }
.tables { display: flex; flex-wrap: wrap; gap: 1.5em }
table { border-collapse: collapse; align-self: flex-start }
th, td { text-align: right; padding: .15em .6em; border-bottom: 1px solid #e4e4e4; font-variant-numeric: tabular-nums }
th:first-child, td:first-child { text-align: left }
</style></head><body>
"#;
