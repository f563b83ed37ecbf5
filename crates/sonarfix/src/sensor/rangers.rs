//! What a robot has of each of its rangers.
//!
//! # Non-finite policy
//! Values are stored as they are; the check of the configuration refuses those that are not finite.

use crate::sensor::ranger::RangerId;

/// The largest number of rangers of a robot: one without the feature `rangers`.
pub const MAX_RANGERS: usize = if cfg!(feature = "rangers") { 3 } else { 1 };

/// One value for each ranger, in the order of the robot file. There is at least one.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Rangers<T> {
    /// That of the first ranger, [`RangerId::FIRST`].
    pub first: T,
    further: Further<T>,
}

/// There are as many as a robot can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooMany;

impl<T> Rangers<T> {
    /// That of a robot with one ranger.
    pub const fn one(first: T) -> Self {
        Self { first, further: Further([const { None }; MAX_RANGERS - 1]) }
    }

    /// Adds that of one more ranger.
    ///
    /// # Errors
    /// [`TooMany`]; nothing has changed.
    pub fn push(&mut self, value: T) -> Result<(), TooMany> {
        self.further.push(value)
    }

    /// That of one ranger; `None` if the robot has no such one.
    #[must_use]
    pub fn get(&self, ranger: RangerId) -> Option<&T> {
        match ranger.index().checked_sub(1) {
            None => Some(&self.first),
            Some(further) => self.further.0.get(further)?.as_ref(),
        }
    }

    /// Whether there is more than one ranger.
    #[must_use]
    pub fn are_several(&self) -> bool {
        self.further.0.iter().any(Option::is_some)
    }

    /// All rangers with what there is of them.
    pub fn iter(&self) -> impl Iterator<Item = (RangerId, &T)> {
        let all = core::iter::once(&self.first).chain(self.after_first());
        (0..).map(RangerId).zip(all)
    }

    /// That of the rangers after the first.
    pub(crate) fn after_first(&self) -> impl Iterator<Item = &T> {
        self.further.0.iter().flatten()
    }

    /// That of all rangers, to be changed.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        core::iter::once(&mut self.first).chain(self.further.0.iter_mut().flatten())
    }
}

/// That of the rangers after the first.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
struct Further<T>([Option<T>; MAX_RANGERS - 1]);

impl<T> Further<T> {
    fn push(&mut self, value: T) -> Result<(), TooMany> {
        let free = self.0.iter_mut().find(|place| place.is_none());
        *free.ok_or(TooMany)? = Some(value);
        Ok(())
    }
}

#[cfg(feature = "serde")]
impl<T: serde::Serialize> serde::Serialize for Further<T> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeSeq;
        let mut sequence = serializer.serialize_seq(Some(self.0.iter().flatten().count()))?;
        for value in self.0.iter().flatten() {
            sequence.serialize_element(value)?;
        }
        sequence.end()
    }
}

#[cfg(feature = "serde")]
impl<'de, T: serde::Deserialize<'de>> serde::Deserialize<'de> for Further<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Visitor<T>(core::marker::PhantomData<T>);

        impl<'de, T: serde::Deserialize<'de>> serde::de::Visitor<'de> for Visitor<T> {
            type Value = Further<T>;

            fn expecting(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
                f.write_str("the rangers after the first")
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(
                self,
                mut sequence: A,
            ) -> Result<Further<T>, A::Error> {
                let mut all = Further([const { None }; MAX_RANGERS - 1]);
                while let Some(value) = sequence.next_element()? {
                    all.push(value).map_err(|TooMany| {
                        serde::de::Error::invalid_length(MAX_RANGERS, &"fewer rangers")
                    })?;
                }
                Ok(all)
            }
        }

        deserializer.deserialize_seq(Visitor(core::marker::PhantomData))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_added_up_to_the_capacity() {
        let mut rangers = Rangers::one('a');
        assert!(!rangers.are_several());
        assert_eq!([rangers.push('b'), rangers.push('c')], [Ok(()); MAX_RANGERS - 1]);
        assert_eq!(rangers.push('d'), Err(TooMany));
        assert_eq!(
            [0, 1, 2, 3].map(|number| rangers.get(RangerId(number)).copied()),
            [Some('a'), Some('b'), Some('c'), None]
        );
        rangers.iter_mut().for_each(char::make_ascii_uppercase);
        let all = [(RangerId(0), &'A'), (RangerId(1), &'B'), (RangerId(2), &'C')];
        assert!(rangers.iter().eq(all) && rangers.are_several());
    }
}
