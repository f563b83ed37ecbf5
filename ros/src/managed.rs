//! The managed node: its states, its parameters, and the answers to its services. No DDS and no clock.

use std::path::Path;
use std::time::Duration;

use anyhow::{Context, ensure};
use sonarfix_link::Command;
use sonarfix_map::robot_file;
use sonarfix_ros_messages::messages::{PoseWithCovarianceStamped, Time};

use crate::bridge::Bridge;
use crate::descriptors;
use crate::interfaces::{
    ChangeStateRequest, ChangeStateResponse, DescribeParametersResponse,
    GetAvailableStatesResponse, GetAvailableTransitionsResponse, GetParameterTypesResponse,
    GetParametersResponse, GetStateResponse, ListParametersRequest, ListParametersResponse,
    Parameter, ParameterEvent, ParameterNames, SetParametersAtomicallyResponse,
    SetParametersRequest, SetParametersResponse, SetParametersResult, StateMessage,
    TransitionDescription, TransitionEvent, TransitionMessage, TriggerResponse,
};
use crate::lifecycle::{Change, Lifecycle, State, Transition};
use crate::node::{Input, Node};
use crate::parameters::{ParameterError, Parameters};
use crate::problem::Nanoseconds;
use crate::publication::Output;
use crate::walls::Walls;

/// What localizes.
enum Core {
    /// This program.
    Host(Box<Node>),
    /// A robot behind the link.
    Bridge(Box<Bridge>),
}

/// What is to be done outside.
#[derive(Debug, Clone, PartialEq)]
pub enum Effect {
    /// To publish a message.
    Publish(Output),
    /// To publish a change of state, and to create or remove the topics.
    Changed(Change, TransitionEvent),
    /// To publish a change of parameters.
    Parameters(ParameterEvent),
    /// To print a line.
    Note(String),
}

/// The managed node.
pub struct Managed {
    name: String,
    parameters: Parameters,
    lifecycle: Lifecycle,
    core: Option<Core>,
    effects: Vec<Effect>,
}

impl Managed {
    /// A node of this full name that is not configured.
    #[must_use]
    pub fn new(name: String, parameters: Parameters) -> Self {
        Self { name, parameters, lifecycle: Lifecycle::default(), core: None, effects: Vec::new() }
    }

    /// The parameters.
    #[must_use]
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The state.
    #[must_use]
    pub fn state(&self) -> State {
        self.lifecycle.state()
    }

    /// What is to be done since the last call.
    pub fn effects(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.effects)
    }

    /// Takes a message that arrived at `now`.
    pub fn take(&mut self, input: Input, now: Nanoseconds) {
        let out = match (&mut self.core, input) {
            (Some(Core::Host(node)), input) => node.take(input, now),
            (Some(Core::Bridge(bridge)), Input::InitialPose(message)) => {
                bridge.set_pose(&message, now);
                Vec::new()
            }
            (Some(Core::Bridge(bridge)), Input::SearchAnywhere) => {
                bridge.command(Command::Search);
                Vec::new()
            }
            (Some(Core::Bridge(bridge)), _) => bridge.take(&[], now),
            (None, _) => Vec::new(),
        };
        self.effects.extend(out.into_iter().map(Effect::Publish));
    }

    /// Takes bytes of the robot behind the link; none: the port has failed.
    pub fn take_bytes(&mut self, bytes: Option<&[u8]>, now: Nanoseconds) {
        let Some(Core::Bridge(bridge)) = &mut self.core else { return };
        match bytes {
            Some(bytes) => {
                let out = bridge.take(bytes, now);
                self.effects.extend(out.into_iter().map(Effect::Publish));
            }
            None => bridge.port_failed(now),
        }
    }

    /// The bytes to send to the robot now. `time` is that since any fixed moment, and never goes back.
    pub fn to_send(&mut self, time: Duration, now: Nanoseconds) -> Option<Vec<u8>> {
        match &mut self.core {
            Some(Core::Bridge(bridge)) => bridge.to_send(time, now),
            _ => None,
        }
    }

    /// Makes a transition; whether it is possible and has succeeded.
    pub fn change(&mut self, transition: Transition, now: Nanoseconds) -> bool {
        if transition.goal(self.state()).is_none() {
            let note =
                format!("{} is not possible while {}", transition.label(), self.state().label());
            self.effects.push(Effect::Note(note));
            return false;
        }
        let done = self.work(transition);
        if let Err(error) = &done {
            self.effects.push(Effect::Note(format!("cannot {}: {error:#}", transition.label())));
        }
        if let Some(change) = self.lifecycle.change(transition, done.is_ok()) {
            self.effects.push(Effect::Changed(change, event(change, now)));
        }
        done.is_ok()
    }

    fn work(&mut self, transition: Transition) -> anyhow::Result<()> {
        match transition {
            Transition::Configure => self.core = Some(configured(&self.parameters)?),
            Transition::Activate => self.set_active(true),
            Transition::Deactivate => self.set_active(false),
            Transition::Cleanup | Transition::Shutdown => {
                self.set_active(false);
                self.core = None;
            }
        }
        Ok(())
    }

    fn set_active(&mut self, is_active: bool) {
        match &mut self.core {
            Some(Core::Host(node)) => {
                self.effects.extend(node.set_active(is_active).map(Effect::Publish));
            }
            Some(Core::Bridge(bridge)) => bridge.set_active(is_active),
            None => {}
        }
    }

    /// Answers `change_state`.
    pub fn change_state(
        &mut self,
        request: &ChangeStateRequest,
        now: Nanoseconds,
    ) -> ChangeStateResponse {
        let transition = Transition::of(request.transition.id, &request.transition.label);
        ChangeStateResponse { success: transition.is_some_and(|it| self.change(it, now)) }
    }

    /// Answers `get_state`.
    #[must_use]
    pub fn get_state(&self) -> GetStateResponse {
        GetStateResponse { current_state: state_message(self.state()) }
    }

    /// Answers `set_parameters`.
    pub fn set_parameters(
        &mut self,
        request: &SetParametersRequest,
        now: Nanoseconds,
    ) -> SetParametersResponse {
        let mut changed = Vec::new();
        let results = request.parameters.iter().map(|parameter| {
            let result = self.set(parameter);
            if result.is_ok() {
                changed.push(parameter.clone());
            }
            result_message(&result)
        });
        let results = results.collect();
        self.parameters_changed(changed, now);
        SetParametersResponse { results }
    }

    /// Answers `set_parameters_atomically`: all or none.
    pub fn set_atomically(
        &mut self,
        request: &SetParametersRequest,
        now: Nanoseconds,
    ) -> SetParametersAtomicallyResponse {
        let before = self.parameters.clone();
        let result = request.parameters.iter().try_for_each(|parameter| self.set(parameter));
        match &result {
            Ok(()) => self.parameters_changed(request.parameters.clone(), now),
            Err(_) => self.parameters = before,
        }
        SetParametersAtomicallyResponse { result: result_message(&result) }
    }

    fn set(&mut self, parameter: &Parameter) -> Result<(), ParameterError> {
        let value = descriptors::value(&parameter.name, &parameter.value)?;
        self.parameters.change(&parameter.name, value, self.core.is_some())
    }

    fn parameters_changed(&mut self, changed: Vec<Parameter>, now: Nanoseconds) {
        if changed.is_empty() {
            return;
        }
        match &mut self.core {
            Some(Core::Host(node)) => node.set_parameters(&self.parameters),
            Some(Core::Bridge(bridge)) => bridge.set_parameters(&self.parameters),
            None => {}
        }
        self.effects.push(Effect::Parameters(ParameterEvent {
            stamp: Time::of_nanoseconds(now),
            node: self.name.clone(),
            changed_parameters: changed,
            ..ParameterEvent::default()
        }));
    }

    /// Answers `get_parameters`.
    #[must_use]
    pub fn get_parameters(&self, request: &ParameterNames) -> GetParametersResponse {
        let value = |name: &String| descriptors::message(self.parameters.get(name));
        GetParametersResponse { values: request.names.iter().map(value).collect() }
    }

    /// Answers `get_parameter_types`.
    #[must_use]
    pub fn get_parameter_types(&self, request: &ParameterNames) -> GetParameterTypesResponse {
        let types = self.get_parameters(request).values.iter().map(|value| value.r#type).collect();
        GetParameterTypesResponse { types }
    }

    /// Answers `describe_parameters`.
    #[must_use]
    pub fn describe_parameters(&self, request: &ParameterNames) -> DescribeParametersResponse {
        let rows = request.names.iter().filter_map(|name| self.parameters.row(name).ok());
        DescribeParametersResponse { descriptors: rows.map(descriptors::descriptor).collect() }
    }

    /// Answers `list_parameters`.
    #[must_use]
    pub fn list_parameters(&self, request: &ListParametersRequest) -> ListParametersResponse {
        ListParametersResponse { result: descriptors::list(&self.parameters, request) }
    }

    /// Passes a command to the robot behind the link.
    pub fn command(&mut self, command: Command) -> TriggerResponse {
        let Some(Core::Bridge(bridge)) = &mut self.core else {
            let message = "only the mode `bridge` has a robot to command, once it is configured";
            return TriggerResponse { success: false, message: message.to_owned() };
        };
        let success = bridge.command(command);
        let message =
            if success { "sent; /diagnostics has the answer" } else { "too many commands wait" };
        TriggerResponse { success, message: message.to_owned() }
    }

    /// Takes a pose from a service, in the frame of the map.
    pub fn set_pose(&mut self, pose: PoseWithCovarianceStamped, now: Nanoseconds) {
        self.take(Input::InitialPose(Box::new(pose)), now);
    }
}

/// Reads the files of the parameters.
fn configured(parameters: &Parameters) -> anyhow::Result<Core> {
    if parameters.text("mode") == "host" {
        return Node::read(parameters).map(|node| Core::Host(Box::new(node)));
    }
    ensure!(
        !parameters.text("port").is_empty(),
        "port: set it to the robot's serial port, or tcp:HOST:PORT"
    );
    let file = parameters.text("robot_file");
    ensure!(
        !file.is_empty(),
        "robot_file: set it to the robot file of the robot (docs/formats.md)"
    );
    let config = robot_file::read(Path::new(file)).context("robot_file")?;
    let map = parameters.text("map_file");
    let walls = (!map.is_empty()).then(|| Walls::read(Path::new(map)).context("map_file"));
    let walls = walls.transpose()?.map(|walls| walls.walls().to_vec()).unwrap_or_default();
    Ok(Core::Bridge(Box::new(Bridge::new(parameters, config, walls))))
}

fn result_message(result: &Result<(), ParameterError>) -> SetParametersResult {
    let reason = result.as_ref().err().map(ToString::to_string).unwrap_or_default();
    SetParametersResult { successful: result.is_ok(), reason }
}

fn state_message(state: State) -> StateMessage {
    StateMessage { id: state as u8, label: state.label().to_owned() }
}

fn transition_message(transition: Transition, from: State) -> TransitionMessage {
    TransitionMessage { id: transition.id(from), label: transition.label().to_owned() }
}

fn event(change: Change, now: Nanoseconds) -> TransitionEvent {
    TransitionEvent {
        timestamp: u64::try_from(now).unwrap_or(0),
        transition: transition_message(change.transition, change.from),
        start_state: state_message(change.from),
        goal_state: state_message(change.to),
    }
}

/// Answers `get_available_states`.
#[must_use]
pub fn available_states() -> GetAvailableStatesResponse {
    GetAvailableStatesResponse { available_states: State::ALL.map(state_message).into() }
}

/// The transitions from a state, or from every state.
#[must_use]
pub fn transitions(from: &[State]) -> GetAvailableTransitionsResponse {
    let describe = |from: State| {
        Transition::possible(from).map(move |(transition, goal)| TransitionDescription {
            transition: transition_message(transition, from),
            start_state: state_message(from),
            goal_state: state_message(goal),
        })
    };
    let available_transitions = from.iter().flat_map(|&from| describe(from)).collect();
    GetAvailableTransitionsResponse { available_transitions }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::Value;

    fn ask(label: &str) -> ChangeStateRequest {
        ChangeStateRequest { transition: TransitionMessage { id: 0, label: label.to_owned() } }
    }

    fn text(name: &str, value: &str) -> Parameter {
        let value = descriptors::message(Some(&Value::Text(value.to_owned())));
        Parameter { name: name.to_owned(), value }
    }

    #[test]
    fn a_file_that_is_missing_leaves_the_node_unconfigured() {
        let mut managed = Managed::new("/sonarfix".into(), Parameters::default());
        assert!(!managed.change_state(&ask("configure"), 5).success);
        assert_eq!(managed.get_state().current_state.label, "unconfigured");
        let effects = managed.effects();
        assert!(
            matches!(&effects[0], Effect::Note(note) if note.contains("robot_file")),
            "{effects:?}"
        );
        let Effect::Changed(_, event) = &effects[1] else { panic!("{effects:?}") };
        assert_eq!((event.timestamp, event.goal_state.id), (5, 1));
        assert!(!managed.change_state(&ask("activate"), 5).success);
        assert!(!managed.change_state(&ask("fly"), 5).success);
    }

    #[test]
    fn parameters_are_set_one_by_one_or_all_or_none() {
        let mut managed = Managed::new("/sonarfix".into(), Parameters::default());
        let parameters = vec![text("odom_topic", "wheels"), text("mode", "amcl")];
        let request = SetParametersRequest { parameters };
        let result = managed.set_atomically(&request, 0).result;
        assert!(!result.successful && result.reason.contains("mode"), "{result:?}");
        assert_eq!(managed.parameters(), &Parameters::default());
        let results = managed.set_parameters(&request, 0).results;
        assert_eq!(results.iter().map(|it| it.successful).collect::<Vec<_>>(), [true, false]);
        assert_eq!(managed.parameters().text("odom_topic"), "wheels");
        let effects = managed.effects();
        assert!(
            matches!(&effects[..], [Effect::Parameters(event)] if event.changed_parameters.len() == 1)
        );
        let names = ParameterNames { names: vec!["odom_topic".into(), "nonsense".into()] };
        assert_eq!(managed.get_parameter_types(&names).types, [4, 0]);
        assert_eq!(managed.describe_parameters(&names).descriptors.len(), 1);
    }

    #[test]
    fn transitions_are_listed() {
        assert_eq!(transitions(&[State::Inactive]).available_transitions.len(), 3);
        assert_eq!(transitions(&State::ALL).available_transitions.len(), 7);
        assert_eq!(available_states().available_states.len(), 4);
    }
}
