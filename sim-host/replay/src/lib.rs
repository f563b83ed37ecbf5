//! Replays the recording of a robot through the shipped localizer, with the same inputs at the same
//! instants as on the robot.
//!
//! A range belongs to the instant of the measurement, between two encoder records. It therefore
//! waits for the next encoder record. The travel between the two records is then interpolated
//! linearly in time: the localizer receives the travel up to the range, the range, and the remaining
//! travel. Rows of the reference are compared likewise, each at its own time. Nothing else is
//! held, so memory does not grow with the log.
//!
//! From a scan, the replay simulates a rotating sonar: whenever a range is due, the localizer chooses
//! a bearing, and the nearest return inside the sonar's cone is the range.
//!
//! | module | what |
//! |---|---|
//! | [`log`], `lines` | the log format, and lines that may be damaged |
//! | `reference` | the true poses, read in step with the log |
//! | `session` | the replay itself |
//! | `measured` | walls that were measured in a scan |
//! | `estimators` | navigator, search and dead reckoning |
//! | `wheels` | travel between two readings of the encoders |
//! | `gap` | periods in which a robot could not read its encoders |
//! | [`scan`] | the range of a sonar cone in a scan |
//! | `score`, `median` | errors, and the health verdicts over time |
//! | [`thinned`] | a trace of bounded size |
//! | [`fault`] | errors |
//! | [`diagnosis`] | what is wrong with a log and its files |
//! | [`find`] | the search for the pose on a log |
//! | [`convert`] | recordings of other formats |

pub mod convert;
pub mod diagnosis;
mod estimators;
pub mod fault;
pub mod find;
mod gap;
pub mod lines;
pub mod log;
mod measured;
mod median;
mod reference;
mod replay;
pub mod scan;
mod score;
mod session;
pub mod thinned;
mod turns;
mod wheels;

pub use estimators::Searches;
pub use lines::{LONGEST, Lines};
pub use reference::HEADER as REFERENCE_HEADER;
pub use replay::{Replay, Summary};
pub use score::{ByVerdict, Consistency, Delay, Figures, FiguresByVerdict, Loss, Score, Verdicts};
