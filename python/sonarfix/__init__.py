"""Localization of a small robot with two wheel encoders and an ultrasonic ranger: simulator, localizer and data.

>>> import sonarfix as sf
>>> run = sf.Scenario("paper").run(seed=0)

All lengths are metres, angles radians counter-clockwise, times seconds; poses are in the frame of the map.
"""

from ._sonarfix import (
    Aim,
    Fix,
    Localizer,
    Map,
    Navigator,
    Robot,
    Run,
    Scenario,
    Search,
    Setup,
    Table,
    View,
    bound,
    summary,
)
from .errors import (
    ConnectionFailed,
    FileError,
    InputError,
    RecordingError,
    SimulationError,
    SonarfixError,
)
from .live import Message, Monitor, monitor
from .offline import (
    Calibration,
    Estimate,
    Found,
    Plan,
    Replay,
    Survey,
    calibrate,
    find,
    plan,
    replay,
    survey,
)

__all__ = [
    "Aim",
    "Calibration",
    "ConnectionFailed",
    "Estimate",
    "FileError",
    "Fix",
    "Found",
    "InputError",
    "Localizer",
    "Map",
    "Message",
    "Monitor",
    "Navigator",
    "Plan",
    "RecordingError",
    "Replay",
    "Robot",
    "Run",
    "Scenario",
    "Search",
    "Setup",
    "SimulationError",
    "SonarfixError",
    "Survey",
    "Table",
    "View",
    "bound",
    "calibrate",
    "find",
    "monitor",
    "plan",
    "replay",
    "summary",
    "survey",
]
