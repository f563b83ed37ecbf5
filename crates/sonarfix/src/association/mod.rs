//! What a ping returned: which walls can be measured, what of the map may answer, and how far an echo is believed.

pub(crate) mod alternatives;
pub(crate) mod clutter;
pub mod echo;
pub(crate) mod gating;
pub(crate) mod history;
pub(crate) mod outcome;
pub mod reflector;
pub(crate) mod reliability;
pub(crate) mod visibility;
