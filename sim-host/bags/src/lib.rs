//! Recordings of ROS 2 (rosbag2): read, converted to a log, and written (`docs/bags.md`).
//!
//! | module | what |
//! |---|---|
//! | [`bag`], [`message`] | a bag and its messages, whatever its storage |
//! | [`sqlite`], `db3` | databases of `SQLite`, and bags in them |
//! | `mcap_file` | bags in MCAP |
//! | `packed` | what zstd and lz4 have packed |
//! | [`definition`], `known` | the definition of a message, from the bag or known |
//! | [`decode`] | a message as values by the names of its fields |
//! | [`recording`] | what of a bag a localizer takes, by topic |
//! | [`convert`] | a bag as a folder for `sonarfix replay` |
//! | [`writer`] | messages into a bag |
//! | [`export`] | a log and its replay as a bag |
//! | [`error`] | why a bag cannot be read or written |

pub mod bag;
pub mod convert;
mod db3;
pub mod decode;
pub mod definition;
pub mod error;
pub mod export;
mod known;
mod mcap_file;
pub mod message;
mod packed;
pub mod recording;
pub mod sqlite;
pub mod writer;
