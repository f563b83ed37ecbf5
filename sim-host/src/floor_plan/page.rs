//! What came out of the comparison, for the documentation.
