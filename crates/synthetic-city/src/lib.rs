//! synthetic-city
