"""Bags against rosbags, a program that shares no code with this one: ours read by it, its own read by ours.

Arguments: the command sonarfix, the programs `print` and `every_type` of sim-host/bags, and a folder for files.
"""

from __future__ import annotations

import dataclasses
import json
import math
import random
import resource
import shutil
import sqlite3
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

SONARFIX, PRINT, EVERY_TYPE, FOLDER = (Path(argument) for argument in sys.argv[1:5])
SCENARIO = Path(__file__).parents[2] / "crates/sonarfix-map/scenarios/classroom.toml"
STORE = get_typestore(Stores.ROS2_JAZZY)
# Damaged bags: how many, how long one may take, and the memory of the process.
DAMAGED = 100
SECONDS = 10
BYTES = 1 << 30

random.seed(1)


def run(*command: object, **options: Any) -> subprocess.CompletedProcess[str]:
    """Runs a program, which must succeed."""
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, **options)
    if done.returncode != 0:
        sys.exit(f"{command}: {done.stderr}")
    return done


def base(kind: str) -> Any:
    """A random number or text of a plain type."""
    if kind in ("string", "wstring"):
        return "".join(random.choice("abc äö/_") for _ in range(random.randrange(12)))
    if kind == "bool":
        return random.random() < 0.5
    if kind == "float64":
        return random.choice([0.0, -1.5, math.inf, random.gauss(0, 1e3), 1e300])
    if kind == "float32":
        return float(numpy.float32(random.choice([0.0, -1.5, -math.inf, random.gauss(0, 1e3)])))
    # A byte of ROS has no sign, one of rosbags has: below 128 both agree.
    bits = {"byte": 7, "char": 7}.get(kind) or int("".join(filter(str.isdigit, kind)))
    # Beyond 53 bits ours rounds, as documented.
    if kind.startswith("int"):
        return random.randrange(-(2 ** min(bits - 1, 53)), 2 ** min(bits - 1, 53))
    return random.randrange(2 ** min(bits, 53))


def value(field: Any) -> Any:
    """A random value of a field's type, as rosbags describes it."""
    node, what = field
    if node == 1:
        return base(what[0])
    if node == 2:
        return message(what)
    (element, length) = what
    if node == 4:
        length = random.randrange(4)
    values = [value(element) for _ in range(length)]
    if element[0] == 1 and element[1][0] not in ("string", "wstring"):
        kind = {"bool": "bool", "byte": "uint8", "char": "uint8"}.get(element[1][0], element[1][0])
        return numpy.array(values, dtype=kind)
    return values


def message(kind: str) -> Any:
    """A random message."""
    fields = {name: value(field) for name, field in STORE.fielddefs[kind][1]}
    return STORE.types[kind](**fields)


def names(message: Any) -> list[str]:
    """The names of the fields of a message, without constants."""
    every = [field.name for field in dataclasses.fields(message)]
    return [name for name in every if name != "__msgtype__" and not name.isupper()]


def plain(value: Any) -> Any:
    """A value of rosbags as the program `print` writes it."""
    if isinstance(value, (bool, int, numpy.integer, numpy.bool_)):
        return float(value)
    if isinstance(value, (float, numpy.floating)):
        value = float(value)
        return value if math.isfinite(value) else {math.inf: "inf", -math.inf: "-inf"}.get(value, "NaN")
    if isinstance(value, str):
        return value
    if isinstance(value, (list, numpy.ndarray)):
        return [plain(element) for element in value]
    fields = {name: plain(getattr(value, name)) for name in names(value)}
    # A message without fields has a byte that no definition names.
    fields.pop("structure_needs_at_least_one_member", None)
    return fields


def printed(bag: Path) -> list[Any]:
    """The messages of a bag as ours reads them."""
    return [json.loads(line, parse_int=float) for line in run(PRINT, bag).stdout.splitlines()]


def read(bag: Path) -> list[Any]:
    """The messages of a bag as rosbags reads them, by the definitions in the bag."""
    with AnyReader([bag]) as reader:
        return [
            (connection.topic, connection.msgtype, time, reader.deserialize(raw, connection.msgtype))
            for connection, time, raw in reader.messages()
        ]


STORAGES: dict[str, tuple[int, StoragePlugin, CompressionMode]] = {
    "mcap-8": (8, StoragePlugin.MCAP, CompressionMode.NONE),
    "mcap-9": (9, StoragePlugin.MCAP, CompressionMode.NONE),
    "mcap-chunks-zstd": (9, StoragePlugin.MCAP, CompressionMode.STORAGE),
    "mcap-messages-zstd": (9, StoragePlugin.MCAP, CompressionMode.MESSAGE),
    "mcap-file-zstd": (9, StoragePlugin.MCAP, CompressionMode.FILE),
    "sqlite-8": (8, StoragePlugin.SQLITE3, CompressionMode.NONE),
    "sqlite-9": (9, StoragePlugin.SQLITE3, CompressionMode.NONE),
    "sqlite-messages-zstd": (9, StoragePlugin.SQLITE3, CompressionMode.MESSAGE),
    "sqlite-file-zstd": (9, StoragePlugin.SQLITE3, CompressionMode.FILE),
}


def write(bag: Path, storage: str, messages: list[Any]) -> None:
    """Writes messages by rosbags."""
    version, plugin, mode = STORAGES[storage]
    if bag.exists():
        shutil.rmtree(bag)
    writer = Writer(bag, version=version, storage_plugin=plugin)
    if mode != CompressionMode.NONE:
        writer.set_compression(mode, CompressionFormat.ZSTD)
    with writer:
        known: dict[str, Any] = {}
        for topic, kind, time, message in messages:
            if topic not in known:
                known[topic] = writer.add_connection(topic, kind, typestore=STORE)
            writer.write(known[topic], time, STORE.serialize_cdr(message, kind))


def every_type() -> None:
    """Every type that rosbags knows, in every storage, read by ours; every type that ours knows, read by rosbags."""
    messages = [
        (f"/{kind}", kind, 10 * number + turn, message(kind))
        for number, kind in enumerate(sorted(STORE.fielddefs))
        for turn in range(2)
    ]
    expected = [
        {"topic": topic, "type": kind, "time": float(time), "fields": plain(message)} for topic, kind, time, message in messages
    ]
    for storage in STORAGES:
        bag = FOLDER / f"types-{storage}"
        write(bag, storage, messages)
        found = sorted(printed(bag), key=lambda message: message["time"])
        for one, other in zip(expected, found, strict=True):
            assert one == other, f"{storage}:\n{one}\n{other}"
    ours = FOLDER / "every_type"
    run(EVERY_TYPE, ours)
    for topic, kind, _, message_read in read(ours):
        assert topic == f"/{kind}", topic
        if kind in STORE.fielddefs:
            # The definition is that of ROS. nav2 and bond are not known to rosbags.
            assert names(STORE.types[kind]) == names(message_read), kind
    print(f"every type: {len(STORE.fielddefs)} types in {len(STORAGES)} storages, {len(read(ours))} of ours read by rosbags")


def without_definitions() -> None:
    """A database without definitions, as ROS's Humble writes it: of the types that ours knows."""
    kinds = [
        f"{package}/msg/{name}"
        for package, name in [
            ("nav_msgs", "Odometry"),
            ("sensor_msgs", "JointState"),
            ("sensor_msgs", "LaserScan"),
            ("tf2_msgs", "TFMessage"),
            ("geometry_msgs", "PoseWithCovarianceStamped"),
            ("geometry_msgs", "PoseStamped"),
        ]
    ]
    messages = [(f"/{kind}", kind, number, message(kind)) for number, kind in enumerate(kinds)]
    bag = FOLDER / "humble"
    write(bag, "sqlite-8", messages)
    with sqlite3.connect(bag / "humble.db3") as database:
        database.execute("DROP TABLE message_definitions")
    database.close()
    fields = [plain(message) for *_, message in messages]
    assert [message["fields"] for message in printed(bag)] == fields
    print(f"without definitions: {len(kinds)} types")


def databases() -> None:
    """Trees of every shape: pages of every size, rows over many pages, deleted rows, vacuumed files."""
    kind, rows = "std_msgs/msg/String", 0
    for size in [512, 1024, 4096, 65536]:
        messages = [
            ("/text", kind, time, STORE.types[kind]("x" * (random.randrange(300) if time % 50 else random.randrange(200_000))))
            for time in range(1, 700)
        ]
        bag = FOLDER / f"pages-{size}"
        write(bag, "sqlite-9", messages)
        database = sqlite3.connect(bag / f"pages-{size}.db3", isolation_level=None)
        database.execute(f"PRAGMA page_size = {size}")
        database.execute("PRAGMA auto_vacuum = full")
        database.execute("VACUUM")
        assert database.execute("PRAGMA page_size").fetchone() == (size,)
        database.execute("DELETE FROM messages WHERE id % 7 = 3")
        database.execute("UPDATE messages SET timestamp = -timestamp WHERE id % 11 = 5")
        expected = [(time, len(data)) for time, data in database.execute("SELECT timestamp, data FROM messages ORDER BY id")]
        database.close()
        # The text of a message is its bytes without header, length and zero.
        found = [(message["time"], len(message["fields"]["data"]) + 9) for message in printed(bag)]
        assert found == expected, size
        rows += len(found)
    print(f"databases: {rows} rows")


def logs() -> None:
    """A recorded run as a bag, read by rosbags, written by it in every storage, and replayed from there."""
    log, bag = FOLDER / "run/log.csv", FOLDER / "bag"
    log.parent.mkdir()
    run(SONARFIX, "run", SCENARIO, "--runs", "1", "--record", log)
    run(SONARFIX, "export", log, "--rosbag", bag)
    messages = read(bag)
    check_ours(log, messages)
    converted = convert(bag, "from-ours", "--reference", "/pose/true")
    lines = converted.joinpath("log.csv").read_text()
    # The begin of it in every storage is the begin of the log.
    begin = messages[:3000]
    for storage in STORAGES:
        other = FOLDER / f"run-{storage}"
        write(other, storage, begin)
        again = convert(other, f"from-{storage}", "--reference", "/pose/true").joinpath("log.csv").read_text()
        assert len(again) > 10_000, storage
        assert lines.startswith(again), storage
    for file in ["map.toml", "robot.toml"]:
        shutil.copy(log.parent / file, converted / file)
    [own, other] = [json.loads(run(SONARFIX, "replay", path, "--json").stdout) for path in [log, converted / "log.csv"]]
    [own, other] = [summary["position_rms"] for summary in [own, other]]
    assert abs(own - other) < 0.02 * own + 2e-4, (own, other)
    print(f"replay: {1e3 * own:.2f} mm of the log, {1e3 * other:.2f} mm of the bag (RMS)")
    run(SONARFIX, "calibrate", converted / "log.csv")
    joints(messages, lines)
    scans(log.parent)


def convert(bag: Path, name: str, *options: object) -> Path:
    """Converts a bag of the classroom's robot."""
    out = FOLDER / name
    run(SONARFIX, "convert", "rosbag", bag, "--out", out, "--track-width", 0.12, *options)
    return out


def check_ours(log: Path, messages: list[Any]) -> None:
    """The messages of a bag of ours are the records of the log."""
    records = [line.split(",") for line in log.read_text().splitlines()]
    ranges = {round(1e9 * float(record[1])): record[3] for record in records if record[0] == "range"}
    found = {}
    for topic, _, time, message in messages:
        if topic.endswith("/range"):
            stamp = message.header.stamp
            assert 10**9 * stamp.sec + stamp.nanosec == time
            found[time] = message.range
    assert found.keys() == ranges.keys()
    for time, text in ranges.items():
        expected = numpy.float32(text) if text else math.inf
        assert numpy.float32(found[time]) == expected, (time, text, found[time])
    wheels = [record for record in records if record[0] == "wheels"]
    odometry = [message for topic, _, _, message in messages if topic == "/odom"]
    assert len(wheels) == len(odometry)
    # The distance between two poses is that of the wheels, up to the bend.
    driven = sum(
        math.dist((a.pose.pose.position.x, a.pose.pose.position.y), (b.pose.pose.position.x, b.pose.pose.position.y))
        for a, b in zip(odometry, odometry[1:], strict=False)
    )
    rolled = sum(abs(sum(float(b[side]) - float(a[side]) for side in (2, 3))) / 2 for a, b in zip(wheels, wheels[1:], strict=False))
    assert abs(driven - rolled) < 1e-3 * rolled, (driven, rolled)


def joints(messages: list[Any], lines: str) -> None:
    """The same run with positions of joints in place of the odometry gives the same travel."""
    radius, kind = 0.03, "sensor_msgs/msg/JointState"
    wheels = [line.split(",") for line in lines.splitlines() if line.startswith("wheels")]
    joint_names = ["front_wheel_steering", "left_wheel_joint", "right_wheel_joint"]
    empty = numpy.array([], dtype="float64")
    states = []
    for _, time, right, left in wheels:
        nanoseconds = round(1e9 * float(time))
        stamp = STORE.types["builtin_interfaces/msg/Time"](nanoseconds // 10**9, nanoseconds % 10**9)
        header = STORE.types["std_msgs/msg/Header"](stamp, "")
        positions = numpy.array([0.1, float(left) / radius, float(right) / radius])
        states.append(("/joint_states", kind, nanoseconds, STORE.types[kind](header, joint_names, positions, empty, empty)))
    others = [message for message in messages if message[0] != "/odom"]
    bag = FOLDER / "joints"
    write(bag, "sqlite-9", sorted(states + others, key=lambda message: message[2]))
    out = convert(bag, "from-joints", "--wheel-radius", radius)
    found = [line.split(",") for line in out.joinpath("log.csv").read_text().splitlines() if line.startswith("wheels")]
    assert len(found) == len(wheels)
    for one, other in zip(wheels, found, strict=True):
        assert all(abs(float(a) - float(b)) < 3e-6 for a, b in zip(one[1:], other[1:], strict=True)), (one, other)
    print(f"joints: {len(found)} records of {radius} m")


def scans(folder: Path) -> None:
    """A log with scans, as a bag and back: whole, and as beams."""
    log = folder / "scans.csv"
    beams = "1.5 - 2.25 0.75"
    lines = ["sonarfix-log,1", "start,0,2,2,0,0.01,0.02"]
    for step in range(20):
        lines += [f"wheels,{step / 10},{step / 100},{step / 100}", f"scan,{step / 10 + 0.05:.6f},-1.5,1,{beams}"]
    log.write_text("\n".join(lines) + "\n")
    bag = FOLDER / "scans"
    run(SONARFIX, "export", log, "--rosbag", bag)
    out = convert(bag, "from-scans").joinpath("log.csv").read_text()
    assert out.count("scan,") == 20, out
    assert "1.500 - 2.250 0.750" in out, out
    out = convert(bag, "from-beams", "--beams", "-90,30").joinpath("log.csv").read_text()
    found = [line.split(",")[2:] for line in out.splitlines() if line.startswith("range")]
    # The nearest beams to -90° and 30° are those at -1.5 and 0.5 rad.
    assert found[:2] == [["-1.500000", "1.5"], ["0.500000", "2.25"]], found[:2]
    print("scans: 20, whole and as beams")


def damaged() -> None:
    """Torn and changed bags: an error in a bounded time and memory, never a panic."""

    def limit() -> None:
        resource.setrlimit(resource.RLIMIT_AS, (BYTES, BYTES))

    refused = 0
    for name in ["types-mcap-9", "types-mcap-chunks-zstd", "types-mcap-file-zstd", "types-sqlite-9", "pages-512"]:
        source = next(path for path in (FOLDER / name).iterdir() if path.name != "metadata.yaml")
        whole = source.read_bytes()
        file = FOLDER / f"damaged{source.suffix}"
        for turn in range(DAMAGED // 5):
            content = bytearray(whole)
            if turn % 3 == 0:
                del content[random.randrange(len(content)) :]
            else:
                for _ in range(1 + turn):
                    content[random.randrange(len(content))] = random.randrange(256)
            if turn % 5 == 4:
                at = random.randrange(len(content) - 8)
                content[at : at + 8] = b"\xff" * 8
            file.write_bytes(content)
            done = subprocess.run([str(PRINT), str(file)], capture_output=True, timeout=SECONDS, preexec_fn=limit)
            assert done.returncode in (0, 1), (name, turn, done.returncode, done.stderr[-500:])
            assert b"panicked" not in done.stderr, (name, turn, done.stderr)
            refused += done.returncode
    assert refused > DAMAGED // 4
    print(f"damaged: {DAMAGED}, {refused} refused")


def main() -> None:
    """All of it."""
    if FOLDER.exists():
        shutil.rmtree(FOLDER)
    FOLDER.mkdir(parents=True)
    every_type()
    without_definitions()
    databases()
    logs()
    damaged()


main()
