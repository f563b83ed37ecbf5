"""The extended Kalman filter of filterpy as an estimator of your own, beside the localizer.

The filter is that of filterpy; this file tells it the robot: how it moves, and what a range to a wall measures (docs/model.md).
The state is x, y, heading, scale errors of the right and the left wheel, error of the track width, scale error of the ranges.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter

import sonarfix as sf


def wrapped(angle: float) -> float:
    return math.remainder(angle, 2.0 * math.pi)


class FilterpyEkf:
    """filterpy's EKF; ``gate`` is the largest innovation that it takes, in standard deviations."""

    gate = 5.0

    def __init__(self, setup: sf.Setup) -> None:
        self.walls = [Wall(ends) for ends in setup.walls]
        self.model = setup.robot.model
        self.ekf = ExtendedKalmanFilter(dim_x=7, dim_z=1)
        self.ekf.x = np.concatenate([setup.pose, np.zeros(4)])
        self.ekf.P = setup.covariance.copy()

    def odometry(self, t: float, right: float, left: float) -> None:
        x, model = self.ekf.x, self.model
        width = model["track_width"] + x[5]
        by_right, by_left = right * (1.0 + x[3]), left * (1.0 + x[4])
        turn, advance = (by_right - by_left) / width, 0.5 * (by_right + by_left)
        sin, cos = math.sin(x[2] + turn / 2.0), math.cos(x[2] + turn / 2.0)

        def column(by_advance: float, by_turn: float) -> list[float]:
            across = advance * by_turn / 2.0
            return [by_advance * cos - across * sin, by_advance * sin + across * cos, by_turn]

        f = np.eye(7)
        f[:2, 2] = -advance * sin, advance * cos
        f[:3, 3] = column(right / 2.0, right / width)
        f[:3, 4] = column(left / 2.0, -left / width)
        f[:3, 5] = column(0.0, -turn / width)
        g = np.zeros((7, 2))
        g[:3, 0] = column((1.0 + x[3]) / 2.0, (1.0 + x[3]) / width)
        g[:3, 1] = column((1.0 + x[4]) / 2.0, -(1.0 + x[4]) / width)
        wheels = model["wheel_noise"] ** 2 * np.diag([abs(right), abs(left)])
        distance = 0.5 * (abs(right) + abs(left))
        walk = np.array([model["scale_walk"], model["scale_walk"], model["track_width_walk"]])
        q = g @ wheels @ g.T
        q[[3, 4, 5], [3, 4, 5]] += walk**2 * distance

        moved = np.array([advance * cos, advance * sin, turn, 0.0, 0.0, 0.0, 0.0])
        self.ekf.F, self.ekf.Q = f, q
        self.ekf.B = np.eye(7)
        # filterpy moves the state by F x + B u: the motion is not linear, so that x is set, and F serves P.
        self.ekf.predict_x = lambda u: setattr(self.ekf, "x", x + u)
        self.ekf.predict(moved)
        self.ekf.x[2] = wrapped(self.ekf.x[2])

    def fix(self, bearing: float, measured: float | None) -> bool:
        wall = self.wall_along(bearing)
        if measured is None or wall is None:
            return False
        expected, h = self.expected(self.ekf.x, wall)
        noise = self.model["range_noise"] ** 2 + (self.model["range_noise_per_metre"] * expected) ** 2
        variance = (h @ self.ekf.P @ h.T).item() + noise
        if (measured - expected) ** 2 > self.gate**2 * variance:
            return False
        self.ekf.update(
            np.array([measured]),
            HJacobian=lambda x: self.expected(x, wall)[1],
            Hx=lambda x: np.array([self.expected(x, wall)[0]]),
            R=noise,
        )
        self.ekf.x[2] = wrapped(self.ekf.x[2])
        return True

    def pose(self) -> list[float]:
        x = self.ekf.x
        return [*x[:5], self.model["track_width"] + x[5], x[6]]

    def covariance(self) -> Any:
        return self.ekf.P

    def sonar(self, x: Any) -> tuple[float, float, float, float]:
        """The place of the sonar, and its lever arm in the map frame."""
        ahead, aside = self.model["mount"]
        sin, cos = math.sin(x[2]), math.cos(x[2])
        lever = cos * ahead - sin * aside, sin * ahead + cos * aside
        return x[0] + lever[0], x[1] + lever[1], *lever

    def expected(self, x: Any, wall: Wall) -> tuple[float, Any]:
        """The expected range to a wall, and its derivative by the state."""
        at_x, at_y, lever_x, lever_y = self.sonar(x)
        signed = wall.distance(at_x, at_y)
        slope = math.copysign(1.0 + x[6], signed)
        h = np.zeros((1, 7))
        h[0, :2] = slope * wall.normal
        h[0, 2] = slope * (wall.normal[1] * lever_x - wall.normal[0] * lever_y)
        h[0, 6] = abs(signed)
        return (1.0 + x[6]) * abs(signed), h

    def wall_along(self, bearing: float) -> Wall | None:
        """The nearest wall that a beam at a bearing is square to."""
        x = self.ekf.x
        at_x, at_y, _, _ = self.sonar(x)
        within = [
            wall
            for wall in self.walls
            if wall.has_foot(at_x, at_y) and abs(wrapped(wall.direction(at_x, at_y) - x[2] - bearing)) < self.model["cone"]
        ]
        return min(within, key=lambda wall: abs(wall.distance(at_x, at_y)), default=None)


class Wall:
    """A wall as a line with two ends."""

    def __init__(self, ends: Any) -> None:
        self.start = ends[0]
        self.length = float(np.hypot(*(ends[1] - ends[0])))
        self.along = (ends[1] - ends[0]) / self.length
        self.normal = np.array([-self.along[1], self.along[0]])

    def distance(self, x: float, y: float) -> float:
        """The distance of a point, negative on the right side."""
        return float(self.normal[0] * (x - self.start[0]) + self.normal[1] * (y - self.start[1]))

    def has_foot(self, x: float, y: float) -> bool:
        along = self.along[0] * (x - self.start[0]) + self.along[1] * (y - self.start[1])
        return bool(0.0 <= along <= self.length)

    def direction(self, x: float, y: float) -> float:
        """The direction from a point to its foot."""
        side = -1.0 if self.distance(x, y) < 0.0 else 1.0
        return math.atan2(-side * self.normal[1], -side * self.normal[0])


def main() -> None:
    for name in ("paper", "classroom"):
        run = sf.Scenario(name).run(seed=0, estimator=FilterpyEkf)
        print(name, run.row["estimator"], run.row["worst_position_error_m"])


if __name__ == "__main__":
    main()
