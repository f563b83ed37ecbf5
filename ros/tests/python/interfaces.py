"""Types of ROS for Cyclone DDS, made from the definitions of rosbags; those that it lacks are given here."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

from cyclonedds.idl import annotations as annotate
from cyclonedds.idl import make_idl_struct, types
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)

EMPTY = "uint8 structure_needs_at_least_one_member"
# Of packages that are not in the store; services have a type for the request and one for the response.
FURTHER = {
    "nav2_msgs/msg/Particle": "geometry_msgs/Pose pose\nfloat64 weight",
    "nav2_msgs/msg/ParticleCloud": "std_msgs/Header header\nnav2_msgs/Particle[] particles",
    "bond/msg/Status": "std_msgs/Header header\nstring id\nstring instance_id\nbool active\n"
    "float32 heartbeat_timeout\nfloat32 heartbeat_period",
    "std_srvs/msg/Empty_Request": EMPTY,
    "std_srvs/msg/Empty_Response": EMPTY,
    "std_srvs/msg/Trigger_Request": EMPTY,
    "std_srvs/msg/Trigger_Response": "bool success\nstring message",
    "nav2_msgs/msg/SetInitialPose_Request": "geometry_msgs/PoseWithCovarianceStamped pose",
    "nav2_msgs/msg/SetInitialPose_Response": EMPTY,
    "lifecycle_msgs/msg/ChangeState_Request": "lifecycle_msgs/Transition transition",
    "lifecycle_msgs/msg/ChangeState_Response": "bool success",
    "lifecycle_msgs/msg/GetState_Request": EMPTY,
    "lifecycle_msgs/msg/GetState_Response": "lifecycle_msgs/State current_state",
    "lifecycle_msgs/msg/GetAvailableTransitions_Request": EMPTY,
    "lifecycle_msgs/msg/GetAvailableTransitions_Response": "lifecycle_msgs/TransitionDescription[] available_transitions",
    "rcl_interfaces/msg/GetParameters_Request": "string[] names",
    "rcl_interfaces/msg/GetParameters_Response": "rcl_interfaces/ParameterValue[] values",
    "rcl_interfaces/msg/DescribeParameters_Request": "string[] names",
    "rcl_interfaces/msg/DescribeParameters_Response": "rcl_interfaces/ParameterDescriptor[] descriptors",
    "rcl_interfaces/msg/SetParameters_Request": "rcl_interfaces/Parameter[] parameters",
    "rcl_interfaces/msg/SetParameters_Response": "rcl_interfaces/SetParametersResult[] results",
    "rcl_interfaces/msg/ListParameters_Request": "string[] prefixes\nuint64 depth",
    "rcl_interfaces/msg/ListParameters_Response": "rcl_interfaces/ListParametersResult result",
}
for name, text in FURTHER.items():
    STORE.register(get_types_from_msg(text, name))

BASE = {
    "bool": bool,
    "string": str,
    "float32": types.float32,
    "float64": types.float64,
    "byte": types.uint8,
    **{f"{sign}int{bits}": getattr(types, f"{sign}int{bits}") for sign in ("", "u") for bits in (8, 16, 32, 64)},
}


def _python_type(kind: Any) -> Any:
    node, value = kind
    match node.name:
        case "BASE":
            return BASE[value[0]]
        case "NAME":
            return struct(value)
        case "ARRAY":
            return types.array[_python_type(value[0]), value[1]]
        case _:
            return types.sequence[_python_type(value[0])]


def _fields(name: str) -> dict[str, Any]:
    return {field: _python_type(kind) for field, kind in STORE.fielddefs[name][1]}


@cache
def struct(name: str) -> Any:
    """The type of this name, as ``nav_msgs/msg/Odometry``."""
    package, _, short = name.split("/")
    space = "srv" if short.endswith(("_Request", "_Response")) else "msg"
    made = make_idl_struct(short + "_", f"{package}.{space}.dds_.{short}_", _fields(name))
    return annotate.final(made)


@cache
def with_header(name: str) -> Any:
    """The type of a request or response of a service, behind what Cyclone puts before it: the client and its request."""
    package, _, short = name.split("/")
    fields = {"client": types.uint64, "sequence": types.int64, **_fields(name)}
    made = make_idl_struct(short + "_", f"{package}.srv.dds_.{short}_", fields)
    return annotate.final(made)


def _make(kind: Any, value: Any) -> Any:
    """A value of a field: from nested dictionaries and lists; missing fields are zero or empty."""
    node, of = kind
    match node.name:
        case "BASE":
            zero = {"string": "", "bool": False}.get(of[0], 0)
            return zero if value is None else value
        case "NAME":
            return make(of, value or {})
        case "ARRAY":
            return [_make(of[0], item) for item in flat(value)] if value else [_make(of[0], None)] * of[1]
        case _:
            return [_make(of[0], item) for item in value or []]


def flat(nested: Any) -> list[Any]:
    """The numbers of nested lists."""
    return [item for part in nested for item in (flat(part) if isinstance(part, list) else [part])]


def make(name: str, values: dict[str, Any] | None = None, kind: Any = None, **further: Any) -> Any:
    """A message of this type."""
    values = {**(values or {}), **further}
    fields = {field: _make(of, values.get(field)) for field, of in STORE.fielddefs[name][1]}
    if kind is None:
        return struct(name)(**fields)
    return kind(client=values["client"], sequence=values["sequence"], **fields)


def filled(name: str, seed: int = 1) -> Any:
    """A message whose every field differs from zero and from its neighbours."""
    count = iter(range(seed, 10**9))

    def fill(kind: Any) -> Any:
        node, of = kind
        match node.name:
            case "BASE":
                number = next(count)
                if of[0] == "string":
                    return f"text {number} ä"
                if of[0] == "bool":
                    return True
                if of[0].startswith("float"):
                    return number * 0.5
                return number % 100 + 1
            case "NAME":
                return struct(of)(**{field: fill(kind) for field, kind in STORE.fielddefs[of][1]})
            case "ARRAY":
                return [fill(of[0]) for _ in range(of[1])]
            case _:
                return [fill(of[0]) for _ in range(3)]

    return struct(name)(**{field: fill(kind) for field, kind in STORE.fielddefs[name][1]})


def plain(message: Any) -> Any:
    """A message as nested dictionaries and lists, for comparisons."""
    if dataclasses.is_dataclass(message):
        return {field.name: plain(getattr(message, field.name)) for field in dataclasses.fields(message)}
    if isinstance(message, list | tuple):
        return [plain(item) for item in message]
    return message
