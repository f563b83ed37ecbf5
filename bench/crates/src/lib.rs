//! The time of the project's own crates on this machine: `cargo bench --package bench-crates`, in `bench`.
