//! The files of a new robot: what is asked, what is written, and what its board gets. No terminal and no disk: `sonarfix init`,
//! `sonarfix flash` and a page use it.
//!
//! | module | what |
//! |---|---|
//! | [`question`] | the questions, and the answers that each takes |
//! | [`answers`] | the answers to all of them |
//! | [`files`] | the files |
//! | [`flash`] | what goes into the flash of a board |
//! | [`room`] | the room of the map and the path in it |

pub mod answers;
pub mod files;
pub mod flash;
pub mod question;
pub mod room;

pub use answers::Answers;
pub use files::Files;
pub use question::{Question, Refusal};
