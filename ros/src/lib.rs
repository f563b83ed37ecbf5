//! A ROS 2 node that localizes a robot with encoders and sonar, in the place of AMCL.
//!
//! | module | what |
//! |---|---|
//! | [`parameters`] · [`arguments`] · [`names`] | the parameters with their descriptions; the command line; names and remapping |
//! | [`lifecycle`] | the states of a managed node |
//! | [`problem`] | what can be wrong with the inputs, by name |
//! | [`motion`] · [`turns`] · [`ranges`] · [`walls`] | messages as travels of wheels, turns, ranges along bearings, and walls |
//! | [`timeline`] | the localizer, which takes late ranges at their time |
//! | [`search_motion`] | the motion that the node requests while it searches |
//! | [`view`] · [`markers`] · [`report`] | the estimate as messages |
//! | [`publication`] · [`interfaces`] · [`descriptors`] | what is published; the services' messages; parameters as such |
//! | [`bridge`] | a robot with our firmware behind a serial link |
//! | [`managed`] | the node with its states, parameters and services; no DDS, no clock |
//! | [`discovered`] · [`graph`] · [`port`] · [`program`] | the readers of others, topics and services over DDS; the robot's port; the program |
//! | [`drive`] | a simulated drive as messages, for tests and measurements |
//! | [`hostile`] | bytes that are no messages, for tests and measurements |
//! | [`node`] | the node: messages in, messages out; no DDS, no clock |

pub mod arguments;
pub mod bridge;
pub mod descriptors;
pub mod discovered;
pub mod drive;
pub mod graph;
pub mod hostile;
pub mod interfaces;
pub mod lifecycle;
pub mod managed;
pub mod markers;
pub mod motion;
pub mod names;
pub mod node;
pub mod parameters;
pub mod port;
pub mod problem;
pub mod program;
pub mod publication;
pub mod ranges;
pub mod report;
pub mod search_motion;
pub mod timeline;
pub mod turns;
pub mod view;
pub mod walls;
