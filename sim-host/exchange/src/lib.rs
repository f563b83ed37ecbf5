//! Recordings and traces in the formats of other programs (`docs/exchange.md`).
//!
//! | module | what |
//! |---|---|
//! | [`row`] | the columns of a trace, and its rows as a run proceeds |
//! | [`trace_csv`] | rows as CSV |
//! | [`recorded`] | the records of a run from the rows of its trace |
//! | [`trace_parquet`] | rows as Parquet |
//! | [`mcap_file`] | rows and the records of a log as MCAP |
//! | `scene` | the messages for a picture: poses, map, beam |
//! | `schema` | the JSON schemas of the messages |
//! | `log_messages` | the records of a log as messages |

mod log_messages;
pub mod mcap_file;
pub mod recorded;
pub mod row;
mod scene;
mod schema;
pub mod trace_csv;
pub mod trace_parquet;
