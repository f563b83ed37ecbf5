"""What the tests share: the participant, a simulated drive and the node's processes."""

from __future__ import annotations

import json
import math
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from interfaces import make, plain
from ros_graph import PROGRAMS, Graph, Process, quality, wait_for

SECONDS = 60
CLOCK_EVERY = 20_000_000
POSE = "geometry_msgs/msg/PoseWithCovarianceStamped"


def stamp(nanoseconds: int) -> dict[str, int]:
    """A time of ROS."""
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def nanoseconds(time_: Any) -> int:
    """A time of ROS as a number."""
    return time_.sec * 10**9 + time_.nanosec


def heading(rotation: Any) -> float:
    """The heading of a planar rotation, radians."""
    return 2.0 * math.atan2(rotation.z, rotation.w)


def compose(outer: tuple[float, float, float], inner: tuple[float, float, float]) -> tuple[float, float, float]:
    """A pose in a frame that is itself placed in another."""
    x, y, turn = outer
    sine, cosine = math.sin(turn), math.cos(turn)
    return (
        x + cosine * inner[0] - sine * inner[1],
        y + sine * inner[0] + cosine * inner[1],
        math.remainder(turn + inner[2], 2.0 * math.pi),
    )


def placed(position: Any, rotation: Any) -> tuple[float, float, float]:
    """A planar pose of a message's parts."""
    return (position.x, position.y, heading(rotation))


class Drive:
    """A simulated drive as messages."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        lines = [json.loads(line) for line in (folder / "drive.jsonl").read_text().splitlines()]
        self.truth = {line["at"]: tuple(line["pose"]) for line in lines if line["topic"] == "truth"}
        lines = [line for line in lines if line["topic"] != "truth"]
        self.messages = [(line["at"], line["topic"], make(line["type"], line["message"])) for line in lines]
        self.start = make(POSE, json.loads((folder / "start.json").read_text()))

    def true_pose(self, at: int) -> tuple[float, float, float]:
        """The true pose at the tick that is nearest to a time."""
        return self.truth[min(self.truth, key=lambda tick: abs(tick - at))]


class Player:
    """Plays a drive as the messages of a robot, with a clock, at a speed."""

    def __init__(self, graph: Graph, drive: Drive, namespace: str = "") -> None:
        self.graph, self.drive = graph, drive
        self.odom = graph.writer(f"{namespace}/odom", "nav_msgs/msg/Odometry")
        self.range = graph.writer(f"{namespace}/range", "sensor_msgs/msg/Range")
        self.tf = graph.writer(f"{namespace}/tf", "tf2_msgs/msg/TFMessage")
        self.clock = graph.writer("/clock", "rosgraph_msgs/msg/Clock")
        self.odometry: dict[int, tuple[float, float, float]] = {}

    def play(
        self, begin: int, end: int, speed: float = 10.0, watch: Callable[[int], None] = lambda _: None, offset: int = 0
    ) -> None:
        """Plays the messages between two times of the drive; ``offset`` is added to the clock."""
        wall, last = time.monotonic(), None
        for at, topic, message in self.drive.messages:
            if not begin <= at < end:
                continue
            while (time.monotonic() - wall) * 1e9 * speed < at - begin:
                time.sleep(0.0005)
            if last is None or at - last >= CLOCK_EVERY:
                self.clock.write(make("rosgraph_msgs/msg/Clock", clock=stamp(at + offset)))
                last = at
            self.write(topic, message, at + offset)
            watch(at + offset)

    def write(self, topic: str, message: Any, at: int) -> None:
        """Writes a message with this stamp."""
        headers = [part.header for part in message.transforms] if topic == "tf" else [message.header]
        for header in headers:
            header.stamp.sec, header.stamp.nanosec = at // 10**9, at % 10**9
        if topic == "odom":
            pose = message.pose.pose
            self.odometry[at] = placed(pose.position, pose.orientation)
        {"odom": self.odom, "range": self.range, "tf": self.tf}[topic].write(message)


class Node:
    """The node as a process, as nav2 sees it."""

    def __init__(self, graph: Graph, log: Path, *arguments: str, name: str = "/sonarfix") -> None:
        self.graph, self.name = graph, name
        self.process = Process("sonarfix-ros", "--ros-args", *arguments, log=log)

    def change(self, label: str) -> bool:
        """Asks for a transition."""
        goal = {"configure": "inactive", "activate": "active", "deactivate": "inactive", "cleanup": "unconfigured"}.get(label)
        request = {"transition": {"id": 0, "label": label}}
        before = self.graph.repeated
        success = self.graph.call(f"{self.name}/change_state", "lifecycle_msgs/msg/ChangeState", **request).success
        # The response to the first of two requests was late, and the second one asks for what is done.
        return success or (self.graph.repeated > before and self.state() == goal)

    def state(self) -> str:
        """The state."""
        return self.graph.call(f"{self.name}/get_state", "lifecycle_msgs/msg/GetState").current_state.label

    def bring_up(self) -> None:
        """Configures and activates it, as nav2's lifecycle manager does."""
        assert self.change("configure")
        assert self.change("activate")
        assert self.state() == "active"

    def set_pose(self, pose: Any) -> None:
        """Sets the initial pose by the service."""
        self.graph.call("/set_initial_pose", "nav2_msgs/msg/SetInitialPose", pose=pose_values(pose))


def pose_at(x: float, y: float, turn: float) -> Any:
    """An initial pose."""
    covariance = [0.0] * 36
    covariance[0] = covariance[7] = 0.02**2
    covariance[35] = 0.03**2
    orientation = {"x": 0.0, "y": 0.0, "z": math.sin(turn / 2), "w": math.cos(turn / 2)}
    pose = {"pose": {"position": {"x": x, "y": y}, "orientation": orientation}, "covariance": covariance}
    return make(POSE, {"header": {"frame_id": "map"}, "pose": pose})


def pose_values(message: Any) -> dict[str, Any]:
    """A pose with its covariance as nested values, for a request."""
    return plain(message)


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the files of a drive."""
    path = tmp_path_factory.mktemp("drive")
    subprocess.run([str(PROGRAMS / "examples" / "drive"), str(path), str(SECONDS)], check=True)
    return path


@pytest.fixture(scope="session")
def drive(folder: Path) -> Drive:
    """A drive."""
    return Drive(folder)


@pytest.fixture
def graph() -> Iterator[Graph]:
    """A participant of its own for each test."""
    graph = Graph()
    yield graph
    # A failed test keeps its objects, and a writer that lives would send its requests to the node of the next test.
    graph.close()


@pytest.fixture
def start_node(graph: Graph, folder: Path, tmp_path: Path) -> Iterator[Callable[..., Node]]:
    """Starts nodes, which end with the test."""
    nodes: list[Node] = []
    files = [f"robot_file:={folder / 'robot.toml'}", f"map_file:={folder / 'map.toml'}"]

    def begin(*arguments: str, name: str = "/sonarfix", parameters: tuple[str, ...] = ()) -> Node:
        given = [part for text in (*files, *parameters) for part in ("-p", text)]
        nodes.append(Node(graph, tmp_path / "node.log", *given, *arguments, name=name))
        return nodes[-1]

    yield begin
    for node in nodes:
        node.process.kill()
    print((tmp_path / "node.log").read_text() if nodes else "")


@pytest.fixture
def localized(graph: Graph) -> Callable[..., Any]:
    """Checks what is published against the truth."""
    graph.reader("/tf", "tf2_msgs/msg/TFMessage")
    graph.reader("/amcl_pose", POSE, quality(latched=True))
    return lambda player, offset=0: Follower(graph, player, offset)


class Follower:
    """Follows the transform from the map to the odometry, as nav2 does."""

    def __init__(self, graph: Graph, player: Player, offset: int) -> None:
        self.graph, self.player, self.offset = graph, player, offset
        self.errors: list[float] = []
        # What was published before the pose was set is on its way.
        time.sleep(0.3)
        graph.take("/tf")

    def watch(self, _: int = 0) -> None:
        """Takes what was published: each correction with the odometry of its time gives the pose."""
        for message in self.graph.take("/tf"):
            for transform in message.transforms:
                if transform.child_frame_id == "odom":
                    self.take(transform)

    def take(self, transform: Any) -> None:
        """Takes a correction, whose stamp is ahead by the tolerance."""
        at = nanoseconds(transform.header.stamp) - 10**9
        odometry = self.player.odometry.get(at)
        if odometry is None:
            return
        correction = placed(transform.transform.translation, transform.transform.rotation)
        x, y, _ = compose(correction, odometry)
        true_x, true_y, _ = self.player.drive.true_pose(at - self.offset)
        self.errors.append(math.hypot(x - true_x, y - true_y))

    def check(self, at_least: int) -> None:
        """The corrections so far are many, and lead to the true pose."""
        wait_for(f"{at_least} corrections", lambda: self.watch() or (len(self.errors) >= at_least) or None)
        assert max(self.errors) < 0.15, max(self.errors)
        self.errors.clear()
