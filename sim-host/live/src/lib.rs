//! A page on this computer that shows a robot, a recording or a simulation as it runs.
//!
//! ```text
//! robot ──────────────┐                    ┌──▶ a page
//! replay    ──▶ paced ┼──▶ feed ──▶ ring ──┤
//! simulation ─▶ paced ┘                    └──▶ a page
//!    ▲            ▲                               │
//!    └────────────┴──────────── order ────────────┘
//! ```
//!
//! Robot, feed and order are those of `sonarfix_telemetry`.
//!
//! | module | what |
//! |---|---|
//! | [`server`] | connections, and what each may ask for |
//! | [`connection`] | their deadlines and their number |
//! | [`access`] | who may ask: this computer, a page of this server, with the token |
//! | [`http`] | requests and answers |
//! | [`ring`] | the latest events, in bounded memory |
//! | [`paced`] | a simulation or a replay at a speed |
//! | [`page`] | the page: `live.html`, `live.css`, `live.js`, the drawing and the curves of the report, and `server.js`, its connection to the server |

pub mod access;
pub mod connection;
pub mod http;
pub mod paced;
pub mod page;
pub mod ring;
pub mod server;
