//! The bench's six-state filter, written with Sonarfix's own kernel, the one that ships.

#![no_std]
