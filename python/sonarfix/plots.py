"""Figures of runs, maps and forecasts with matplotlib (``pip install sonarfix[plot]``), in the look of the report."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from ._sonarfix import Map, Run
    from .offline import Plan

# Hues of Okabe and Ito, as in the report.
COLOURS = {
    "ink": "#1B1F24",
    "grid": "#E3E6EA",
    "wall": "#6B7280",
    "truth": "#000000",
    "estimate": "#0072B2",
    "encoders": "#D55E00",
    "band": "#56B4E9",
    "error": "#CC79A7",
    "accepted": "#009E73",
    "gated": "#E69F00",
    "refused": "#9AA0A8",
    "guest": "#009E73",
}
"""The colour of each role: those of the report's figures."""


def _axes(ax: Any, size: tuple[float, float] = (8.0, 5.0)) -> Any:
    if ax is None:
        from matplotlib import pyplot as plt

        _, ax = plt.subplots(figsize=size, layout="constrained")
    return ax


def _style(ax: Any, x: str, y: str) -> Any:
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.grid(color=COLOURS["grid"])
    ax.set_axisbelow(True)
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)
    return ax


def _walls(ax: Any, walls: Any) -> None:
    for number, wall in enumerate(walls):
        label = "walls" if number == 0 else None
        ax.plot(wall[:, 0], wall[:, 1], color=COLOURS["wall"], linewidth=2.5, label=label)


def plot_map(map: Map, ax: Any | None = None, *, names: bool = False) -> Any:
    """Draws the walls of a map, metres; with ``names`` their names. Returns the axes."""
    ax = _axes(ax)
    _walls(ax, map.walls)
    if names:
        for name, wall in zip(map.names, map.walls):
            ax.annotate(name, wall.mean(axis=0), color=COLOURS["ink"], fontsize=8)
    ax.set_aspect("equal")
    return _style(ax, "x (m)", "y (m)")


def plot_run(run: Run, ax: Any | None = None, *, odometry: bool = True, pings: bool = False) -> Any:
    """Draws walls, true path, estimate and dead reckoning of a run, metres; with ``pings`` the measured points.

    Returns the axes.
    """
    ax = _axes(ax)
    _walls(ax, run.walls)
    ticks = run.ticks
    if odometry:
        _path(ax, ticks["odometry_x_m"], ticks["odometry_y_m"], "encoders", "encoders alone", 1.0)
    _path(ax, ticks["true_x_m"], ticks["true_y_m"], "truth", "true", 2.5)
    poses = run.estimator_poses
    if len(poses):
        _path(ax, poses[:, 0], poses[:, 1], "guest", "other estimator", 1.2)
    _path(ax, ticks["x_m"], ticks["y_m"], "estimate", "estimated", 1.2)
    if pings:
        _pings(ax, run)
    ax.set_aspect("equal")
    ax.legend(frameon=False, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3)
    return _style(ax, "x (m)", "y (m)")


def _path(ax: Any, x: Any, y: Any, role: str, label: str, width: float) -> None:
    ax.plot(x, y, color=COLOURS[role], linewidth=width, label=label)


def _pings(ax: Any, run: Run) -> None:
    fixes = run.fixes
    reach, direction = fixes["fix_range_m"], fixes["fix_direction_rad"]
    x = fixes["fix_sonar_x_m"] + reach * np.cos(direction)
    y = fixes["fix_sonar_y_m"] + reach * np.sin(direction)
    for outcome, role in (("accepted", "accepted"), ("gated", "gated")):
        chosen = fixes["fix_outcome"] == outcome
        ax.plot(x[chosen], y[chosen], ".", markersize=3, color=COLOURS[role], label=outcome)


def plot_errors(run: Run) -> Any:
    """Draws the errors of x, y (mm) and heading (degrees) over time, within one standard deviation and the bound.

    Returns the figure.
    """
    from matplotlib import pyplot as plt

    ticks = run.ticks
    figure, rows = plt.subplots(3, 1, figsize=(8.0, 6.0), sharex=True, layout="constrained")
    states = (("x_m", 1e3, "x (mm)"), ("y_m", 1e3, "y (mm)"), ("heading_rad", 180.0 / np.pi, "heading (°)"))
    for ax, (state, scale, label) in zip(rows, states):
        error = ticks[state] - ticks[f"true_{state}"]
        if state == "heading_rad":
            error = (error + np.pi) % (2.0 * np.pi) - np.pi
        time, sigma, bound = ticks["time_s"], ticks[f"sigma_{state}"], ticks[f"bound_{state}"]
        ax.fill_between(time, -scale * sigma, scale * sigma, color=COLOURS["band"], alpha=0.4, label="one σ")
        for side in (-scale, scale):
            name = "bound" if side > 0 else None
            ax.plot(time, side * bound, color=COLOURS["ink"], linewidth=0.6, label=name)
        ax.plot(time, scale * error, color=COLOURS["error"], linewidth=0.8, label="error")
        _style(ax, "", label)
    rows[0].legend(frameon=False, loc="upper right", ncols=3)
    rows[-1].set_xlabel("t (s)")
    return figure


def plot_plan(plan: Plan, ax: Any | None = None) -> Any:
    """Draws the bound on the position along the path of a forecast, millimetres; returns the axes."""
    ax = _axes(ax)
    samples = plan.samples
    bound = 1e3 * np.hypot(samples["sigma_x_m"], samples["sigma_y_m"])
    points = ax.scatter(samples["at_x_m"], samples["at_y_m"], c=bound, s=6, cmap="viridis")
    ax.figure.colorbar(points, ax=ax, label="bound on the position error (mm)")
    ax.set_aspect("equal")
    return _style(ax, "x (m)", "y (m)")


def animate_run(run: Run, *, speed: float = 20.0, frames_per_second: float = 10.0) -> Any:
    """An animation of a run: the path so far, the robot and its pings; ``speed`` is simulated seconds per second.

    Returns a FuncAnimation: ``IPython.display.HTML(animation.to_jshtml())`` shows it in a notebook.
    """
    from matplotlib import pyplot as plt
    from matplotlib.animation import FuncAnimation

    if not (speed > 0.0 and frames_per_second > 0.0):
        raise ValueError("speed and frames_per_second must be above zero")
    ticks, fixes = run.ticks, run.fixes
    figure, ax = plt.subplots(figsize=(6.0, 5.0), layout="constrained")
    _walls(ax, run.walls)
    _style(ax, "x (m)", "y (m)").set_aspect("equal")
    (truth,) = ax.plot([], [], color=COLOURS["truth"], linewidth=2.0)
    (estimate,) = ax.plot([], [], color=COLOURS["estimate"], linewidth=1.0)
    (beam,) = ax.plot([], [], color=COLOURS["accepted"], linewidth=1.0)
    (robot,) = ax.plot([], [], "o", color=COLOURS["estimate"])
    time = ticks["time_s"]
    step = speed / frames_per_second

    def draw(frame: int) -> tuple[Any, ...]:
        now = time[0] + frame * step
        shown = time <= now
        truth.set_data(ticks["true_x_m"][shown], ticks["true_y_m"][shown])
        estimate.set_data(ticks["x_m"][shown], ticks["y_m"][shown])
        robot.set_data(ticks["x_m"][shown][-1:], ticks["y_m"][shown][-1:])
        last = np.flatnonzero(fixes["fix_time_s"] <= now)[-1:]
        sonar = np.array([fixes["fix_sonar_x_m"][last], fixes["fix_sonar_y_m"][last]])
        direction = fixes["fix_direction_rad"][last]
        reach = np.nan_to_num(fixes["fix_range_m"][last])
        end = sonar + reach * np.array([np.cos(direction), np.sin(direction)])
        beam.set_data(np.concatenate([sonar[0], end[0]]), np.concatenate([sonar[1], end[1]]))
        return truth, estimate, beam, robot

    count = int((time[-1] - time[0]) / step) + 1
    return FuncAnimation(figure, draw, frames=count, interval=1e3 / frames_per_second, blit=True)
