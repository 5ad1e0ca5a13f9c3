//! Labelled images from two folders: pictures, and masks of the same name.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use crate::Error;
use crate::training::{LabelledRaster, UNKNOWN, labelled_image};

/// Reads the images of a folder that have a mask of the same name in another folder.
///
/// Images and masks are PNG or JPEG of equal size, north up, `step` metres a pixel. In a mask, black is no tree, white
/// tree, and mid-grey (96–159) not looked at. The part of a name before the first `_` or `-` is the source, across which
/// the classifier is calibrated. In the order of names.
///
/// # Errors
/// If a folder or a file cannot be read, sizes differ, or no image has a mask.
pub fn read_labelled_images(images: &Path, masks: &Path, step: f64) -> Result<Vec<LabelledRaster>, Error> {
    let (images, masks) = (pictures(images)?, (masks, pictures(masks)?));
    let mut rasters = Vec::new();
    for (name, path) in &images {
        let Some(mask) = masks.1.get(name) else { continue };
        let colour = open(path)?.to_rgb8();
        let grey = open(mask)?.to_luma8();
        if colour.dimensions() != grey.dimensions() {
            let ((w, h), (v, u)) = (colour.dimensions(), grey.dimensions());
            let reason = format!("the mask has {v} × {u} pixels, its image {w} × {h}: make them equal");
            return Err(Error::Image { path: mask.clone(), reason });
        }
        let rgb: Vec<[u8; 3]> = colour.pixels().map(|p| p.0).collect();
        let labels: Vec<u8> = grey
            .pixels()
            .map(|p| match p.0[0] {
                0..=95 => 0,
                96..=159 => UNKNOWN,
                _ => 1,
            })
            .collect();
        let source = name.split(['_', '-']).next().unwrap_or(name);
        let (width, height) = (colour.width() as usize, colour.height() as usize);
        rasters.push(labelled_image(name, source, width, height, step, &rgb, &labels)?);
    }
    if rasters.is_empty() {
        let reason = "no mask has the name of an image: name them alike".to_owned();
        return Err(Error::Image { path: masks.0.to_owned(), reason });
    }
    Ok(rasters)
}

fn pictures(folder: &Path) -> Result<BTreeMap<String, PathBuf>, Error> {
    let io = |source| Error::Io { path: folder.to_owned(), source };
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(io)? {
        let path = entry.map_err(io)?.path();
        let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
        if let (true, Some(stem)) =
            (["png", "jpg", "jpeg"].contains(&extension.as_str()), path.file_stem().and_then(|s| s.to_str()))
        {
            found.insert(stem.to_owned(), path);
        }
    }
    Ok(found)
}

fn open(path: &Path) -> Result<image::DynamicImage, Error> {
    image::open(path).map_err(|e| Error::Image { path: path.to_owned(), reason: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FeatureSet, TrainOptions, train};

    #[test]
    fn trains_from_folders() {
        let folder = tempfile::tempdir().unwrap();
        let (images, masks) = (folder.path().join("images"), folder.path().join("masks"));
        std::fs::create_dir_all(&images).unwrap();
        std::fs::create_dir_all(&masks).unwrap();
        for city in ["a_1", "b_1"] {
            let tree = |x: u32, y: u32| (x / 20 + y / 20).is_multiple_of(2);
            let noise = |x: u32, y: u32| ((x * 7 + y * 13) % 30) as u8;
            let picture = image::RgbImage::from_fn(80, 60, |x, y| {
                image::Rgb(if tree(x, y) { [50, 90 + noise(x, y), 45] } else { [140 + noise(x, y), 130, 125] })
            });
            picture.save(images.join(format!("{city}.png"))).unwrap();
            let mask = image::GrayImage::from_fn(80, 60, |x, y| image::Luma([if tree(x, y) { 255 } else { 0 }]));
            mask.save(masks.join(format!("{city}.png"))).unwrap();
        }
        let rasters = read_labelled_images(&images, &masks, 0.2).unwrap();
        assert_eq!(rasters.len(), 2);
        let options = TrainOptions { features: FeatureSet::Zhu27, rounds: 20, samples: 500, ..TrainOptions::default() };
        let (model, report) = train(&rasters, &options).unwrap();
        assert_eq!(report.held_out.len(), 2);
        assert!(report.fit.tree.iou() > 0.9, "{:?}", report.fit);
        assert_eq!(train(&rasters, &options).unwrap().0, model);
        // Rows of rasters run north, those of pictures south.
        assert_eq!(rasters[0].labels[(0, 59)], crate::Label::Tree as u8);
        std::fs::remove_file(masks.join("a_1.png")).unwrap();
        std::fs::remove_file(masks.join("b_1.png")).unwrap();
        assert!(matches!(read_labelled_images(&images, &masks, 0.2), Err(Error::Image { .. })));
    }
}
