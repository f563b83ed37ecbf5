//! A ROS 2 node that localizes a robot with encoders and sonar, in the place of AMCL.
//!
//! | module | what |
//! |---|---|
//! | [`parameters`] · [`arguments`] · [`names`] | the parameters with their descriptions; the command line; names and remapping |
//! | [`lifecycle`] | the states of a managed node |
//! | [`problem`] | what can be wrong with the inputs, by name |
//! | [`transforms`] | the tree of frames |
//! | [`motion`] · [`turns`] · [`ranges`] · [`walls`] | messages as travels of wheels, turns, ranges along bearings, and walls |
//! | [`timeline`] | the localizer, which takes late ranges at their time |
//! | [`view`] · [`markers`] · [`report`] | the estimate as messages |
//! | [`drive`] | a simulated drive as messages, for tests and measurements |
//! | [`node`] | the node: messages in, messages out; no DDS, no clock |

pub mod arguments;
pub mod drive;
pub mod lifecycle;
pub mod markers;
pub mod motion;
pub mod names;
pub mod node;
pub mod parameters;
pub mod problem;
pub mod ranges;
pub mod report;
pub mod timeline;
pub mod transforms;
pub mod turns;
pub mod view;
pub mod walls;
