//! A page on this computer that shows a robot, a recording or a simulation as it runs.
//!
//! ```text
//! telemetry ──▶ robot ──┐                    ┌──▶ a page
//! replay    ──▶ paced ──┼──▶ feed ──▶ ring ──┤
//! simulation ─▶ paced ──┘                    └──▶ a page
//!                 ▲                               │
//!                 └──────────── order ────────────┘
//! ```
//!
//! | module | what |
//! |---|---|
//! | [`server`] | connections, and what each may ask for |
//! | [`connection`] | their deadlines and their number |
//! | [`access`] | who may ask: this computer, a page of this server, with the token |
//! | [`http`] | requests and answers |
//! | [`ring`] | the latest events, in bounded memory |
//! | [`feed`] | records of a run as events |
//! | [`robot`] | a robot's telemetry as events; commands to it |
//! | [`paced`] | a simulation or a replay at a speed |
//! | [`order`] | what a page may ask for |
//! | [`page`] | the page: `live.html`, `live.css`, `live.js`, `curves.js`, and the drawing of the report's player |

pub mod access;
pub mod connection;
pub mod feed;
pub mod http;
pub mod order;
pub mod paced;
pub mod page;
pub mod ring;
pub mod robot;
pub mod server;
