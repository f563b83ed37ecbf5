"""Every public name has a docstring that begins with one line, names units and shapes, and is in the stubs."""

import inspect
import re
import typing

import pytest

import sonarfix as sf
from sonarfix import distributed, errors, plots

MODULES = [sf, distributed, errors, plots]
# What an argument or a result of these names has: a unit, or a shape.
QUANTITIES = re.compile(r"\b(pose|heading|position|bearing|range|turn|tolerance|resolution)\b")
UNITS = re.compile(r"metres|millimetres|radians|degrees|seconds|\bm\b|\brad\b|\bs\b|m²|shape|0 to 1|None")


def public(module):
    for name, value in vars(module).items():
        home = str(getattr(value, "__module__", ""))
        is_own = home == module.__name__ if module is not sf else home.startswith(("sonarfix", "builtins"))
        if name.startswith("_") or inspect.ismodule(value) or not callable(value) or not is_own:
            continue
        yield f"{module.__name__}.{name}", value
        if inspect.isclass(value):
            for member, of in vars(value).items():
                if not member.startswith("_") and not isinstance(of, (int, str, tuple, dict)):
                    yield f"{module.__name__}.{name}.{member}", getattr(value, member, of)


NAMES = {name: value for module in MODULES for name, value in public(module)}


def is_field(name, value):
    """Fields of data classes and named tuples are documented in the source, after their annotation."""
    owner = NAMES.get(name.rsplit(".", 1)[0])
    return inspect.isclass(owner) and name.rsplit(".", 1)[1] in typing.get_type_hints(owner)


def test_there_are_names():
    assert len(NAMES) > 150
    assert set(sf.__all__) <= {name.rsplit(".", 1)[1] for name in NAMES}


@pytest.mark.parametrize("name", sorted(NAMES))
def test_docstrings(name):
    value = NAMES[name]
    if is_field(name, value):
        return
    text = inspect.getdoc(value)
    assert text, f"{name} has no docstring"
    first = text.split("\n\n")[0].split(". ")[0].split(": ")[0]
    assert first[0].isupper() or first[0] in "`β", name
    assert text.rstrip()[-1] in ".:`)…", name
    member = name.rsplit(".", 1)[1]
    if QUANTITIES.search(member) and not inspect.isclass(value):
        owner = inspect.getdoc(NAMES.get(name.rsplit(".", 1)[0])) or ""
        assert UNITS.search(text + owner), f"{name}: no unit and no shape"


def test_fields_have_docstrings():
    for module in MODULES:
        for name, value in vars(module).items():
            if not inspect.isclass(value) or not value.__module__.startswith("sonarfix."):
                continue
            fields = getattr(value, "__dataclass_fields__", None) or getattr(value, "_fields", None)
            if not fields or value.__module__ == "sonarfix._sonarfix":
                continue
            source = inspect.getsource(value)
            for field in fields:
                pattern = rf'\n    {field}: [^\n]*\n    """[A-Z`"]'
                assert re.search(pattern, source), f"{name}.{field} has no docstring"
