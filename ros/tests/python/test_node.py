"""The node against Eclipse Cyclone DDS, by a client that behaves like nav2."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conftest import POSE, Drive, Node, Player, nanoseconds, pose_at, stamp
from interfaces import filled, make, plain
from ros_graph import Graph, Process, quality, wait_for

SECOND = 10**9
SIMULATED = ("use_sim_time:=true",)

MESSAGES = [
    "rosgraph_msgs/msg/Clock",
    POSE,
    "tf2_msgs/msg/TFMessage",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/OccupancyGrid",
    "sensor_msgs/msg/JointState",
    "sensor_msgs/msg/Range",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/LaserScan",
    "diagnostic_msgs/msg/DiagnosticArray",
    "visualization_msgs/msg/MarkerArray",
    "nav2_msgs/msg/ParticleCloud",
    "bond/msg/Status",
    "geometry_msgs/msg/Twist",
]


@pytest.fixture(scope="module")
def echo(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A program that sends every message back."""
    process = Process("examples/echo", log=tmp_path_factory.mktemp("echo") / "log")
    yield process
    process.kill()


@pytest.mark.parametrize("name", MESSAGES)
def test_every_type_arrives_both_ways(graph: Graph, echo: Process, name: str) -> None:
    package, _, short = name.split("/")
    topics = [f"/echo/{package}/{short}/{end}" for end in ("in", "out")]
    graph.writer(topics[0], name, quality(latched=True))
    graph.reader(topics[1], name, quality(latched=True))
    graph.matched(topics[0])
    for seed in (1, 1000):
        sent = filled(name, seed)
        graph.writers[topics[0]].write(sent)
        assert plain(graph.next(topics[1])) == plain(sent)
    # All fields zero or empty.
    graph.writers[topics[0]].write(make(name))
    assert plain(graph.next(topics[1])) == plain(make(name))


def test_a_client_like_nav2_brings_the_node_up_and_follows_it(
    graph: Graph, drive: Drive, start_node: Callable[..., Node], localized: Callable[..., Any]
) -> None:
    node = start_node(parameters=SIMULATED)
    graph.reader("/sonarfix/transition_event", "lifecycle_msgs/msg/TransitionEvent")
    graph.reader("/bond", "bond/msg/Status")
    graph.reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    player, initial = Player(graph, drive), graph.writer("/initialpose", POSE)
    assert node.state() == "unconfigured"
    assert not node.change("activate")
    node.bring_up()
    for topic in ("/odom", "/range", "/tf", "/initialpose", "/clock"):
        graph.matched(topic)
    player.play(0, SECOND)
    initial.write(pose_at(*drive.true_pose(SECOND)))
    follower = localized(player)
    player.play(SECOND, 20 * SECOND, watch=follower.watch)
    follower.check(100)
    pose = graph.next("/amcl_pose")
    assert pose.header.frame_id == "map"
    variances = [pose.pose.covariance[place] for place in (0, 7, 35)]
    assert all(0.0 < variance < 0.01 for variance in variances), variances
    assert graph.next("/bond", lambda status: status.id == "sonarfix" and status.active)
    states = [event.goal_state.label for event in graph.take("/sonarfix/transition_event")]
    assert states[-2:] == ["inactive", "active"]
    statuses = graph.next("/diagnostics", lambda array: len(array.status) >= 3).status
    assert statuses[0].name == "sonarfix: localization"

    # It is killed, started again, and localized by the service.
    node.process.kill()
    node = start_node(parameters=SIMULATED)
    node.bring_up()
    for topic in ("/odom", "/range", "/clock"):
        graph.matched(topic)
    player.play(20 * SECOND, 21 * SECOND)
    x, y, turn = drive.true_pose(21 * SECOND)
    node.set_pose(pose_at(x, y, turn))
    follower = localized(player)
    player.play(21 * SECOND, 35 * SECOND, watch=follower.watch)
    follower.check(100)

    # The clock is set back, as a simulation does that begins again.
    player.play(0, SECOND)
    initial.write(pose_at(*drive.true_pose(SECOND)))
    follower = localized(player)
    player.play(SECOND, 15 * SECOND, watch=follower.watch)
    follower.check(100)
    array = graph.next("/diagnostics", lambda array: any("clock_back" in v.key for s in array.status for v in s.values))
    assert array.status[1].name == "sonarfix: inputs"

    # It is deactivated, and silent; then active again.
    assert node.change("deactivate")
    time.sleep(0.2)
    graph.take("/amcl_pose")
    player.play(15 * SECOND, 16 * SECOND)
    assert graph.take("/amcl_pose") == []
    assert node.change("activate")
    follower = localized(player)
    player.play(16 * SECOND, 22 * SECOND, watch=follower.watch)
    follower.check(30)
    assert node.change("deactivate") and node.change("cleanup") and node.state() == "unconfigured"
    assert node.change("shutdown")
    wait_for("end", lambda: not node.process.is_running() or None)


def test_the_clock_jumps_ahead(
    graph: Graph, drive: Drive, start_node: Callable[..., Node], localized: Callable[..., Any]
) -> None:
    node = start_node(parameters=SIMULATED)
    player = Player(graph, drive)
    node.bring_up()
    for topic in ("/odom", "/range", "/clock"):
        graph.matched(topic)
    player.play(0, SECOND)
    node.set_pose(pose_at(*drive.true_pose(SECOND)))
    player.play(SECOND, 10 * SECOND)
    offset = 3600 * SECOND
    time.sleep(0.2)
    follower = localized(player, offset)
    player.play(10 * SECOND, 20 * SECOND, watch=follower.watch, offset=offset)
    follower.check(80)


def test_parameters_are_described_set_and_refused(graph: Graph, start_node: Callable[..., Node]) -> None:
    node = start_node()
    graph.reader("/parameter_events", "rcl_interfaces/msg/ParameterEvent")
    call = lambda kind, **request: graph.call(f"/sonarfix/{_snake(kind)}", f"rcl_interfaces/msg/{kind}", **request)  # noqa: E731
    names = call("ListParameters", depth=0).result.names
    assert {"transform_tolerance", "base_frame_id", "initial_pose.x", "set_initial_pose"} <= set(names)
    descriptors = call("DescribeParameters", names=names).descriptors
    assert [descriptor.name for descriptor in descriptors] == names
    assert all(descriptor.description for descriptor in descriptors)
    tolerance = next(it for it in descriptors if it.name == "transform_tolerance")
    assert (tolerance.floating_point_range[0].from_value, tolerance.floating_point_range[0].to_value) == (0.0, 60.0)
    assert call("GetParameters", names=["transform_tolerance"]).values[0].double_value == 1.0
    assert node.change("configure")

    def set_one(name: str, **value: Any) -> Any:
        return call("SetParameters", parameters=[{"name": name, "value": value}]).results[0]

    assert set_one("transform_tolerance", type=3, double_value=0.5).successful
    assert graph.next("/parameter_events").changed_parameters[0].name == "transform_tolerance"
    assert call("GetParameters", names=["transform_tolerance"]).values[0].double_value == 0.5
    for name, value in {
        "transform_tolerance": {"type": 3, "double_value": -1.0},
        "base_frame_id": {"type": 4, "string_value": "base_link"},
        "nonsense": {"type": 1, "bool_value": True},
    }.items():
        result = set_one(name, **value)
        assert not result.successful
        assert name in result.reason


def _snake(name: str) -> str:
    return "".join("_" + c.lower() if c.isupper() else c for c in name).lstrip("_")


def test_two_robots_in_one_graph(graph: Graph, drive: Drive, start_node: Callable[..., Node]) -> None:
    def begin(robot: str) -> Node:
        names = ("-r", f"__ns:=/{robot}", "-r", "/tf:=tf", "-r", f"~/calibration:=/{robot}/learned")
        automatic = (*SIMULATED, "autostart_node:=true", "set_initial_pose:=true", "initial_pose.x:=1.5", "initial_pose.y:=1.5")
        return start_node(*names, name=f"/{robot}/sonarfix", parameters=automatic)

    nodes = [begin(robot) for robot in ("one", "two")]
    for robot in ("one", "two"):
        graph.reader(f"/{robot}/amcl_pose", POSE, quality(latched=True))
        graph.reader(f"/{robot}/learned", "diagnostic_msgs/msg/DiagnosticArray")
    player = Player(graph, drive, "/one")
    for topic in ("/one/odom", "/one/range", "/one/tf"):
        graph.matched(topic)
    graph.matched("/clock", 2)
    assert [node.state() for node in nodes] == ["active", "active"]
    player.play(0, 5 * SECOND)
    assert graph.next("/one/amcl_pose")
    assert graph.next("/one/learned").status[0].name == "sonarfix: calibration"
    assert graph.take("/two/amcl_pose") == []


def test_a_map_comes_from_a_map_server(
    graph: Graph, drive: Drive, start_node: Callable[..., Node], localized: Callable[..., Any]
) -> None:
    grid = graph.writer("/map", "nav_msgs/msg/OccupancyGrid", quality(latched=True, depth=1))
    cell, width, height = 0.05, 140, 180
    rooms = [
        100 if (x in (9, 130) and 9 <= y <= 170) or (y in (9, 170) and 9 <= x <= 130) else 0
        for y in range(height)
        for x in range(width)
    ]
    place = {"position": {"x": -0.475, "y": -0.475}, "orientation": {"w": 1.0}}
    info = {"resolution": cell, "width": width, "height": height, "origin": place}
    grid.write(make("nav_msgs/msg/OccupancyGrid", {"header": {"frame_id": "map"}, "info": info, "data": rooms}))
    node = start_node(parameters=(*SIMULATED, 'map_file:=""'))
    graph.reader("/sonarfix/markers", "visualization_msgs/msg/MarkerArray")
    player = Player(graph, drive)
    node.bring_up()
    for topic in ("/odom", "/range", "/clock", "/map"):
        graph.matched(topic)
    player.play(0, SECOND)
    node.set_pose(pose_at(*drive.true_pose(SECOND)))
    follower = localized(player)
    player.play(SECOND, 15 * SECOND, watch=follower.watch)
    follower.check(100)
    walls = graph.next("/sonarfix/markers").markers[0]
    assert (walls.ns, len(walls.points)) == ("walls", 8)


def test_a_lost_robot_searches_on_demand(graph: Graph, drive: Drive, start_node: Callable[..., Node]) -> None:
    node = start_node(parameters=SIMULATED)
    graph.reader("/particle_cloud", "nav2_msgs/msg/ParticleCloud", quality(reliable=False))
    player = Player(graph, drive)
    node.bring_up()
    for topic in ("/odom", "/range", "/clock"):
        graph.matched(topic)
    player.play(0, SECOND)
    node.set_pose(pose_at(*drive.true_pose(SECOND)))
    player.play(SECOND, 3 * SECOND)
    graph.reader("/amcl_pose", POSE, quality(latched=True))
    graph.next("/amcl_pose")
    graph.call("/reinitialize_global_localization", "std_srvs/msg/Empty")
    time.sleep(0.1)
    graph.take("/amcl_pose")
    player.play(3 * SECOND, 8 * SECOND)
    assert graph.take("/amcl_pose") == []
    assert graph.next("/particle_cloud").header.frame_id == "map"
    node.set_pose(pose_at(*drive.true_pose(8 * SECOND)))
    graph.call("/request_nomotion_update", "std_srvs/msg/Empty")
    assert graph.next("/amcl_pose")


@pytest.mark.parametrize("end", ["deactivate", "shutdown"])
def test_a_robot_that_searches_moves_until_the_node_ends(
    graph: Graph, drive: Drive, start_node: Callable[..., Node], end: str
) -> None:
    files = (f"robot_file:={drive.folder / 'turning.toml'}", "search_motion_topic:=cmd_vel")
    node = start_node(parameters=(*SIMULATED, *files))
    graph.reader("/cmd_vel", "geometry_msgs/msg/Twist")
    player = Player(graph, drive)
    node.bring_up()
    for topic in ("/odom", "/range", "/tf", "/clock"):
        graph.matched(topic)
    turn, begin, step = 0.0, 0, SECOND // 5
    while turn == 0.0:
        assert begin < 20 * SECOND, "it stands"
        player.play(begin, begin + step, speed=2.0)
        begin += step
        time.sleep(0.05)
        turn = next((twist.angular.z for twist in reversed(graph.take("/cmd_vel"))), turn)
    assert node.change(end)
    assert graph.next("/cmd_vel") == make("geometry_msgs/msg/Twist")
    player.play(begin, begin + SECOND)
    assert graph.take("/cmd_vel") == []


def test_a_robot_behind_the_link(graph: Graph, drive: Drive, start_node: Callable[..., Node], tmp_path: Path) -> None:
    address = "127.0.0.1:45454"
    log = tmp_path / "robot.log"
    robot = Process("examples/robot", address, "30", log=log)
    try:
        wait_for("robot", lambda: "listens" in log.read_text() or None)
        node = start_node(parameters=("mode:=bridge", f"port:=tcp:{address}", "publish_odom_tf:=true"))
        kinds = {
            "/amcl_pose": (POSE, quality(latched=True)),
            "/odom": ("nav_msgs/msg/Odometry", quality()),
            "/sonarfix/range": ("sensor_msgs/msg/Range", quality(reliable=False)),
            "/tf": ("tf2_msgs/msg/TFMessage", quality()),
            "/diagnostics": ("diagnostic_msgs/msg/DiagnosticArray", quality()),
        }
        for topic, (name, qos) in kinds.items():
            graph.reader(topic, name, qos)
        initial = graph.writer("/initialpose", POSE)
        node.bring_up()
        pose = graph.next("/amcl_pose")
        assert abs(nanoseconds(pose.header.stamp) - time.time_ns()) < SECOND
        first = min(abs(pose.pose.pose.position.x - x) + abs(pose.pose.pose.position.y - y) for x, y, _ in drive.truth.values())
        assert first < 0.1
        assert graph.next("/sonarfix/range").max_range == pytest.approx(3.5)
        children = {part.child_frame_id for part in graph.next("/tf", lambda tf: len(tf.transforms) == 2).transforms}
        assert children == {"odom", "base_footprint"}
        assert graph.next("/tf", lambda tf: tf.transforms[0].child_frame_id == "sonar_0")
        assert graph.next("/odom").header.frame_id == "odom"
        assert graph.call("/sonarfix/start", "std_srvs/msg/Trigger").success
        graph.matched("/initialpose")
        initial.write(drive.start)
        wait_for("commands", lambda: ("Start" in log.read_text() and "SetPose" in log.read_text()) or None)
        last = graph.next("/diagnostics", lambda array: any(v.value == "executed" for s in array.status for v in s.values))
        assert last.status[-1].name == "sonarfix: link"
        robot.kill()
        graph.next("/diagnostics", lambda array: any(v.key == "link_silent" for s in array.status for v in s.values))
    finally:
        robot.kill()


def test_bytes_that_are_no_message_do_no_harm(graph: Graph, drive: Drive, start_node: Callable[..., Node]) -> None:
    """A publisher of another type under the name of the right one."""
    from cyclonedds.idl import annotations as annotate
    from cyclonedds.idl import make_idl_struct, types
    from cyclonedds.pub import DataWriter
    from cyclonedds.topic import Topic

    wrong = annotate.final(make_idl_struct("Odometry_", "nav_msgs.msg.dds_.Odometry_", {"data": types.sequence[types.uint8]}))
    node = start_node(parameters=("autostart_node:=true",))
    graph.reader("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    writer = DataWriter(graph.participant, Topic(graph.participant, "rt/odom", wrong), quality())
    assert node.state() == "active"
    for length in range(200):
        writer.write(wrong(data=[255] * length))
        time.sleep(0.002)
    keys = lambda array: {value.key for status in array.status for value in status.values}  # noqa: E731
    graph.next("/diagnostics", lambda array: "undecodable" in keys(array))
    assert node.state() == "active"
    assert stamp(1) == {"sec": 0, "nanosec": 1}
