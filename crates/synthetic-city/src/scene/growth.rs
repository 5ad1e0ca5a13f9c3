//! Plants beyond street trees and gardens, each kind in a file of its own.

pub(crate) mod crops;
pub(crate) mod grove;
pub(crate) mod hedges;
pub(crate) mod tropics;
