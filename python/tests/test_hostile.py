"""Arguments that nobody should pass: an exception or a right result, never an abort."""

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import sonarfix as sf

# What a caller catches. A PanicException is none of these.
ERRORS = (sf.SonarfixError, TypeError, ValueError, OverflowError, KeyError, OSError, AttributeError)
HUGE = 10**30
NUMBERS = [float("nan"), float("inf"), -float("inf"), 1e308, -1e308, HUGE, "1", None, [], np.zeros(3), 1j]
ARRAYS = [
    [],
    [[]],
    None,
    "text",
    np.zeros(0),
    np.zeros((2, 2)),
    np.zeros((3, 2, 3)),
    np.full((1, 2, 2), np.nan),
    np.full((1, 2, 2), np.inf),
    np.full((1, 2, 2), 1e30),
    np.zeros((1, 2, 2)),
    np.array([["a", "b"]]),
    np.array([object()]),
    np.zeros((1, 2, 2), dtype=complex),
    np.zeros((1, 2, 2), dtype="M8[s]"),
    np.ones((1, 2, 2), dtype=bool),
    [[1, 2], [3]],
    {},
    np.float64(1.0),
]
PAPER = sf.Scenario("paper")


def localizer():
    return sf.Localizer(PAPER.robot, PAPER.map, (0.0, 0.0, 0.0))


def search():
    return sf.Search(PAPER.robot, PAPER.map)


def navigator():
    return sf.Navigator(PAPER.robot, PAPER.map)


CALLS = {
    "aim_at": lambda v: localizer().aim_at(v),
    "odometry time": lambda v: localizer().odometry(v, 0.1, 0.1),
    "odometry right": lambda v: localizer().odometry(1.0, v, 0.1),
    "odometry turn": lambda v: localizer().odometry(1.0, 0.1, 0.1, (v, 0.1)),
    "heading": lambda v: localizer().absolute(0.0, heading=v),
    "deviation": lambda v: localizer().absolute(0.0, heading=0.1, heading_deviation=v),
    "start time": lambda v: sf.Localizer(PAPER.robot, PAPER.map, (0, 0, 0), time=v),
    "start deviation": lambda v: sf.Localizer(PAPER.robot, PAPER.map, (0, 0, 0), position_deviation=v),
    "search odometry": lambda v: search().odometry(v, 0.0),
    "search bearing": lambda v: search().ping(v, 1.0),
    "search range": lambda v: search().ping(0.0, v),
    "search poll": lambda v: search().poll(v),
    "navigator ping": lambda v: navigator().ping(v, v),
    "runs": lambda v: PAPER.monte_carlo(v, 0) if v is not None else None,
    "seed": lambda v: PAPER.run(v),
    "workers": lambda v: PAPER.monte_carlo(1, workers=v),
    "tolerance": lambda v: PAPER.map.simplify(v),
    "resolution": lambda v: sf.Map.from_occupancy_grid(np.ones((4, 4)), v),
    "key": lambda v: PAPER.replace({"truth.scale_right": v}),
    "fix period": lambda v: PAPER.replace(fix_period=v),
}
OF_ARRAYS = {
    "walls": lambda v: sf.Map(v),
    "pose": lambda v: sf.Localizer(PAPER.robot, PAPER.map, v),
    "grid": lambda v: sf.Map.from_occupancy_grid(v, 0.05),
    "path": lambda v: sf.Scenario.on_map(PAPER.map, v),
    "scenario": lambda v: sf.Scenario(v),
}


def survives(call, value):
    try:
        call(value)
    except ERRORS as error:
        assert str(error) or isinstance(error, (OverflowError, KeyError))


CASES = [(name, CALLS[name], value) for name, value in itertools.product(CALLS, NUMBERS)]
CASES += [(name, OF_ARRAYS[name], value) for name, value in itertools.product(OF_ARRAYS, ARRAYS)]


def test_there_are_many_cases():
    assert len(CASES) >= 200


@pytest.mark.parametrize("case", range(len(CASES)))
def test_hostile_arguments(case):
    _, call, value = CASES[case]
    survives(call, value)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1.0, 1e30, 0.0])
def test_a_range_that_is_none_changes_no_bit(value):
    robot = localizer()
    robot.odometry(1.0, 0.1, 0.1)
    aim, before = robot.aim(), (robot.state.tobytes(), robot.covariance.tobytes())
    assert robot.fix(aim, value).outcome == "refused"
    assert (robot.state.tobytes(), robot.covariance.tobytes()) == before


def test_refused_travel_changes_no_bit():
    robot = localizer()
    before = robot.state.tobytes()
    for arguments in [(1.0, 1e6, 0.0), (1.0, float("nan"), 0.0), (-1.0, 0.0, 0.0)]:
        with pytest.raises(sf.InputError):
            robot.odometry(*arguments)
    assert robot.state.tobytes() == before


@pytest.mark.parametrize("result", [None, "x", [], [1.0], [np.nan] * 3, np.zeros(8), 5, {}])
def test_poses_that_are_none(result):
    class Wrong:
        def __init__(self, setup):
            pass

        def odometry(self, *_):
            pass

        def fix(self, *_):
            pass

        def pose(self):
            return result

    with pytest.raises(ERRORS):
        PAPER.run(0, estimator=Wrong)


@pytest.mark.parametrize("choice", ["nowhere", 8, -1, 10**12, float("nan"), 1e9, [], object(), b"x"])
def test_choices_that_are_none(choice):
    with pytest.raises(ERRORS):
        PAPER.run(0, policy=lambda view: choice)


def test_a_localizer_used_by_many_threads():
    robot, errors = localizer(), []

    def work(first):
        for step in range(500):
            try:
                robot.odometry((first + step) * 1e-3, 1e-4, 1e-4)
            except (sf.InputError, RuntimeError) as error:
                errors.append(error)

    threads = [threading.Thread(target=work, args=(n * 1000,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.all(np.isfinite(robot.state))


def test_an_object_used_and_dropped_by_another_thread():
    held = [localizer(), search(), navigator(), PAPER.run(0)]
    thread = threading.Thread(target=lambda: [repr(one) for one in held] and held.clear())
    thread.start()
    thread.join()
    assert held == []


def test_monte_carlos_at_once():
    tables = {}

    def work(number):
        tables[number] = PAPER.monte_carlo(4, 0, workers=2)["error_x_m"].tobytes()

    threads = [threading.Thread(target=work, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(set(tables.values())) == 1
    assert len(tables) == 4


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
@pytest.mark.filterwarnings("ignore:.*fork.*:DeprecationWarning")
def test_a_fork_after_a_monte_carlo():
    expected = PAPER.monte_carlo(4, 0)["error_x_m"].tobytes()
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=lambda: queue.put(PAPER.monte_carlo(4, 0)["error_x_m"].tobytes()))
    child.start()
    assert queue.get(timeout=60) == expected
    child.join()
    assert child.exitcode == 0


@pytest.mark.skipif(sys.platform == "win32", reason="signals of Unix")
@pytest.mark.parametrize("name", ["paper", "classroom"])
def test_ctrl_c_ends_long_work(name):
    program = (
        f"import sonarfix as sf\nscenario = sf.Scenario({name!r})\nprint('ready', flush=True)\nscenario.monte_carlo(1_000_000)\n"
    )
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "ready\n"
    time.sleep(0.3)
    child.send_signal(signal.SIGINT)
    # The work would take minutes.
    _, error = child.communicate(timeout=10)
    assert "KeyboardInterrupt" in error


def test_an_error_of_the_progress_ends_the_work():
    def fail(count):
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        PAPER.monte_carlo(1_000_000, progress=fail)


def test_progress_counts_each_run_once():
    counts = []
    PAPER.monte_carlo(25, progress=counts.append)
    assert sum(counts) == 25
