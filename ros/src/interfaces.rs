//! Requests and responses of the services, and messages that only this node's services and events use, with the fields of ROS's
//! definitions in their order.

#![expect(missing_docs, reason = "the fields are those of ROS's definitions")]

use serde::{Deserialize, Serialize};
use sonarfix_ros_messages::messages::{PoseWithCovarianceStamped, Time};

macro_rules! interfaces {
    ($($name:ident { $($field:ident: $type:ty),* $(,)? })*) => { $(
        #[doc = concat!("`", stringify!($name), "`.")]
        #[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
        pub struct $name { $(pub $field: $type),* }

        impl ros2_client::Message for $name {}
    )* };
}

interfaces! {
    // An empty message has one byte in IDL.
    Empty { filler: u8 }
    TriggerResponse { success: bool, message: String }
    SetInitialPoseRequest { pose: PoseWithCovarianceStamped }
    StateMessage { id: u8, label: String }
    TransitionMessage { id: u8, label: String }
    TransitionDescription {
        transition: TransitionMessage,
        start_state: StateMessage,
        goal_state: StateMessage,
    }
    TransitionEvent {
        timestamp: u64,
        transition: TransitionMessage,
        start_state: StateMessage,
        goal_state: StateMessage,
    }
    ChangeStateRequest { transition: TransitionMessage }
    ChangeStateResponse { success: bool }
    GetStateResponse { current_state: StateMessage }
    GetAvailableStatesResponse { available_states: Vec<StateMessage> }
    GetAvailableTransitionsResponse { available_transitions: Vec<TransitionDescription> }
    ParameterValue {
        r#type: u8,
        bool_value: bool,
        integer_value: i64,
        double_value: f64,
        string_value: String,
        byte_array_value: Vec<u8>,
        bool_array_value: Vec<bool>,
        integer_array_value: Vec<i64>,
        double_array_value: Vec<f64>,
        string_array_value: Vec<String>,
    }
    Parameter { name: String, value: ParameterValue }
    ParameterEvent {
        stamp: Time,
        node: String,
        new_parameters: Vec<Parameter>,
        changed_parameters: Vec<Parameter>,
        deleted_parameters: Vec<Parameter>,
    }
    FloatingPointRange { from_value: f64, to_value: f64, step: f64 }
    IntegerRange { from_value: i64, to_value: i64, step: u64 }
    ParameterDescriptor {
        name: String,
        r#type: u8,
        description: String,
        additional_constraints: String,
        read_only: bool,
        dynamic_typing: bool,
        floating_point_range: Vec<FloatingPointRange>,
        integer_range: Vec<IntegerRange>,
    }
    SetParametersResult { successful: bool, reason: String }
    ParameterNames { names: Vec<String> }
    GetParametersResponse { values: Vec<ParameterValue> }
    GetParameterTypesResponse { types: Vec<u8> }
    DescribeParametersResponse { descriptors: Vec<ParameterDescriptor> }
    SetParametersRequest { parameters: Vec<Parameter> }
    SetParametersResponse { results: Vec<SetParametersResult> }
    SetParametersAtomicallyResponse { result: SetParametersResult }
    ListParametersRequest { prefixes: Vec<String>, depth: u64 }
    ListParametersResult { names: Vec<String>, prefixes: Vec<String> }
    ListParametersResponse { result: ListParametersResult }
}
