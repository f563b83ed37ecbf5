"""Telemetry and commands of a robot."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, NamedTuple

from . import _sonarfix
from ._sonarfix import Robot


class Message(NamedTuple):
    """A message of a robot (docs/link.md)."""

    kind: str
    """Its kind, for example ``"Estimate"``, ``"Ping"``, ``"Odometry"``."""
    content: dict[str, Any]
    """Its content, as it is named in docs/link.md; m, rad, µs."""
    lost: int
    """Number of frames lost before it."""


class Monitor(Iterator[Message]):
    """The live telemetry of a robot as an iterator, and its commands.

    A command returns when the robot has acknowledged it, and raises ConnectionFailed if the robot refuses or is silent. Use it
    in a ``with`` statement, so that a recording is ended whole.
    """

    def __init__(
        self,
        port: str,
        baud: int = 115_200,
        *,
        record: str | os.PathLike[str] | None = None,
        force: bool = False,
    ) -> None:
        """Opens a port: a serial port, ``tcp:HOST:PORT``, or a file of recorded bytes.

        ``record`` is a log to write for ``replay``; ``force`` replaces a file that exists.
        """
        self._monitor = _sonarfix.Monitor(port, baud, record=record, force=force)

    def __iter__(self) -> Monitor:
        return self

    def __next__(self) -> Message:
        message = self._monitor.receive()
        assert message is not None
        return Message(*message)

    def __enter__(self) -> Monitor:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def receive(self, seconds: float | None = None) -> Message | None:
        """The next message; None if none arrives within so many seconds. Raises StopIteration at the end of the stream."""
        message = self._monitor.receive(seconds)
        return None if message is None else Message(*message)

    def close(self) -> int:
        """Ends the recording; returns the number of its logs."""
        return self._monitor.end_recording()

    def start(self) -> None:
        """Runs the robot's loop."""
        self._monitor.start()

    def stop(self) -> None:
        """Stops the loop."""
        self._monitor.stop()

    def search(self) -> None:
        """Declares the pose unknown, and searches for it."""
        self._monitor.search()

    def reset_calibration(self) -> None:
        """Discards the estimated calibration of wheels and ranger."""
        self._monitor.reset_calibration()

    def point(self, bearing: float) -> None:
        """Turns the servo of a robot that waits to a bearing, radians from the heading."""
        self._monitor.point(bearing)

    def set_pose(self, pose: Any, *, position_deviation: float = 0.05, heading_deviation: float = 0.05) -> None:
        """Restarts the localizer from a pose of shape (3,): x, y (m), heading (rad); with its deviations (m, rad)."""
        self._monitor.set_pose(pose, position_deviation=position_deviation, heading_deviation=heading_deviation)

    def absolute(
        self,
        *,
        heading: float | None = None,
        position: tuple[float, float] | None = None,
        position_deviation: float = 0.05,
        heading_deviation: float = 0.05,
        age: float = 0.0,
    ) -> None:
        """Passes a heading (rad), a position (m) or both, measured ``age`` seconds ago, to the running localizer."""
        self._monitor.absolute(
            heading=heading,
            position=position,
            position_deviation=position_deviation,
            heading_deviation=heading_deviation,
            age=age,
        )

    def set_configuration(self, robot: Robot) -> None:
        """Stores a robot's configuration in the robot, and restarts the localizer with it."""
        self._monitor.set_configuration(robot)


def monitor(
    port: str,
    baud: int = 115_200,
    *,
    record: str | os.PathLike[str] | None = None,
    force: bool = False,
) -> Monitor:
    """Opens the telemetry of a robot: ``for message in sonarfix.monitor("/dev/ttyUSB0"): …`` (docs/live.md)."""
    return Monitor(port, baud, record=record, force=force)
