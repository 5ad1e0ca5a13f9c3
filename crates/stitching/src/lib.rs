//! stitching
