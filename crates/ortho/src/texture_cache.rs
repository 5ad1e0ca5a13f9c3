//! A cache of decoded textures, bounded in bytes and shared by all threads.

use crate::{Texture, TextureSource};
use gable_scene::Material;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

/// A decoded image: sRGB texels row by row from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DecodedImage {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width · height` texels.
    pub texels: Vec<[u8; 3]>,
}

/// Why an image could not be loaded.
pub type LoadError = Box<dyn std::error::Error + Send + Sync>;

type Loader = Box<dyn Fn(&Material) -> Result<DecodedImage, LoadError> + Send + Sync>;
type Slot = Arc<OnceLock<Option<Arc<Texture>>>>;

/// Textures of a scene, decoded when first wanted and dropped when others need the room.
///
/// - Threads that want the same texture at once wait for one decoding; nothing is decoded twice while it is held.
/// - When more than `capacity` bytes are held, the least recently used textures go. What a thread is using stays
///   alive until it lets go, so peak memory is the capacity plus one texture per thread.
/// - A texture that cannot be read is tried once, noted in [`TextureCache::failures`], and its material shown in
///   its plain colour.
pub struct TextureCache {
    materials: Vec<Material>,
    /// For each material, the first one with the same texture: materials that share an image share its decoding.
    first: Vec<u32>,
    loader: Loader,
    capacity: usize,
    state: Mutex<State>,
}

#[derive(Default)]
struct State {
    /// Slot and time of last use, by the first material with the texture.
    slots: BTreeMap<u32, (Slot, u64)>,
    /// What is decoded, likewise.
    held: BTreeMap<u32, usize>,
    bytes: usize,
    clock: u64,
    decoded: u64,
    failures: BTreeMap<PathBuf, String>,
}

impl TextureCache {
    /// A cache of at most `capacity` bytes for the textures of `materials`; `loader` reads the image of one.
    pub fn new(
        materials: Vec<Material>,
        capacity: usize,
        loader: impl Fn(&Material) -> Result<DecodedImage, LoadError> + Send + Sync + 'static,
    ) -> Self {
        let mut seen = std::collections::HashMap::new();
        let first = (0u32..)
            .zip(&materials)
            .map(|(i, m)| m.texture.as_ref().map_or(i, |t| *seen.entry(t.clone()).or_insert(i)))
            .collect();
        Self { materials, first, loader: Box::new(loader), capacity, state: Mutex::default() }
    }

    /// Textures that could not be read so far, with the reason, by path.
    #[must_use]
    pub fn failures(&self) -> Vec<(PathBuf, String)> {
        self.state().failures.iter().map(|(p, m)| (p.clone(), m.clone())).collect()
    }

    /// Bytes held now.
    #[must_use]
    pub fn bytes(&self) -> usize {
        self.state().bytes
    }

    /// How many images have been decoded so far.
    #[must_use]
    pub fn decoded(&self) -> u64 {
        self.state().decoded
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn get(&self, key: u32) -> Option<Arc<Texture>> {
        let slot = {
            let mut state = self.state();
            state.clock += 1;
            let clock = state.clock;
            let (slot, used) = state.slots.entry(key).or_default();
            *used = clock;
            slot.clone()
        };
        slot.get_or_init(|| self.load(key)).clone()
    }

    fn load(&self, key: u32) -> Option<Arc<Texture>> {
        let material = self.materials.get(key as usize)?;
        let path = material.texture.as_ref()?.file();
        let loaded = (self.loader)(material).map_err(|e| e.to_string()).and_then(|image| {
            Texture::new(image.width, image.height, image.texels).ok_or_else(|| "the image has no texels".to_owned())
        });
        let mut state = self.state();
        state.decoded += 1;
        match loaded {
            Ok(texture) => {
                let bytes = texture.bytes();
                state.held.insert(key, bytes);
                state.bytes += bytes;
                state.make_room(self.capacity, key);
                Some(Arc::new(texture))
            }
            Err(reason) => {
                tracing::debug!(path = %path.display(), reason, "texture left out, the material is shown in plain colour");
                state.failures.insert(path.to_owned(), reason);
                None
            }
        }
    }
}

impl State {
    /// Drops the least recently used textures, but not `keep`, until the rest fits.
    fn make_room(&mut self, capacity: usize, keep: u32) {
        while self.bytes > capacity {
            let used = |key: &u32| self.slots.get(key).map_or(0, |s| s.1);
            let Some(oldest) = self.held.keys().filter(|&&k| k != keep).min_by_key(|k| used(k)).copied() else {
                return;
            };
            self.bytes -= self.held.remove(&oldest).unwrap_or(0);
            self.slots.remove(&oldest);
        }
    }
}

impl TextureSource for TextureCache {
    fn texture(&self, material: u32) -> Option<Arc<Texture>> {
        self.materials.get(material as usize)?.texture.as_ref()?;
        self.get(self.first[material as usize])
    }

    fn colour(&self, material: u32) -> [u8; 3] {
        self.materials.get(material as usize).map_or([128; 3], |m| m.colour)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn materials(n: usize) -> Vec<Material> {
        let texture = |i: usize| Some(gable_scene::TextureSource::File(format!("{i}").into()));
        (0..n).map(|i| Material { name: String::new(), texture: texture(i), colour: [9; 3] }).collect()
    }

    #[test]
    fn decodes_once_and_stays_within_its_bytes() {
        // 4 × 4 texels and the pyramid: 21 texels, 63 bytes.
        let loader = |_: &Material| Ok(DecodedImage { width: 4, height: 4, texels: vec![[7; 3]; 16] });
        let cache = TextureCache::new(materials(3), 130, loader);
        std::thread::scope(|s| {
            for _ in 0..4 {
                s.spawn(|| (0..100).for_each(|i| assert!(cache.texture(i % 2).is_some())));
            }
        });
        assert_eq!((cache.decoded(), cache.bytes()), (2, 126));
        cache.texture(0);
        cache.texture(2);
        cache.texture(0);
        assert_eq!((cache.decoded(), cache.bytes()), (3, 126), "the least recently used one went");
        cache.texture(1);
        assert_eq!(cache.decoded(), 4);
        assert!(cache.texture(u32::MAX).is_none());
    }

    #[test]
    fn notes_what_cannot_be_read() {
        let cache = TextureCache::new(materials(1), 100, |_| Err("no such file".into()));
        assert!(cache.texture(0).is_none() && cache.texture(0).is_none());
        assert_eq!(cache.decoded(), 1);
        assert_eq!(cache.failures(), vec![(PathBuf::from("0"), "no such file".to_owned())]);
        assert_eq!(cache.colour(0), [9; 3]);
        assert_eq!(cache.colour(7), [128; 3]);
    }
}
