"""Names, looks and columns follow from what effects declare: no list beside them knows an effect."""

import ast
from pathlib import Path

import numpy as np
import pytest

from bicycle import Mode, Model, effect_class, load_bicycle
from bicycle.effects import FrontCompliance, packaged_effects
from bicycle.stability import critical_speeds, known_modes, mode_look, mode_marker, modes
from studies.motion import line_look

ROOT = Path(__file__).parents[3]
ROOMS_OF_READERS = {
    "equations": ("lateral", "evaluation", "declarations"),
    "model": ("model", "state_space", "eigen"),
    "stability": (
        "naming",
        "named_modes",
        "tracking",
        "critical",
        "sensitivity",
        "propagation",
        "mode_figure",
    ),
    "motion": ("responses", "nonlinear"),
}
READERS = [
    *(ROOT / "bicycle" / room / f"{name}.py" for room, names in ROOMS_OF_READERS.items() for name in names),
    *(ROOT / "studies" / "sweep").glob("*.py"),
    ROOT / "studies" / "motion" / "locus.py",
]
PARAMETERS = {"relaxation_length", "crown_radius"}  # names of parameters that effects are called after
DEFAULT = {"no_slip"}  # what a model has that names no contact law


def strings(tree: ast.AST) -> set[str]:
    return {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)}


@pytest.mark.parametrize("file", READERS, ids=lambda path: "/".join(path.parts[-2:]))
def test_no_list_of_effects_stands_elsewhere(file):
    effects = packaged_effects()
    brought = {mode.name for effect in effects.values() for mode in effect.modes}
    said = strings(ast.parse(file.read_text(encoding="utf-8")))
    assert not said & ((set(effects) | brought) - PARAMETERS - DEFAULT)


class Fork(FrontCompliance):
    """The same hinge under another identifier, with a mode of its own."""

    identifier = "fork"
    modes = (Mode("fork", marks=("front_compliance", "front")),)


class Twin(FrontCompliance):
    """The same hinge and mode under another identifier."""

    identifier = "twin"


@pytest.mark.parametrize(("kind", "name"), [(Fork, "fork"), (Twin, "front_compliance")])
def test_a_copy_of_an_effect_has_its_modes_by_name(kind, name):
    bicycle = load_bicycle("benchmark")
    tyre = effect_class("relaxation_length")(cornering_stiffness=6000.0, relaxation_length=0.1)
    hinge = {"joint_x": 0.9, "joint_z": -0.8}
    first, other = (Model(bicycle, (tyre, effect(**hinge))) for effect in (FrontCompliance, kind))
    speeds = np.linspace(1.0, 20.0, 7)
    mine, own = modes(other, speeds), modes(first, speeds)
    renamed = {mode.replace(name, "front_compliance"): values for mode, values in mine.branches.items()}
    assert set(renamed) == set(own.branches)
    for mode, values in own.branches.items():
        np.testing.assert_allclose(renamed[mode], values, rtol=1e-9)
    crossings = [(c.mode.replace(name, "front_compliance"), c.direction) for c in critical_speeds(other)]
    assert crossings == [(c.mode, c.direction) for c in critical_speeds(first)]


def test_every_known_mode_has_a_look_of_its_own():
    looks = [mode_look(name) for name in [*known_modes(), "other_1", "other_2", "fork", "pannier", "box"]]
    assert len({(look.colour, look.marker) for look in looks}) == len(looks)
    assert line_look("fork").line == mode_look("fork").line
    assert mode_marker("fork+weave")["markeredgecolor"] == mode_look("fork").colour


def test_the_order_of_tables_is_declared():
    first = ["weave", "wobble", "capsize", "castering", "rear_tyre", "front_compliance", "rider"]
    first += ["rider_yaw", "rider_roll"]
    assert list(known_modes()) == [*first, "arms", "fork_bending", "muscles", "rear_compliance"]
