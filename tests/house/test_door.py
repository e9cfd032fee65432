"""The door: every name leads somewhere, every effect stands in it, and the stubs say what the declarations say."""

import doctest
import inspect
import pydoc
import re
import sys
from importlib import import_module
from pathlib import Path

import pytest

import bicycle
import studies.velotyre as vt
from bicycle.effects import registry
from studies.door import FOLDER, stubs


def test_every_name_is_that_of_its_home():
    for name, home in vt.HOME.items():
        found = getattr(vt, name)
        assert found.__name__ == name
        assert home.split(".")[0] in ("tyre", "bicycle", "studies")
        assert name in dir(vt)


def test_every_effect_stands_in_the_door_by_the_name_of_its_class():
    for effect in registry().values():
        assert getattr(vt, effect.__name__) is effect
        assert getattr(vt.effects, effect.__name__) is effect
        assert effect.__name__ in dir(vt)


def test_a_name_that_is_not_there():
    with pytest.raises(AttributeError, match="there are AerodynamicDrag, .*RelaxationLength"):
        _ = vt.RelaxatonLength
    with pytest.raises(AttributeError, match="has no attribute 'critical_speed'"):
        _ = vt.critical_speed


@pytest.mark.parametrize("name", sorted(stubs()))
def test_the_stubs_are_those_of_the_declarations(name):
    assert (FOLDER / name).read_text(encoding="utf-8") == stubs()[name], (
        "an effect or the door has changed: write the stubs again with  python -m studies.door.door_stubs"
    )


def test_the_docstring_runs():
    sys.modules.setdefault("velotyre", vt)  # its name once installed
    found = doctest.DocTestFinder().find(vt, "velotyre", globs={})
    results = [doctest.DocTestRunner(verbose=False).run(test) for test in found if test.examples]
    assert results
    assert all(result.failed == 0 for result in results)


def test_help_shows_parameters_with_unit_and_range():
    page = pydoc.render_doc(vt.RelaxationLength, renderer=pydoc.plaintext)
    assert "RelaxationLength(*, cornering_stiffness:" in page
    assert "cornering_stiffness : float or {rear, front}, N/rad" in page
    assert "typical 2000 .. 12000, allowed 0 .. inf" in page
    assert list(inspect.signature(vt.FrontCompliance).parameters) == [
        "joint_x", "joint_z", "stiffness", "damping", "axis_tilt",
    ]  # fmt: skip


def test_the_door_of_the_bicycle_gives_what_is_computed_from_a_model():
    """Every name leads home, and the types of the stub are of the same things."""
    for name, home in bicycle.LATER.items():
        assert getattr(bicycle, name) is getattr(import_module(home), name)
    stub = (Path(bicycle.__file__).with_suffix(".pyi")).read_text(encoding="utf-8")
    homes = {name: home for home, name in re.findall(r"^from ([\w.]+) import \w+ as (\w+)$", stub, re.MULTILINE)}
    assert sorted(homes) == bicycle.__all__
    for name, home in homes.items():
        assert getattr(bicycle, name) is getattr(import_module(home), name)
        assert name in dir(bicycle)
    with pytest.raises(AttributeError, match="module 'bicycle' has no attribute 'mods'"):
        _ = bicycle.mods
