//! The four classes of the orthograph.

/// Class of a pixel (Zhu 2018, §4.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[repr(u8)]
pub enum Label {
    /// Bare or paved ground, water, low clutter; also pixels that no surface covers.
    Ground = 0,
    /// Low vegetation.
    Grass = 1,
    /// High vegetation.
    Tree = 2,
    /// Building.
    Building = 3,
}

impl Label {
    /// All classes, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Ground, Self::Grass, Self::Tree, Self::Building];

    /// The class with a number, if there is one.
    #[must_use]
    pub fn from_u8(value: u8) -> Option<Self> {
        Self::ALL.get(usize::from(value)).copied()
    }

    /// The class in words.
    #[must_use]
    pub fn name(self) -> &'static str {
        ["ground", "grass", "tree", "building"][self as usize]
    }

    /// The colour of the class in pictures (brown, light green, dark green, blue, as in Zhu 2018, Fig. 5).
    #[must_use]
    pub fn colour(self) -> [u8; 3] {
        [[176, 148, 112], [150, 210, 110], [24, 110, 44], [62, 110, 200]][self as usize]
    }
}
