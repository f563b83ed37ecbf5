//! Properties of the search and of the navigator.

#[cfg(test)]
mod light;
#[cfg(test)]
mod navigator;
#[cfg(test)]
mod search;
