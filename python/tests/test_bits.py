"""Python gets what the command computes, to the bit."""

import csv
import json
import math
import struct

import numpy as np
import pytest
from conftest import ROOT, SCENARIOS

import sonarfix as sf


def rows_of(file):
    with open(file, encoding="utf-8") as lines:
        plan = next(lines).rstrip("\n")
        return plan, list(csv.DictReader(lines))


def assert_same_rows(table, rows):
    assert len(table) == len(rows)
    for name in table.columns:
        column = table[name]
        if column.dtype == np.uint64:
            assert column.tolist() == [int(row[name]) for row in rows], name
        else:
            expected = np.array([float(row[name]) for row in rows])
            assert column.tobytes() == expected.tobytes(), name


@pytest.mark.parametrize("name", ["paper", "classroom"])
@pytest.mark.parametrize("workers", [1, 3])
def test_rows_are_those_of_the_command(command, tmp_path, name, workers):
    file = tmp_path / "rows.csv"
    code, _, error = command("run", SCENARIOS / f"{name}.toml", "--runs", 9, "--seed", 5, "--rows", file)
    assert code == 0, error
    plan, rows = rows_of(file)
    scenario = sf.Scenario(name)
    assert scenario.rows_plan(9, 5) == plan
    assert_same_rows(scenario.monte_carlo(9, 5, workers=workers), rows)


@pytest.mark.parametrize(
    ("options", "keywords"),
    [
        (["--policy", "informative", "--gyro", "mpu6050"], {"policy": "informative", "gyro": "mpu6050"}),
        (["--fidelity", "pins", "--servo", "sg90"], {"fidelity": "pins", "servo": "sg90"}),
        (["--absolute", "pose", "--fix-period", "2"], {"absolute": "pose", "fix_period": 2}),
        (["--light", "--range-error", "0.01"], {"light": True, "range_error": 0.01}),
    ],
)
def test_options_are_those_of_the_command(command, tmp_path, paper, options, keywords):
    file = tmp_path / "rows.csv"
    code, _, error = command("run", SCENARIOS / "paper.toml", "--runs", 2, "--rows", file, *options)
    assert code == 0, error
    plan, rows = rows_of(file)
    scenario = paper.replace(**keywords)
    assert scenario.rows_plan(2) == plan
    assert_same_rows(scenario.monte_carlo(2), rows)


def test_keys_are_those_of_a_sweep(command, tmp_path, paper):
    code, _, error = command(
        "run", SCENARIOS / "paper.toml", "--runs", 2, "--rows", tmp_path / "rows.csv",
        "--sweep", "sonar.noise=2 mm,5 mm",
    )  # fmt: skip
    assert code == 0, error
    for number, noise in enumerate(["2 mm", "5 mm"], 1):
        _, rows = rows_of(tmp_path / f"rows.{number}.csv")
        assert_same_rows(paper.replace({"sonar.noise": noise}).monte_carlo(2), rows)


@pytest.mark.parametrize("name", ["paper", "classroom"])
def test_the_trace_is_that_of_the_command(command, tmp_path, name):
    file = tmp_path / "trace.csv"
    code, _, error = command("run", SCENARIOS / f"{name}.toml", "--runs", 1, "--seed", 3, "--trace", file)
    assert code == 0, error
    trace = sf.Scenario(name).run(3).trace
    with open(file, encoding="utf-8") as lines:
        rows = list(csv.DictReader(lines))
    assert list(rows[0]) == trace.columns
    assert len(rows) == len(trace)
    for column in trace.columns:
        values = trace[column]
        for value, row in zip(values.tolist(), rows):
            cell = row[column]
            if isinstance(value, str):
                assert value == cell
            elif math.isnan(value):
                assert cell == ""
            else:
                # The file has nine digits.
                assert math.isclose(float(cell), value, rel_tol=1e-8, abs_tol=1e-9), column


def test_the_summary_is_that_of_the_command(command, paper):
    code, out, error = command("run", SCENARIOS / "paper.toml", "--runs", 5, "--json")
    assert code == 0, error
    expected = json.loads(out)
    expected.pop("cpu_seconds")
    # Of the values of the files, not of the runs.
    assert expected.pop("warnings") == []
    assert sf.summary(paper.monte_carlo(5)) == expected


def test_the_recording_is_that_of_the_command(command, tmp_path, classroom):
    folders = [tmp_path / "command", tmp_path / "python"]
    for folder in folders:
        folder.mkdir()
    log = folders[0] / "log.csv"
    code, _, error = command("run", SCENARIOS / "classroom.toml", "--runs", 1, "--seed", 2, "--record", log)
    assert code == 0, error
    classroom.record(folders[1] / "log.csv", seed=2)
    for name in ("log.csv", "reference.csv", "robot.toml", "map.toml"):
        assert (folders[0] / name).read_bytes() == (folders[1] / name).read_bytes(), name


def test_a_replay_has_the_estimates_of_the_drive(classroom, recording):
    ticks, replayed = classroom.run(1).ticks, sf.replay(recording / "log.csv").run.ticks
    times, at, of = np.intersect1d(ticks["time_s"], replayed["time_s"], return_indices=True)
    assert len(times) > 5_000
    for name in ("x_m", "y_m", "heading_rad", "scale_right", "sigma_x_m"):
        assert ticks[name][at].tobytes() == replayed[name][of].tobytes(), name


class Setups:
    """Keeps the robot as the simulator configures it."""

    robot = None

    def __init__(self, setup):
        Setups.robot, self.start = setup.robot, setup.pose

    def odometry(self, t, right, left):
        pass

    def fix(self, bearing, measured):
        pass

    def pose(self):
        return self.start


def golden(name):
    lines = (ROOT / "tests/golden" / name).read_text(encoding="utf-8").splitlines()
    pairs = [line.split(" ") for line in lines if not line.startswith("#")]
    return [(bytes.fromhex(request), bytes.fromhex(answer)) for request, answer in pairs]


def varint(data, at):
    value, shift = 0, 0
    while True:
        value |= (data[at] & 0x7F) << shift
        at, shift = at + 1, shift + 7
        if data[at - 1] < 0x80:
            return value, at


def test_the_golden_trace_step_by_step(paper):
    """Requests and answers as `docs/pil.md` has them: wheel travel (1), aim (2), range (3)."""
    paper.replace(policy="informative").run(0, estimator=Setups)
    (begin, _), *exchanges = golden("localizer.golden")
    x, y, heading, position, turn = struct.unpack_from("<5f", begin, 3)
    localizer = sf.Localizer(Setups.robot, paper.map, (x, y, heading), position_deviation=position, heading_deviation=turn)
    upper = np.triu_indices(7)
    aim, compared = None, 0
    for request, answer in exchanges:
        if request[0] == 1:
            time, at = varint(request, 1)
            localizer.odometry(time * 1e-6, *struct.unpack_from("<2f", request, at))
        elif request[0] == 2:
            aim = localizer.aim()
            wall, at = varint(answer, 2)
            assert (aim.wall, aim.bearing, aim.range) == (wall, *struct.unpack_from("<2f", answer, at))
            continue
        elif request[0] == 3:
            measured = struct.unpack_from("<f", request, 2)[0] if request[1] else None
            assert localizer.fix(aim, measured).outcome in ("accepted", "downweighted", "gated", "refused")
        else:
            continue
        bits = localizer.state.tobytes() + localizer.covariance[upper].tobytes()
        assert bits in answer
        compared += 1
    assert compared > 600


def test_too_little_noise_is_named(paper):
    """Ranges of which each is within the gate, but all are two deviations too long."""
    paper.replace(policy="informative").run(0, estimator=Setups)
    (begin, _), *_ = golden("localizer.golden")
    localizer = sf.Localizer(Setups.robot, paper.map, struct.unpack_from("<3f", begin, 3))
    assert localizer.mismatch is None
    variance = 0.0
    for _ in range(60):
        aim = localizer.aim()
        variance = localizer.fix(aim, aim.range + 2 * variance**0.5).innovation_variance
    assert localizer.mismatch == "NoiseTooSmall"


class Twin:
    """A localizer of its own that gets what the localizer of the run gets."""

    def __init__(self, setup):
        walls = sf.Scenario("paper").map
        sigma = np.sqrt(np.diag(setup.covariance))
        self.localizer = sf.Localizer(setup.robot, walls, setup.pose, position_deviation=sigma[0], heading_deviation=sigma[2])
        self.odometry = self.localizer.odometry

    def fix(self, bearing, measured):
        aim = self.localizer.aim()
        assert aim.bearing == bearing
        return self.localizer.fix(aim, measured).is_used

    def pose(self):
        return self.localizer.pose


def test_a_localizer_as_an_estimator_is_the_localizer(paper):
    run = paper.run(4, estimator=Twin)
    ticks, poses = run.ticks, run.estimator_poses
    for column, name in enumerate(("x_m", "y_m", "heading_rad")):
        assert ticks[name][1:].tobytes() == poses[:, column].tobytes()
    ours, theirs = run.row.to_numpy()
    for name in ("error_x_m", "path_squares_x_m2", "worst_position_error_m", "fixes_accepted"):
        assert ours[name] == theirs[name]
