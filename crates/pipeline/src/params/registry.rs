//! The methods that this program has, found by name.

use gable_modeling::Reconstruction;
use gable_segmentation::Labeller;
use std::sync::OnceLock;

/// The methods of labelling and of reconstruction, each list with the default first.
#[derive(Clone)]
pub struct Registry {
    labellers: Vec<&'static dyn Labeller>,
    reconstructions: Vec<&'static dyn Reconstruction>,
}

static REGISTRY: OnceLock<Registry> = OnceLock::new();

/// The name that both default methods had once; jobs and config files may still say it.
const FORMER_DEFAULT: &str = "gable";

/// The methods of a program are already in use and cannot be changed any more.
#[derive(Debug, thiserror::Error)]
#[error("the methods are in use already: install them before anything else")]
pub struct InstalledTooLate;

impl Registry {
    /// The methods that come with this program.
    #[must_use]
    pub fn built_in() -> Self {
        Self { labellers: gable_segmentation::LABELLERS.to_vec(), reconstructions: gable_modeling::METHODS.to_vec() }
    }

    /// The same with another method of labelling.
    #[must_use]
    pub fn with_labeller(mut self, labeller: &'static dyn Labeller) -> Self {
        self.labellers.push(labeller);
        self
    }

    /// The same with another method of reconstruction.
    #[must_use]
    pub fn with_reconstruction(mut self, reconstruction: &'static dyn Reconstruction) -> Self {
        self.reconstructions.push(reconstruction);
        self
    }

    /// Makes these the methods of the process.
    ///
    /// # Errors
    /// If there are some already: a list of parameters that changes under its readers would be worse.
    pub fn install(self) -> Result<(), InstalledTooLate> {
        REGISTRY.set(self).map_err(|_| InstalledTooLate)
    }

    /// The methods of the process: those that were installed, else those that come with this program.
    #[must_use]
    pub fn get() -> &'static Self {
        REGISTRY.get_or_init(Self::built_in)
    }

    /// All methods of labelling, the default first.
    #[must_use]
    pub fn labellers(&self) -> &[&'static dyn Labeller] {
        &self.labellers
    }

    /// All methods of reconstruction, the default first.
    #[must_use]
    pub fn reconstructions(&self) -> &[&'static dyn Reconstruction] {
        &self.reconstructions
    }

    /// The method of labelling of a name.
    #[must_use]
    pub fn labeller(&self, name: &str) -> Option<&'static dyn Labeller> {
        let default = self.labellers.first().filter(|_| name == FORMER_DEFAULT);
        self.labellers.iter().find(|method| method.name() == name).or(default).copied()
    }

    /// The method of reconstruction of a name.
    #[must_use]
    pub fn reconstruction(&self, name: &str) -> Option<&'static dyn Reconstruction> {
        let default = self.reconstructions.first().filter(|_| name == FORMER_DEFAULT);
        self.reconstructions.iter().find(|method| method.name() == name).or(default).copied()
    }
}

impl std::fmt::Debug for Registry {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let labellers: Vec<&str> = self.labellers.iter().map(|method| method.name()).collect();
        let reconstructions: Vec<&str> = self.reconstructions.iter().map(|method| method.name()).collect();
        f.debug_struct("Registry").field("labellers", &labellers).field("reconstructions", &reconstructions).finish()
    }
}
