"""The page on measurement files: its examples are read and diagnosed, and it names every key, column and limit."""

import math
import re
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from small_library import all_but

from bicycle import default_sd
from bicycle.identification import free_decay, histories_table, recording, repeats, window_start
from bicycle.modal.known_modes import known_modes
from bicycle.parameters import UNITS
from studies.missing_effect import diagnose, measurement, read_measurement
from studies.missing_effect.bench import table as bench_table
from studies.missing_effect.forced import noise
from studies.missing_effect.forced import table as frequency_table
from studies.missing_effect.motion import canonical_table, modal_table
from studies.missing_effect.report import SAYS, record
from studies.missing_effect.reporting.findings import find
from studies.missing_effect.rig import measurement as rig_measurement
from studies.missing_effect.rig import reference, reference_file, tables_forward
from tyre.estimate import Calibration

PAGE = (Path(__file__).parents[2] / "docs" / "measurement_files.md").read_text(encoding="utf-8")
BLOCK = re.compile(r"^```\{code-block\} \w+\n:caption: (\S+)\n(.*?)^```", flags=re.MULTILINE | re.DOTALL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    root = tmp_path_factory.mktemp("page")
    for name, text in BLOCK.findall(PAGE):
        (root / name).parent.mkdir(exist_ok=True)
        (root / name).write_text(text, encoding="utf-8")
    return root


def test_every_kind_has_an_example_that_is_read(folder):
    assert {path.name for path in folder.iterdir()} == set(measurement.EVERY_KIND)
    for kind in measurement.KINDS:
        forward = read_measurement(folder / kind / "MEASUREMENT.toml").forward()
        residual, _ = forward.residual((), np.array([u.centre for u in forward.nuisances]))
        assert 0 < residual @ residual < math.inf


def test_the_examples_of_modes_and_of_a_pull_are_diagnosed_as_in_the_text(folder, monkeypatch):
    """The weave of a benchmark bicycle with a damper of 2 N m s/rad; a rim of 300 N/mm (both made outside velotyre)."""
    monkeypatch.chdir(folder / "modal")
    namespace = {}
    exec(re.search(r"^```python\n(.*?)^```", PAGE, flags=re.MULTILINE | re.DOTALL)[1], namespace)
    found = namespace["found"].verdict
    assert (found.verdict, set(found.equivalent)) == ("named", {"steer_damper"})
    damping, sd = found.effects[0].parameters["damping"]
    assert damping == pytest.approx(2.0, abs=3 * sd)
    whole = diagnose(read_measurement(folder / "rig" / "MEASUREMENT.toml"))
    pull = whole.verdict
    assert pull.verdict == "named"
    compliance, sd = pull.effects[0].parameters["compliance"]
    assert compliance == pytest.approx(1 / 300e3, abs=3 * sd)
    drum = diagnose(read_measurement(folder / "tyre_tables" / "MEASUREMENT.toml")).verdict
    assert drum.verdict == "named"
    exponent, sd = drum.effects[0].parameters["exponent"]
    assert exponent == pytest.approx(0.5, abs=3 * sd)
    for key in record(whole, find(whole)):
        assert f"| `{key}` |" in PAGE


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


def test_the_example_of_frequency_responses_is_diagnosed_as_in_the_text(folder):
    """A damper of 1 N m s/rad at the published benchmark bicycle (made outside velotyre)."""
    measurement = read_measurement(folder / "frequency_response" / "MEASUREMENT.toml")
    few = ("steer_damper", "steer_spring", "pneumatic_trail", "steer_torque_scale")
    found = diagnose(measurement, without=all_but(measurement, few)).verdict
    assert found.equivalent[0] == "steer_damper"
    damping, sd = found.effects[0].parameters["damping"]
    assert damping == pytest.approx(1.0, abs=3 * sd)


def test_every_name_stands_on_the_page():
    names = {
        *measurement.TOP_KEYS, *measurement.EVERY_KIND, *tables_forward.KEYS,
        *UNITS, *known_modes(), *modal_table.NUMBERS, *recording.CHANNELS, *recording.INPUTS,
        *frequency_table.NUMBERS, *frequency_table.INPUTS, *frequency_table.OUTPUTS,
        *frequency_table.TEXTS, *frequency_table.TABLE.keys, *noise.NOISE, *bench_table.TESTS, *bench_table.CONDITIONS,
        *bench_table.TEXTS, *(f"{name}_..." for name in bench_table.QUANTITIES), "contact_scrub",
        *histories_table.RUN.keys, *canonical_table.COEFFICIENTS, *canonical_table.UNITS.values(), *SAYS,
        *rig_measurement.KEYS, *reference_file.SOURCES, *reference_file.CONDITION_KEYS,
        *(f.name for f in fields(Calibration)),
        "rider", "environment", "coefficient", "unit", "value", "sd", "difference_percent", "speeds_m_s", "band_hz",
        "drop_first_s", "first_s", "last_s", "files", "noise_sd", "time_s", "group", "mode",
    }  # fmt: skip
    text = re.sub(r"^```.*?^```", "", PAGE, flags=re.MULTILINE | re.DOTALL)
    spans = " ".join(re.findall(r"`([^`\n]+)`", text))
    assert [name for name in sorted(names) if not re.search(rf"(?<!\w){re.escape(name)}(?!\w)", spans)] == []


def test_limits_and_defaults_are_those_of_the_page():
    h, m = recording, modal_table
    assert (h.FASTEST, m.FASTEST, canonical_table.FASTEST, canonical_table.HIGHEST) == (60, 60, 60, 50)
    assert (m.FASTEST_ROOT, m.SMALLEST_SD, m.LARGEST_RATIO) == (200, 1e-5, 1e5)
    assert (m.DEFAULT_SD, m.DEFAULT_RATIO_SD, m.FEWEST_REPEATS) == (0.03, 0.05, 5)
    assert (repeats.SAME_SPEED, repeats.REFUTED) == (0.05, 0.05)
    assert (h.LONGEST_STEP, h.FEWEST) == (0.4, 20)
    assert [most for most, _ in h.LARGEST.values()] == [1.6, 1.6, 20, 50, 20, 1e3, 1e4]
    assert (free_decay.MOST_DOUBT, free_decay.POOREST, free_decay.MOST_MODES) == (0.3, 0.8, 3)
    assert (window_start.TOO_FAR, window_start.REACH) == (3, 0.25)
    stated = {key: (row.size, row.of) for row in default_sd.DEFAULTS for key in row.keys}
    rows = re.findall(r"^\| (`.+) \| ([\d.]+)(?: (m|rad|%))?(.*?) \| ", PAGE.split("1 sd")[1], flags=re.MULTILINE)
    shown = {key: (float(size) / (100 if unit == "%" else 1), "%" if unit == "%" else "", rest)
             for keys, size, unit, rest in rows for key in re.findall(r"`(\w+)`", keys)}  # fmt: skip
    for key, (size, of) in stated.items():
        assert shown[key][0] == pytest.approx(size), key
        assert (shown[key][1] == "%") == (of != "SI unit"), key
        assert ("geometric mean" in shown[key][2]) == (of == "xx and zz"), key
    assert (default_sd.EFFECT, default_sd.CORNERING_STIFFNESS) == (0.1, 0.03)
    assert [most for most, _ in default_sd.MOST.values()] == [0.5, 0.3, 100, 100, 1]
    assert (canonical_table.SPEEDS, canonical_table.BAND, canonical_table.FEWEST) == ((2, 3, 4, 5, 6, 7), (0.3, 3), 4)
    assert [f.default for f in fields(Calibration)] == [0.003, 0.003, 0.002, 0.01]
    assert [(least, kind) for _, least, kind in reference_file.LEAST] == [(1, "N/deg"), (10, "N/mm")]
    assert (reference_file.UNSTATED, reference.LENGTH_SD, reference.PEAK, reference.SHAPE, reference.CURVATURE) == (
        0.02, 0.1, 1.05, 1.4, 0,
    )  # fmt: skip
    assert rig_measurement.WHEEL_RADIUS == 0.34
    assert (frequency_table.FASTEST, frequency_table.HIGHEST, frequency_table.FEWEST) == (60, 100, 3)
    assert (noise.FEWEST_AVERAGES, bench_table.FEWEST, bench_table.LINEAR_UP_TO) == (4, 3, 0.35)
    assert [most for most, _ in bench_table.LARGEST.values()] == [50, 1e3, 2, 1e4]
