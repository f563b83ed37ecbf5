//! A robot on this PC: its port, its telemetry on a terminal and in files, and the commands to it.
//!
//! | module | what |
//! |---|---|
//! | [`port`] | serial ports, sockets and files |
//! | [`self_test`] | a report of a board |
//! | [`request`] | one command |
//! | [`route`] | driving along a route |
//! | [`teleoperation`] | driving by keys |
//! | [`terminal`] | the latest telemetry on a terminal |
//! | [`log_files`] | the logs of a recording as files |
//! | [`simulated`] | a simulated drive as such a log |

pub mod log_files;
pub mod port;
pub mod request;
pub mod route;
pub mod self_test;
pub mod simulated;
pub mod teleoperation;
pub mod terminal;
