//! The C interface of [`sonarfix`]. `c/include/sonarfix.h` is generated from this crate, and `c/` builds it as a static library
//! (`docs/c.md`).
//!
//! # The contract with the caller
//! Every function is `unsafe`, because it takes pointers from C. What a function can check it checks: a pointer that is NULL or
//! misaligned, a handle that was not initialised, was closed or was copied, a number that is not finite, an enumeration without such a
//! value. It then returns an error, and nothing has changed. The caller is responsible for the rest:
//!
//! - A pointer that is neither NULL nor misaligned leads to memory of its type, with as many elements as stated.
//! - Walls, images, a search and a store that a handle was initialised with stay where they are, unchanged, until it is closed.
//! - One handle is used by one thread at a time. Different handles are independent, unless one was given to the other.
//!
//! # Structure
//! `memory` holds nearly all code that follows pointers. The other modules define structures and functions of the header.

#![no_std]
#![expect(non_camel_case_types, reason = "the names of the header")]
#![expect(
    clippy::missing_safety_doc,
    reason = "the contract of every function is that of the crate"
)]
#![expect(clippy::doc_markdown, reason = "the comments are those of the header")]
#![allow(
    clippy::enum_glob_use,
    reason = "the names of enumerators are those of the header, each with its prefix"
)]

pub mod aim;
mod arithmetic;
pub mod config;
pub mod fix;
pub mod localizer;
pub mod map;
mod memory;
#[cfg(feature = "robot")]
pub mod robot;
#[cfg(feature = "search")]
pub mod search;
pub mod state;
pub mod status;
#[cfg_attr(not(feature = "search"), path = "lone_tracker.rs")]
mod tracker;
