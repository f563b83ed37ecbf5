"""Estimators and policies of Python in the loop of the simulator."""

import sys
import time

import numpy as np
import pytest
from conftest import ROOT

import sonarfix as sf

sys.path.insert(0, str(ROOT / "python/examples"))


class DeadReckoning:
    """Odometry alone."""

    def __init__(self, setup):
        self.state, self.width = setup.pose, setup.robot.track_width

    def odometry(self, t, right, left):
        turn = (right - left) / self.width
        advance, heading = 0.5 * (right + left), self.state[2] + 0.5 * turn
        self.state = self.state + [advance * np.cos(heading), advance * np.sin(heading), turn]

    def fix(self, bearing, measured):
        return False

    def pose(self):
        return self.state


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_filterpy_agrees_on_the_paper(paper, seed):
    filterpy_ekf = pytest.importorskip("filterpy_ekf")
    run = paper.run(seed, estimator=filterpy_ekf.FilterpyEkf)
    ticks, poses = run.ticks, run.estimator_poses
    for column, name in enumerate(("x_m", "y_m", "heading_rad")):
        difference = poses[:, column] - ticks[name][1:]
        if name == "heading_rad":
            difference = np.angle(np.exp(1j * difference))
        assert np.all(np.abs(difference) < 0.01 * ticks[f"sigma_{name}"][1:]), name


def test_filterpy_runs_in_the_classroom(classroom):
    filterpy_ekf = pytest.importorskip("filterpy_ekf")
    row = classroom.run(0, estimator=filterpy_ekf.FilterpyEkf).row
    assert row["estimator"].tolist() == ["sonarfix", "FilterpyEkf"]
    assert np.all(row["worst_position_error_m"] < 0.1)
    assert np.all(row["nees"] > 0.0)


@pytest.mark.parametrize("name", ["paper", "classroom"])
def test_a_guest_changes_no_bit(name):
    scenario = sf.Scenario(name)
    with_guest = scenario.monte_carlo(3, 7, estimator=DeadReckoning)
    alone = scenario.monte_carlo(3, 7)
    ours = with_guest["estimator"] == "sonarfix"
    assert ours.tolist() == [True, False] * 3
    for column in alone.columns:
        assert with_guest[column][ours].tobytes() == alone[column].tobytes(), column


def test_dead_reckoning_is_that_of_the_trace(paper):
    run = paper.run(0, estimator=DeadReckoning)
    ticks = run.ticks
    assert np.allclose(run.estimator_poses[:, 0], ticks["odometry_x_m"][1:], atol=1e-3)  # travel is f32
    theirs = run.row.to_numpy()[1]
    assert np.isnan(theirs["error_track_width_m"])
    assert theirs["fixes_gated"] == len(run.fixes)
    assert theirs["bound_variance_x_m2"] == run.row.to_numpy()[0]["bound_variance_x_m2"]


def test_an_estimator_may_lead_the_sonar(paper):
    class Leading(DeadReckoning):
        def aim(self):
            return 1.0

    fixes = paper.run(0, estimator=Leading).fixes
    assert np.all(np.abs(fixes["fix_bearing_rad"] - 1.0) < 1e-6)


def test_a_policy_chooses_walls_by_number_name_or_bearing(paper):
    policies = {
        "number": lambda view: 0,
        "name": lambda view: "outer east",
        "bearing": lambda view: view.choice.bearing,
        "none": lambda view: None,
    }
    rows = {name: paper.run(0, policy=policy).row.to_numpy()[0] for name, policy in policies.items()}
    assert rows["number"] == rows["name"]
    assert rows["bearing"] == rows["none"] == paper.run(0).row.to_numpy()[0]
    assert rows["name"] != rows["none"]


def test_a_policy_sees_the_estimate(paper):
    seen = []

    def policy(view):
        seen.append((view.time, view.pose.shape, view.covariance.shape, view.walls.shape))

    paper.run(0, policy=policy)
    assert len(seen) == 1248
    assert seen[-1] == (1248.0, (3,), (7, 7), (8, 2, 2))


def test_a_policy_in_a_monte_carlo(paper):
    table = paper.monte_carlo(2, policy=lambda view: None)
    assert table["estimator"].tolist() == ["sonarfix", "sonarfix"]
    assert sf.summary(table)["runs"] == 2


def test_a_policy_needs_the_ideal_fidelity(classroom):
    with pytest.raises(sf.InputError, match="ideal"):
        classroom.run(0, policy=lambda view: None)


@pytest.mark.parametrize("method", ["__init__", "odometry", "fix", "pose"])
def test_an_error_of_an_estimator_is_raised(paper, method):
    def fail(self, *_):
        raise KeyError(method)

    failing = type("Failing", (DeadReckoning,), {method: fail})
    with pytest.raises(KeyError, match=method):
        paper.run(0, estimator=failing)


def test_the_overhead_is_small(paper):
    """Measured, and far from the limit of 3 s even on a busy machine."""

    class Idle(DeadReckoning):
        def odometry(self, t, right, left):
            pass

    start = time.perf_counter()
    paper.run(0)
    alone = time.perf_counter() - start
    start = time.perf_counter()
    paper.run(0, estimator=Idle)
    overhead = time.perf_counter() - start - alone
    print(f"overhead of a Python estimator in the paper's run: {overhead:.3f} s")
    assert overhead < 3.0
