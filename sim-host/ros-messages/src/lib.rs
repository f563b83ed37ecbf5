//! Messages of ROS 2: their types, their definitions as text, and their bytes.
//!
//! | module | what |
//! |---|---|
//! | [`messages`] | the messages, with the fields and names of ROS's definitions |
//! | [`schema`] | a message's definition as text (`ros2msg`), made from its type |
//! | [`cdr`] | a message as bytes |
//! | [`geometry`] | planar poses, headings and covariances in messages |

pub mod cdr;
pub mod geometry;
pub mod messages;
pub mod schema;
