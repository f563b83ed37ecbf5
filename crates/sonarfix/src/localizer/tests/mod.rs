//! Tests of what the public interface does not show.

mod passage;
mod side_ranger;
