"""Maps, forecasts and recordings."""

import json

import numpy as np
import pytest
from conftest import SCENARIOS

import sonarfix as sf


def room(rows=61, columns=81):
    grid = np.zeros((rows, columns))
    grid[[0, -1], :] = 1.0
    grid[:, [0, -1]] = 1.0
    return grid


def test_walls_of_an_occupancy_grid():
    found, notes = sf.Map.from_occupancy_grid(room(), 0.05, (1.0, 2.0, 0.0))
    assert len(found) == 4
    assert np.allclose(found.walls.min(axis=(0, 1)), [1.025, 2.025], atol=0.05)
    assert np.allclose(found.walls.max(axis=(0, 1)), [5.025, 5.025], atol=0.05)
    assert any("a pixel is 0.05 m" in note for note in notes)


def test_a_map_is_written_and_read(tmp_path, classroom):
    file = tmp_path / "map.toml"
    file.write_text(classroom.map.to_toml(), encoding="utf-8")
    again = sf.Map.load(file)
    assert again.names == classroom.map.names
    assert again.walls.tobytes() == classroom.map.walls.tobytes()
    baked = tmp_path / "map.bin"
    baked.write_bytes(bytes(again.bake()))
    assert np.allclose(sf.Map.load(baked).walls, again.walls, atol=1e-5)


def test_findings_of_a_map():
    twice = sf.Map([[[0, 0], [4, 0]], [[0, 0], [4, 0]], [[4, 0], [4, 3]]])
    found = twice.check()
    assert "error" in found["severity"].tolist()
    assert found["wall"].tolist()[0] == "wall 2"
    assert len(twice.simplify(0.01)) == 2


def test_mistakes_of_a_file_have_line_and_key(tmp_path):
    file = tmp_path / "map.toml"
    file.write_text('format = 1\n[map]\nunit = "m"\nwall = [{ name = "a", from = [0, 0] }]\n')
    with pytest.raises(sf.FileError) as caught:
        sf.Map.load(file)
    (mistake,) = caught.value.mistakes
    assert (mistake.line, mistake.key) == (4, "map.wall[0].to")
    assert str(caught.value) == f"{mistake.file}:4: {mistake.key}: {mistake.message}"


def test_a_scenario_from_a_dict(paper):
    tomllib = pytest.importorskip("tomllib")
    table = tomllib.loads((SCENARIOS / "paper.toml").read_text(encoding="utf-8"))
    assert sf.Scenario(table).run(0).row.to_numpy() == paper.run(0).row.to_numpy()


def test_the_forecast_is_that_of_the_command(command, classroom, tmp_path):
    code, out, error = command("plan", SCENARIOS / "classroom.toml", "--runs", 2, "--json")
    assert code == 0, error
    (expected,) = json.loads(out)
    planned = sf.plan(classroom, 2)
    assert planned.summary == {key: expected[key] for key in planned.summary}
    assert len(planned.samples) > 1_000


def test_a_plan_on_a_map_alone(classroom):
    scenario = sf.Scenario.on_map(classroom.map, [(1.2, 0.7), (3.0, 0.7)])
    assert sf.plan(scenario, 1, starts=2).starts["starts"] == 2


def test_the_bound_is_that_of_the_trace(paper):
    bound, ticks = sf.bound(paper, 3), paper.run(3).ticks
    assert bound["x_m"].tobytes() == ticks["bound_x_m"][1:].tobytes()


def test_the_replay_is_that_of_the_command(command, recording):
    code, out, error = command("replay", recording / "log.csv", "--json")
    assert code == 0, error
    replayed, expected = sf.replay(recording / "log.csv"), json.loads(out)
    # Of the values of the files, not of the log.
    assert expected.pop("warnings") == []
    # The command compares the log with its files, too.
    assert expected.pop("diagnosis")["findings"] == []
    assert replayed.summary == expected
    assert replayed.summary["position_rms"] < 0.05
    assert replayed.skipped == []


def test_the_calibration_is_that_of_the_command(command, recording):
    code, out, error = command("calibrate", recording / "log.csv", "--json")
    assert code == 0, error
    found, expected = sf.calibrate(recording / "log.csv"), json.loads(out)
    for ours, theirs in zip(found.estimates, expected["estimates"]):
        assert (ours.name, ours.value, ours.deviation) == (
            theirs["name"],
            theirs["value"],
            theirs["deviation"],
        )
    assert found.robot.track_width != sf.Robot(recording / "robot.toml").track_width
    assert found.trajectory.shape[1] == 4


def test_find_is_that_of_the_command(command, recording):
    code, out, error = command("find", recording / "log.csv", "--json")
    assert code == 0, error
    assert sf.find(recording / "log.csv").summary == json.loads(out)


def test_a_survey(recording, command, tmp_path):
    out = tmp_path / "map.toml"
    code, _, error = command("survey", recording / "log.csv", "--out", out)
    assert code == 0, error
    found = sf.survey(recording / "log.csv")
    assert found.map.walls.tobytes() == sf.Map.load(out).walls.tobytes()
    assert len(found.accuracy) == len(found.echoes) == len(found.map)


def test_recordings_that_are_none(tmp_path, paper):
    log = tmp_path / "log.csv"
    log.write_text("no log\n")
    with pytest.raises(sf.FileError):
        sf.replay(log)
    for work in (sf.replay, sf.calibrate, sf.find):
        with pytest.raises(sf.RecordingError, match=r"log\.csv"):
            work(log, paper.robot, paper.map)
    with pytest.raises(sf.InputError, match="give a map"):
        sf.replay(log, paper.robot)
    with pytest.raises(sf.InputError, match="pins"):
        paper.record(tmp_path / "new.csv")


def test_a_recording_is_not_replaced(recording, classroom):
    with pytest.raises(sf.InputError, match="exists"):
        classroom.record(recording / "log.csv")
