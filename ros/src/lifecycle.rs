//! The states of a managed node, as those of `lifecycle_msgs`.
//!
//! ```text
//!                configure              activate
//!   unconfigured ─────────▶ inactive ─────────────▶ active
//!        ▲  ◀───────────────    ▲  ◀───────────────   │
//!        │      cleanup         └──── deactivate ─────┘
//!        │ error in a transition            shutdown from each: finalized
//! ```

/// A primary state, with its number in `lifecycle_msgs/State`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[repr(u8)]
pub enum State {
    /// Nothing is read or published.
    #[default]
    Unconfigured = 1,
    /// The files are read, the topics exist, and inputs are taken; nothing is published.
    Inactive = 2,
    /// The estimate is published.
    Active = 3,
    /// The end.
    Finalized = 4,
}

impl State {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Unconfigured, Self::Inactive, Self::Active, Self::Finalized];

    /// Its name in `lifecycle_msgs/State`.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Unconfigured => "unconfigured",
            Self::Inactive => "inactive",
            Self::Active => "active",
            Self::Finalized => "finalized",
        }
    }
}

/// A transition that a client can ask for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Transition {
    /// Reads the files and creates the topics.
    Configure,
    /// Forgets everything that was configured.
    Cleanup,
    /// Begins to publish.
    Activate,
    /// Ends to publish.
    Deactivate,
    /// Ends the node.
    Shutdown,
}

impl Transition {
    /// All of them.
    pub const ALL: [Self; 5] =
        [Self::Configure, Self::Cleanup, Self::Activate, Self::Deactivate, Self::Shutdown];

    /// Its label in `lifecycle_msgs/Transition`.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::Configure => "configure",
            Self::Cleanup => "cleanup",
            Self::Activate => "activate",
            Self::Deactivate => "deactivate",
            Self::Shutdown => "shutdown",
        }
    }

    /// Its number in `lifecycle_msgs/Transition` from a state: that of a shutdown depends on it.
    #[must_use]
    pub fn id(self, from: State) -> u8 {
        match (self, from) {
            (Self::Configure, _) => 1,
            (Self::Cleanup, _) => 2,
            (Self::Activate, _) => 3,
            (Self::Deactivate, _) => 4,
            (Self::Shutdown, State::Inactive) => 6,
            (Self::Shutdown, State::Active) => 7,
            (Self::Shutdown, _) => 5,
        }
    }

    /// The transition of a request: by its number or, if that is 0, by its label.
    #[must_use]
    pub fn of(id: u8, label: &str) -> Option<Self> {
        match id {
            0 => Self::ALL.into_iter().find(|transition| transition.label() == label),
            1 => Some(Self::Configure),
            2 => Some(Self::Cleanup),
            3 => Some(Self::Activate),
            4 => Some(Self::Deactivate),
            5..=7 => Some(Self::Shutdown),
            _ => None,
        }
    }

    /// The state that it leads to; `None` if it is not possible from this state.
    #[must_use]
    pub fn goal(self, from: State) -> Option<State> {
        match (self, from) {
            (Self::Configure, State::Unconfigured) | (Self::Deactivate, State::Active) => {
                Some(State::Inactive)
            }
            (Self::Cleanup, State::Inactive) => Some(State::Unconfigured),
            (Self::Activate, State::Inactive) => Some(State::Active),
            (Self::Shutdown, State::Unconfigured | State::Inactive | State::Active) => {
                Some(State::Finalized)
            }
            _ => None,
        }
    }

    /// Those that are possible from a state, with their goals.
    pub fn possible(from: State) -> impl Iterator<Item = (Self, State)> {
        Self::ALL.into_iter().filter_map(move |it| Some((it, it.goal(from)?)))
    }
}

/// A change of state, as `transition_event` publishes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    /// The transition.
    pub transition: Transition,
    /// The state before.
    pub from: State,
    /// The state after.
    pub to: State,
}

/// The state of the node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Lifecycle {
    state: State,
}

impl Lifecycle {
    /// The state.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// Makes a transition whose work has succeeded or failed. After a failure the state is as before.
    pub fn change(&mut self, transition: Transition, has_succeeded: bool) -> Option<Change> {
        let (from, to) = (self.state, transition.goal(self.state)?);
        self.state = if has_succeeded { to } else { from };
        Some(Change { transition, from, to: self.state })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_manager_leads_the_node_through_its_states() {
        let mut lifecycle = Lifecycle::default();
        let path = [
            (Transition::Configure, State::Inactive),
            (Transition::Activate, State::Active),
            (Transition::Deactivate, State::Inactive),
            (Transition::Cleanup, State::Unconfigured),
            (Transition::Shutdown, State::Finalized),
        ];
        for (transition, state) in path {
            let change = lifecycle.change(transition, true).unwrap();
            assert_eq!(change.to, state);
            assert_eq!(lifecycle.state(), state);
        }
        assert_eq!(Transition::possible(State::Finalized).count(), 0);
    }

    #[test]
    fn what_is_impossible_or_fails_changes_nothing() {
        let mut lifecycle = Lifecycle::default();
        assert_eq!(lifecycle.change(Transition::Activate, true), None);
        let failed = lifecycle.change(Transition::Configure, false).unwrap();
        assert_eq!((failed.from, failed.to), (State::Unconfigured, State::Unconfigured));
        assert_eq!(lifecycle.state(), State::Unconfigured);
    }

    #[test]
    fn numbers_are_those_of_lifecycle_msgs() {
        for (from, id) in [(State::Unconfigured, 5), (State::Inactive, 6), (State::Active, 7)] {
            assert_eq!(Transition::Shutdown.id(from), id);
            assert_eq!(Transition::of(id, ""), Some(Transition::Shutdown));
        }
        assert_eq!(Transition::of(0, "activate"), Some(Transition::Activate));
        assert_eq!(Transition::of(99, "activate"), None);
        assert_eq!(State::Finalized as u8, 4);
    }
}
