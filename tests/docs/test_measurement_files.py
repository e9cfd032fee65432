"""The page on measurement files: its examples are read and diagnosed, and it names what a file may hold."""

import math
import re
import shutil
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from pages import page
from small_library import all_but

from bicycle.identification import CHANNELS, INPUTS
from bicycle.model import DEFAULTS
from bicycle.parameters import UNITS
from bicycle.stability import known_modes
from studies.diagnosis import Kind, diagnose, find, read_measurement, record
from studies.inference import fit
from tyre.measured import Calibration

PAGE = page("measurement_files")
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples" / "measurements"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return Path(shutil.copytree(EXAMPLES, tmp_path_factory.mktemp("page") / "measurements"))


def test_every_kind_has_an_example_that_is_read(folder):
    assert {path.name for path in folder.iterdir()} == set(Kind.top)
    for name in Kind.top:
        kind = read_measurement(folder / name / "MEASUREMENT.toml").prepare()
        residual, _ = kind.residual((), np.array([u.centre for u in kind.nuisances]))
        assert 0 < residual @ residual < math.inf


def test_standing_and_modes_are_one_measurement(folder):
    """Made outside velotyre with 3500 N m/rad and 7 N m s/rad."""
    joint = read_measurement(folder / "standing" / "with_modes.toml").prepare()
    (front,) = (c for c in joint.candidates if c.identifier == "front_compliance")
    found = joint.corrected_model(fit(joint, (front,))).parameters
    assert found["front_compliance.stiffness"] == pytest.approx(3500.0, rel=0.015)
    assert found["front_compliance.damping"] == pytest.approx(7.0, rel=0.03)


def test_the_example_of_modes_is_diagnosed(folder, monkeypatch):
    """The weave of a benchmark bicycle with a damper of 2 N m s/rad (made outside velotyre)."""
    monkeypatch.chdir(folder / "modal")
    namespace = {}
    exec(re.search(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)[1], namespace)
    found = namespace["found"].verdict
    assert (found.verdict, set(found.equivalent)) == ("named", {"steer_damper"})
    damping, sd = found.effects[0].parameters["damping"]
    assert damping == pytest.approx(2.0, abs=3 * sd)


def test_the_examples_of_tyres_are_diagnosed_and_every_key_of_a_verdict_is_on_the_page(folder):
    """A rim of 300 N/mm and a drum's curvature (made outside velotyre)."""
    whole = diagnose(read_measurement(folder / "rig" / "MEASUREMENT.toml"))
    assert whole.verdict.verdict == "named"
    compliance, sd = whole.verdict.effects[0].parameters["compliance"]
    assert compliance == pytest.approx(1 / 300e3, abs=3 * sd)
    drum = diagnose(read_measurement(folder / "tyre_tables" / "MEASUREMENT.toml")).verdict
    assert drum.verdict == "named"
    exponent, sd = drum.effects[0].parameters["exponent"]
    assert exponent == pytest.approx(0.5, abs=3 * sd)
    assert [key for key in record(whole, find(whole)) if f"`{key}`" not in PAGE] == []


def test_the_bench_test_separates_what_the_modes_cannot(folder):
    """A spring of 3 N m/rad and dry friction of 0.3 N m at the published benchmark bicycle (made outside velotyre)."""
    text = (folder / "bench" / "with_modes.toml").read_text(encoding="utf-8").split("[[part]]")[0]
    (folder / "bench" / "modes.toml").write_text(text.replace("joint", "modal") + '[modal]\ntable = "weave.csv"\n')
    modes = diagnose(read_measurement(folder / "bench" / "modes.toml")).verdict
    assert modes.verdict == "class"
    assert set(modes.equivalent) == {"pneumatic_trail", "steer_spring", "crown_radius", "wrong_trail"}
    joint = read_measurement(folder / "bench" / "with_modes.toml")
    both = diagnose(joint, without=all_but(joint, {*modes.equivalent, "steer_friction", "steer_damper"})).verdict
    assert both.verdict == "named"
    sizes = {e.identifier: next(iter(e.parameters.values())) for e in both.effects}
    assert set(sizes) == {"steer_spring", "steer_friction"}
    for name, truth in (("steer_spring", 3.0), ("steer_friction", 0.3)):
        assert sizes[name][0] == pytest.approx(truth, abs=3 * sizes[name][1])


def test_the_example_of_frequency_responses_is_diagnosed(folder):
    """A damper of 1 N m s/rad at the published benchmark bicycle (made outside velotyre)."""
    measurement = read_measurement(folder / "frequency_response" / "MEASUREMENT.toml")
    few = ("steer_damper", "steer_spring", "pneumatic_trail", "steer_torque_scale")
    found = diagnose(measurement, without=all_but(measurement, few)).verdict
    assert found.equivalent[0] == "steer_damper"
    damping, sd = found.effects[0].parameters["damping"]
    assert damping == pytest.approx(1.0, abs=3 * sd)


def test_every_kind_channel_mode_and_parameter_stands_on_the_page():
    names = {*Kind.top, *(kind.table for kind in (*Kind.top.values(), *Kind.part.values()) if kind.table != "joint")}
    names |= {*UNITS, *known_modes(), *CHANNELS, *INPUTS, *(f.name for f in fields(Calibration))}
    spans = " ".join(re.findall(r"`([^`\n]+)`", re.sub(r"^```.*?^```", "", PAGE, flags=re.MULTILINE | re.DOTALL)))
    assert [name for name in sorted(names) if not re.search(rf"(?<!\w){re.escape(name)}(?!\w)", spans)] == []


def test_the_default_standard_deviations_are_those_of_the_page():
    rows = re.findall(r"^\| (`.+) \| ([\d.]+)(?: (m|rad|%))?(.*?) \| ", PAGE.split("1 sd")[1], flags=re.MULTILINE)
    shown = {key: (float(size) / (100 if unit == "%" else 1), unit == "%", rest)
             for keys, size, unit, rest in rows for key in re.findall(r"`(\w+)`", keys)}  # fmt: skip
    for key, (default, of, _) in DEFAULTS.items():
        size, relative, rest = shown[key]
        assert size == pytest.approx(default), key
        assert relative == (of != "SI unit"), key
        assert ("geometric mean" in rest) == (of == "xx and zz"), key
