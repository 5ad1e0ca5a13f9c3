//! Textures of the source as artefacts, and block files that name their materials by themselves.
//!
//! A block's own list has only the materials that it uses, in the order of the city's, and names textures by their
//! content: so neither a moved source nor a change elsewhere in the city changes a block's artefacts.

use crate::params::Params;
use crate::{PipelineError, artefact, run};
use gable_blocks::BlockMesh;
use gable_files::Reach;
use gable_ortho::TextureCache;
use gable_scene::{Material, TextureSource, texture_bytes};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A material of a block.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct BlockMaterial {
    colour: [u8; 3],
    /// Name of its texture.
    texture: Option<String>,
    /// Why the texture cannot be read; then there is no file of its name.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    unreadable: Option<String>,
}

impl BlockMaterial {
    /// The file that has to be read for it.
    pub(super) fn file(&self) -> Option<&str> {
        self.texture.as_deref().filter(|_| self.unreadable.is_none())
    }
}

/// The textures that were packed: their names, and where in the source they come from.
#[derive(Debug, Default)]
pub(super) struct Packed {
    sources: BTreeMap<String, BTreeSet<String>>,
    /// By material of the scene.
    done: BTreeMap<u32, BlockMaterial>,
    /// By texture; `Err` has the reason why it cannot be read.
    names: Vec<(TextureSource, Result<String, String>)>,
}

impl Packed {
    /// Gives a mesh its own list of materials; their textures, within `reach`, are copied into `folder`.
    pub(super) fn block(
        &mut self,
        mesh: &mut BlockMesh,
        materials: &[Material],
        reach: &Reach,
        folder: &Path,
    ) -> Result<Vec<BlockMaterial>, PipelineError> {
        let used: BTreeSet<u32> = mesh.triangles.iter().map(|t| t.material).collect();
        let numbers: BTreeMap<u32, u32> = used.iter().copied().zip(0..).collect();
        for triangle in &mut mesh.triangles {
            triangle.material = numbers[&triangle.material];
        }
        used.iter().map(|&number| self.material(number, materials, reach, folder)).collect()
    }

    /// Where each texture comes from.
    pub(super) fn sources(&self) -> &BTreeMap<String, BTreeSet<String>> {
        &self.sources
    }

    fn material(
        &mut self,
        number: u32,
        materials: &[Material],
        reach: &Reach,
        folder: &Path,
    ) -> Result<BlockMaterial, PipelineError> {
        if let Some(done) = self.done.get(&number) {
            return Ok(done.clone());
        }
        let material = materials.get(number as usize).cloned().unwrap_or_default();
        let mut made = BlockMaterial { colour: material.colour, texture: None, unreadable: None };
        if let Some(source) = &material.texture {
            let name = match self.names.iter().find(|(known, _)| known == source) {
                Some((_, name)) => name.clone(),
                None => {
                    let name = self.texture(source, reach, folder)?;
                    self.names.push((source.clone(), name.clone()));
                    name
                }
            };
            match name {
                Ok(name) => made.texture = Some(name),
                Err(reason) => {
                    let name = format!("textures/unreadable-{}", blake3::hash(reason.as_bytes()).to_hex());
                    self.sources.entry(name.clone()).or_default().insert(source.file().display().to_string());
                    made.texture = Some(name);
                    made.unreadable = Some(reason);
                }
            }
        }
        self.done.insert(number, made.clone());
        Ok(made)
    }

    fn texture(
        &mut self,
        source: &TextureSource,
        reach: &Reach,
        folder: &Path,
    ) -> Result<Result<String, String>, PipelineError> {
        let bytes = match texture_bytes(source, reach) {
            Ok(bytes) => bytes,
            Err(error) => return Ok(Err(error.to_string())),
        };
        let name = format!("textures/{}", blake3::hash(&bytes).to_hex());
        let path = folder.join(&name);
        if !path.exists() {
            artefact::write(&path, &bytes)?;
        }
        self.sources.entry(name.clone()).or_default().insert(source.file().display().to_string());
        Ok(Ok(name))
    }
}

/// The textures of a block, in `folder`.
pub(super) fn open(materials: &[BlockMaterial], folder: &Path, params: &Params, reach: &Reach) -> TextureCache {
    let mut unreadable = BTreeMap::new();
    let scene = materials.iter().map(|material| {
        let path = material.texture.as_ref().map(|name| folder.join(name));
        if let (Some(path), Some(reason)) = (&path, &material.unreadable) {
            unreadable.insert(path.clone(), reason.clone());
        }
        Material { name: String::new(), texture: path.map(TextureSource::File), colour: material.colour }
    });
    let scene = scene.collect();
    run::textures(scene, params, reach, unreadable)
}

/// The textures that could not be read, by name, each with a reason that does not tell where the folder was.
pub(super) fn failures(textures: &TextureCache, folder: &Path) -> Vec<(String, String)> {
    let inside = format!("{}/", folder.display());
    let name = |text: &str| text.replace(&inside, "");
    textures.failures().iter().map(|(path, reason)| (name(&path.display().to_string()), name(reason))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gable_blocks::BlockTriangle;
    use gable_ortho::TextureSource as _;

    #[test]
    fn a_block_names_its_materials_whatever_else_the_city_has() {
        let (folder, reach) = (tempfile::tempdir().unwrap(), Reach::everything());
        std::fs::create_dir(folder.path().join("textures")).unwrap();
        let picture = folder.path().join("roof.png");
        image::RgbImage::from_pixel(2, 2, image::Rgb([9, 8, 7])).save(&picture).unwrap();
        let plain = |grey| Material { name: "m".to_owned(), texture: None, colour: [grey; 3] };
        let roof = Material { texture: Some(TextureSource::File(picture)), ..plain(1) };
        let gone = Material { texture: Some(TextureSource::File("/none.png".into())), ..plain(2) };
        let triangle = |material| BlockTriangle { material, ..BlockTriangle::default() };

        let cities = [vec![roof.clone(), gone.clone()], vec![plain(5), roof, plain(6), gone]];
        let mut seen = Vec::new();
        for (materials, used) in cities.into_iter().zip([[1, 0, 1], [3, 1, 3]]) {
            let mut packed = Packed::default();
            let mut mesh = BlockMesh { triangles: used.map(triangle).to_vec() };
            let own = packed.block(&mut mesh, &materials, &reach, folder.path()).unwrap();
            assert_eq!(mesh.triangles.iter().map(|t| t.material).collect::<Vec<_>>(), [1, 0, 1]);
            let textures = open(&own, folder.path(), &Params::default(), &reach);
            assert!(textures.texture(0).is_some() && textures.texture(1).is_none());
            let failed = failures(&textures, folder.path());
            assert!(failed[0].0.starts_with("textures/unreadable-") && failed[0].1.contains("/none.png"), "{failed:?}");
            assert!(packed.sources()[&failed[0].0].contains("/none.png"));
            seen.push((own, failed));
        }
        assert_eq!(seen[0], seen[1]);
    }
}
