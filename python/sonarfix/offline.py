"""Forecast, replay, calibration, survey, and the search for the pose in a recording."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Union

import numpy as np
from numpy.typing import NDArray

from . import _sonarfix
from ._sonarfix import Map, Robot, Run, Scenario, Table

StrPath = Union[str, "os.PathLike[str]"]
"""The path of a file."""


@dataclass(frozen=True)
class Plan:
    """The forecast of the accuracy along a path: the bound on the estimate's error."""

    summary: dict[str, Any]
    """The numbers of ``sonarfix plan --json``: position and heading (RMS and worst), legs, blind stretches; m, rad, s."""
    samples: Table
    """The bound at each tenth of a second: place, deviations of x, y (m) and heading (rad), whether the robot is blind."""
    starts: dict[str, Any] | None
    """What starts without a pose lead to, if they were asked for."""

    def plot(self, ax: Any = None) -> Any:
        """Draws the bound on the position along the path, millimetres, with matplotlib; returns the axes."""
        from .plots import plot_plan

        return plot_plan(self, ax)


def plan(
    scenario: Scenario,
    runs: int = 10,
    starts: int | None = None,
    *,
    workers: int | None = None,
    progress: Callable[[int], object] | None = None,
) -> Plan:
    """Forecasts how well a robot would know its pose along the path of a scenario (docs/plan.md).

    ``runs`` are simulated, since detection is random. With ``starts`` the robot also starts without a pose at so many places
    along the path. ``workers`` and ``progress`` are those of Scenario.monte_carlo.
    """
    summary, samples, found = _sonarfix.plan(scenario, runs, starts, workers=workers, progress=progress)
    return Plan(summary, samples, found)


@dataclass(frozen=True)
class Replay:
    """A recording, replayed through the localizer."""

    run: Run
    """The trace: ``run.trace``, ``run.ticks``, ``run.fixes``, ``run.plot()``."""
    summary: dict[str, Any]
    """The numbers of ``sonarfix replay --json``; lengths in m, angles in rad, times in s; None where there is no reference."""
    skipped: list[str]
    """The lines that were skipped, with the reason."""


def replay(
    log: StrPath,
    robot: Robot | None = None,
    map: Map | None = None,
    reference: StrPath | None = None,
    *,
    strict: bool = False,
) -> Replay:
    """Replays a log through the localizer (docs/exchange.md).

    Robot, map and reference are by default ``robot.toml``, ``map.toml`` and ``reference.csv`` (if it exists) beside the log.
    With ``strict`` the first malformed line raises RecordingError.
    """
    run, summary, skipped = _sonarfix.replay(log, robot, map, reference, strict=strict)
    return Replay(run, summary, skipped)


@dataclass(frozen=True)
class Estimate:
    """An estimated constant of a robot."""

    name: str
    """What it is."""
    value: float
    """Its value: relative for wheels, track width and range scale, m, rad or s for others."""
    deviation: float
    """Its standard deviation."""
    halves: float
    """Difference of the two halves of the recording, in standard deviations."""
    determined: str
    """``"yes"``, ``"jointly"`` or ``"no"``: whether the recording determines it."""


@dataclass(frozen=True)
class Calibration:
    """The calibration of a robot from a recording."""

    estimates: list[Estimate]
    """The constants."""
    robot: Robot
    """The robot with the calibration."""
    trajectory: NDArray[np.float64]
    """The smoothed poses, shape (n, 4): time (s), x, y (m), heading (rad)."""
    inliers: int
    """Echoes within three deviations of their wall."""
    expected: int
    """Echoes for which the map has a wall."""


def calibrate(
    log: StrPath,
    robot: Robot | None = None,
    map: Map | None = None,
    reference: StrPath | None = None,
    start: tuple[float, float, float] | None = None,
) -> Calibration:
    """Estimates wheels, track width, range scale, mount and servo from one recorded drive (docs/calibrate.md).

    Robot and map are by default ``robot.toml`` and ``map.toml`` beside the log. ``start`` replaces the start pose of the log:
    x, y (m), heading (rad). Raises RecordingError if the recording does not determine a calibration.
    """
    estimates, trajectory, calibrated, (inliers, expected) = _sonarfix.calibrate(log, robot, map, reference, start)
    return Calibration([Estimate(*one) for one in estimates], calibrated, trajectory, inliers, expected)


@dataclass(frozen=True)
class Survey:
    """A map of walls from a recording, in the frame of the start pose."""

    map: Map
    """The walls."""
    reasons: list[str]
    """Why the map is not sure; empty if it is."""
    accuracy: NDArray[np.float64]
    """The standard deviation of each wall's distance, shape (n,), m."""
    echoes: NDArray[np.int64]
    """The number of echoes from each wall, shape (n,)."""
    path: NDArray[np.float64]
    """The poses, shape (n, 4): time (s), x, y (m), heading (rad)."""
    distance: float
    """Distance driven, m."""

    @property
    def is_sure(self) -> bool:
        """Whether the map can be used."""
        return not self.reasons


def survey(log: StrPath, robot: Robot | None = None) -> Survey:
    """Makes a map of the walls from the recording of a drive with a sweeping sonar (docs/survey.md).

    The robot is by default ``robot.toml`` beside the log. Raises RecordingError.
    """
    found, reasons, walls, path, distance = _sonarfix.survey(log, robot)
    accuracy = np.array([accuracy for accuracy, _, _ in walls], dtype=np.float64)
    echoes = np.array([echoes for _, echoes, _ in walls], dtype=np.int64)
    return Survey(found, reasons, accuracy, echoes, path, distance)


@dataclass(frozen=True)
class Found:
    """The pose that a recording without a start pose leads to."""

    answer: str
    """``"searching"``, ``"several"``, ``"along"``, ``"nowhere"`` or ``"unique"``."""
    poses: NDArray[np.float64]
    """The hypotheses at the end, the best first, shape (n, 3): x, y (m), heading (rad)."""
    answers: int
    """How many of them, from the first, are answers."""
    unique_after: float | None
    """Seconds until the first unique answer."""
    summary: dict[str, Any]
    """The numbers of ``sonarfix find --json``."""


def find(log: StrPath, robot: Robot | None = None, map: Map | None = None) -> Found:
    """Searches for the pose in a log without a start pose (docs/search.md).

    Robot and map are by default ``robot.toml`` and ``map.toml`` beside the log.
    """
    found = _sonarfix.find(log, robot, map)
    poses = [list(one["pose"].values()) for one in found["hypotheses"]]
    array = np.array(poses, dtype=np.float64).reshape(-1, 3)
    return Found(found["answer"], array, found["answers"], found["unique_after"], found)
