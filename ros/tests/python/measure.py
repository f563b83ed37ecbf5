"""Measures the node over DDS, and writes the figures as TOML: ``measure.py FILE SECONDS``."""

from __future__ import annotations

import math
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from conftest import POSE, Drive, Node, Player, pose_at, pose_values, stamp
from interfaces import make
from ros_graph import PROGRAMS, Graph, quality, wait_for

SECOND = 10**9
# Rates of the odometry and of the ranges, Hz.
RATES = (50, 20)


def odometry(at: int, x: float) -> Any:
    """A robot that stands at a place of its odometry frame."""
    pose = {"pose": {"position": {"x": x}, "orientation": {"w": 1.0}}}
    header = {"stamp": stamp(at), "frame_id": "odom"}
    return make("nav_msgs/msg/Odometry", header=header, child_frame_id="base_footprint", pose=pose)


def heard(at: int, distance: float) -> Any:
    """A range of a sonar that looks ahead."""
    header = {"stamp": stamp(at), "frame_id": "sonar"}
    return make("sensor_msgs/msg/Range", header=header, min_range=0.1, max_range=3.5, range=distance)


def begin_node(graph: Graph, folder: Path, *parameters: str) -> Node:
    """A node that starts by itself."""
    files = (f"robot_file:={folder / 'robot.toml'}", f"map_file:={folder / 'map.toml'}", "autostart_node:=true")
    return Node(graph, folder / "node.log", *(part for text in (*files, *parameters) for part in ("-p", text)))


def latency(folder: Path, seconds: float) -> dict[str, float]:
    """From a range to the pose of its time, while a robot drives to and fro; the first pose after the start; the processor."""
    graph = Graph()
    odom, ranges = graph.writer("/odom", "nav_msgs/msg/Odometry"), graph.writer("/range", "sensor_msgs/msg/Range")
    graph.reader("/amcl_pose", POSE, quality(latched=True))
    start = (
        "set_initial_pose:=true",
        "initial_pose.x:=3.0",
        "initial_pose.y:=4.0",
        "range_bearings:=[0.0]",
        "pose_period:=60.0",
    )
    begin = time.monotonic()
    node = begin_node(graph, folder, *start)
    first, waiting, delays = None, {}, []
    processor = None
    ticks = {"odom": 0, "range": 0}
    origin = time.monotonic_ns()
    try:
        while (now := time.monotonic_ns() - origin) < seconds * SECOND:
            place = 0.2 * math.sin(now / SECOND)
            if now >= ticks["odom"] * SECOND / RATES[0]:
                ticks["odom"] += 1
                odom.write(odometry(time.time_ns(), place))
            # Half of a period beside the odometry, which it does not wait for.
            if now >= (ticks["range"] + 0.2) * SECOND / RATES[1] and first:
                ticks["range"] += 1
                at = time.time_ns()
                waiting[at] = time.perf_counter_ns()
                ranges.write(heard(at, 3.0 - place - 0.06))
            for pose in graph.take("/amcl_pose"):
                if first is None:
                    first = time.monotonic() - begin
                    graph.matched("/range")
                sent = waiting.pop(pose.header.stamp.sec * SECOND + pose.header.stamp.nanosec, None)
                if sent:
                    delays.append((time.perf_counter_ns() - sent) / 1e6)
            if processor is None and now > seconds * SECOND / 4:
                processor = (node.process.resources()[0], time.monotonic())
            time.sleep(0.0001)
        used, memory = node.process.resources()
        share = (used - processor[0]) / (time.monotonic() - processor[1])
    finally:
        node.process.kill()
    delays.sort()
    return {
        "ranges": ticks["range"],
        "poses": len(delays),
        "median_ms": statistics.median(delays),
        "percentile_99_ms": delays[int(0.99 * len(delays))],
        "share_of_a_core": share,
        "first_pose_s": first,
        "memory_kb": memory,
    }


def long_run(folder: Path, seconds: float) -> dict[str, float]:
    """A drive again and again at ten times the speed, with the clock set back at each begin, and a new client every time."""
    drive = Drive(folder)
    graph = Graph()
    node = begin_node(graph, folder, "use_sim_time:=true")
    end, rounds, memory, states = time.monotonic() + seconds, 0, [], set()
    simulated = 0.0
    try:
        while time.monotonic() < end:
            peer = Graph()
            peer.reader("/amcl_pose", POSE, quality(latched=True))
            player = Player(peer, drive)
            for topic in ("/odom", "/range", "/clock"):
                peer.matched(topic)
            player.play(0, SECOND)
            pose = pose_values(pose_at(*drive.true_pose(SECOND)))
            peer.call("/set_initial_pose", "nav2_msgs/msg/SetInitialPose", pose=pose)
            player.play(SECOND, 60 * SECOND)
            wait_for("pose", lambda peer=peer: peer.take("/amcl_pose") or None)
            states.add(node.state())
            peer.close()
            rounds, simulated = rounds + 1, simulated + 60.0
            memory.append(node.process.resources()[1])
    finally:
        node.process.kill()
    settled = memory[1:] or memory
    return {
        "seconds": seconds,
        "simulated_s": simulated,
        "peers": rounds,
        "lost_states": len(states - {"active"}),
        "memory_first_kb": settled[0],
        "memory_last_kb": settled[-1],
    }


def table(name: str, values: dict[str, float]) -> str:
    """A table of TOML."""
    return f"[{name}]\n" + "".join(f"{key} = {value!r}\n" for key, value in values.items()) + "\n"


def main() -> None:
    """Measures everything."""
    out, seconds = Path(sys.argv[1]), float(sys.argv[2])
    folder = Path(tempfile.mkdtemp())
    subprocess.run([str(PROGRAMS / "examples" / "drive"), str(folder), "60"], check=True)
    figures = [str(PROGRAMS / "examples" / "figures"), "1000000"]
    text = "# Measured by `cargo xtask ros --measure`; nobody edits it.\n\n"
    text += subprocess.run(figures, check=True, capture_output=True, text=True).stdout
    text += table("program", {"bytes": (PROGRAMS / "sonarfix-ros").stat().st_size})
    text += table("latency", latency(folder, 60.0))
    text += table("long_run", long_run(folder, seconds))
    out.write_text(text)
    print(text)


main()
