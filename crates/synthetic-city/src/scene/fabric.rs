//! Materials, roofs and constructions that the town has not, each kind in a file of its own.

pub(crate) mod battered;
pub(crate) mod eaves;
pub(crate) mod glass;
pub(crate) mod green_roofs;
pub(crate) mod long_hall;
pub(crate) mod pergolas;
pub(crate) mod sheets;
pub(crate) mod tarpaulins;
pub(crate) mod towers;
