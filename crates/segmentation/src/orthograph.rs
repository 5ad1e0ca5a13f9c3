//! What the labelling looks at: the maps of one window.

use gable_raster::Raster;

use crate::Error;

/// The colour, height and normal maps of one window.
#[derive(Clone, Copy, Debug)]
pub struct Orthograph<'a> {
    /// Orthophoto, 8-bit sRGB; none for untextured input.
    pub colour: Option<&'a Raster<[u8; 3]>>,
    /// Height of the topmost surface, local metres; NaN where there is none.
    pub height: &'a Raster<f32>,
    /// Unit normal of that surface, z up.
    pub normal: &'a Raster<[f32; 3]>,
}

impl Orthograph<'_> {
    /// Checks that the maps lie on one window.
    ///
    /// # Errors
    /// If they do not.
    pub fn check(&self) -> Result<(), Error> {
        let window = self.height.window();
        if self.normal.window() != window {
            return Err(Error::WindowMismatch { what: "normal" });
        }
        if self.colour.is_some_and(|colour| colour.window() != window) {
            return Err(Error::WindowMismatch { what: "colour" });
        }
        Ok(())
    }
}
