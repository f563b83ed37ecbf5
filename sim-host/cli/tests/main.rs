//! Tests of the command and of the packages behind it, in one program, which links once.

mod calibrate;
mod chromium;
mod command;
mod common;
mod convert;
mod endings;
mod export;
mod find;
mod guide;
mod init;
mod link_command;
mod live;
mod map_command;
mod map_exchange;
mod measure;
mod monitor;
mod plan;
mod recordings;
mod replay;
mod replay_command;
mod report_in_chromium;
mod rows;
mod signs_of_life;
mod skipped;
mod survey;
mod terminal;
