//! What a robot has of each ranger beside the first.
//!
//! # Non-finite policy
//! Values are stored as they are; the check of the configuration refuses those that are not finite.

/// The largest number of rangers of a robot: one without the feature `rangers`.
pub const MAX_RANGERS: usize = if cfg!(feature = "rangers") { 3 } else { 1 };

/// One value for each ranger beside the first, in the order of the robot file.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Further<T>([Option<T>; MAX_RANGERS - 1]);

/// There are as many as a robot can have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooMany;

impl<T> Further<T> {
    /// None: the robot has one ranger.
    pub const NONE: Self = Self([const { None }; MAX_RANGERS - 1]);

    /// Adds that of one more ranger.
    ///
    /// # Errors
    /// [`TooMany`]; nothing has changed.
    pub fn push(&mut self, value: T) -> Result<(), TooMany> {
        let free = self.0.iter_mut().find(|place| place.is_none());
        *free.ok_or(TooMany)? = Some(value);
        Ok(())
    }

    /// Whether nothing follows the first.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    /// That of the ranger with this number after the first.
    #[must_use]
    pub fn get(&self, number: usize) -> Option<&T> {
        self.0.get(number)?.as_ref()
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &T> {
        self.0.iter().flatten()
    }

    /// All of them, to be changed.
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.0.iter_mut().flatten()
    }
}

#[cfg(feature = "serde")]
impl<T: serde::Serialize> serde::Serialize for Further<T> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        use serde::ser::SerializeSeq;
        let mut sequence = serializer.serialize_seq(Some(self.iter().count()))?;
        for value in self.iter() {
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
                f.write_str("the rangers beside the first")
            }

            fn visit_seq<A: serde::de::SeqAccess<'de>>(
                self,
                mut sequence: A,
            ) -> Result<Further<T>, A::Error> {
                let mut all = Further::NONE;
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
        let mut further = Further::NONE;
        assert!(further.is_empty());
        assert_eq!([further.push('a'), further.push('b')], [Ok(()); MAX_RANGERS - 1]);
        assert_eq!(further.push('c'), Err(TooMany));
        assert_eq!(
            [further.get(0), further.get(1), further.get(2)],
            [Some(&'a'), Some(&'b'), None]
        );
        further.iter_mut().for_each(char::make_ascii_uppercase);
        assert!(further.iter().eq(&['A', 'B']) && !further.is_empty());
    }
}
