//! modeling
