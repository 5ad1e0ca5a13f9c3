//! What can be wrong with what is to be measured.

/// An evaluation that cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// A raster of labels does not have the size that it should.
    #[error("the {which} labels have {found} pixels, expected {width} × {height}")]
    Labels {
        /// Truth or result.
        which: &'static str,
        /// Pixels found.
        found: usize,
        /// Columns.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// A step or density that cannot be measured with.
    #[error("{name} is {value}, give a positive number")]
    Option {
        /// Name of the option.
        name: &'static str,
        /// Its value.
        value: f64,
    },
    /// A file of outlines drawn by hand is not what it should be.
    #[error("{file}: {what}")]
    Outlines {
        /// Its name.
        file: String,
        /// What is wrong, and where.
        what: String,
    },
    /// Nothing can be judged.
    #[error("the mesh has no surface in the judged area; are mesh and outlines in the same frame?")]
    Apart,
    /// A judged area that memory does not hold.
    #[error("the judged area has more than 15 km²; limit it by polygons of the class area")]
    TooLarge,
    /// A model that no city has: measuring it would fill the memory.
    #[error("{what}: is it in metres?")]
    NoCity {
        /// What of it, and how large it may be.
        what: String,
    },
    /// A picture of the report could not be made.
    #[error("cannot encode a picture of the report: {0}")]
    Picture(#[from] image::ImageError),
}

/// Refuses what is not a positive finite number.
pub(crate) fn positive(name: &'static str, value: f64) -> Result<(), Error> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(Error::Option { name, value }) }
}
