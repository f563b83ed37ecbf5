//! What this computer must compute to the bit: the answers of the golden traces, and whole simulated runs.

mod runs;
mod traces;
