"""What the tests share: the command ``sonarfix``, shipped scenarios, and a recording."""

import os
import subprocess
from pathlib import Path

import pytest

import sonarfix as sf

ROOT = Path(__file__).resolve().parents[2]
SCENARIOS = ROOT / "crates/sonarfix-map/scenarios"


@pytest.fixture(scope="session")
def command():
    """Runs the command that was built from the same sources: SONARFIX_COMMAND, or that of a release build."""
    path = os.environ.get("SONARFIX_COMMAND", ROOT / "target/release/sonarfix")
    if not Path(path).exists():
        pytest.skip("the command is not built: cargo build --release --bin sonarfix")

    def run(*arguments):
        done = subprocess.run([path, *map(str, arguments)], capture_output=True, text=True, check=False)
        return done.returncode, done.stdout, done.stderr

    return run


@pytest.fixture(scope="session")
def paper():
    return sf.Scenario("paper")


@pytest.fixture(scope="session")
def classroom():
    return sf.Scenario("classroom")


@pytest.fixture(scope="session")
def recording(classroom, tmp_path_factory):
    """A folder with the log of a simulated drive."""
    folder = tmp_path_factory.mktemp("drive")
    classroom.record(folder / "log.csv", seed=1)
    return folder
