"""Numbers in other units than SI: what is warned about, what is refused, and what passes without a word."""

import math
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle import Bicycle, Model, available_bicycles, effect_class, load_bicycle
from bicycle.effects import registry
from bicycle.files import to_toml, to_yaml
from bicycle.model import build_model, read_model
from bicycle.parameters import TYPICAL, UNITS, doubts_about
from studies.cli import main
from studies.motion import parameter_path
from studies.sweep import build_sweep
from tests.shared.refusals import refuses
from tyre import TyreMap
from tyre.ground import InputError
from tyre.measured import ABSURD, SLIPS, doubt, suspicion

BENCHMARK = dict(load_bicycle("benchmark").values)
TYRE = {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}
PARAMETERS = [(f"{e.identifier}.{p.name}", p) for e in registry().values() for p in e.parameters]
REMEDY = (
    r"; give it in SI units, (write its unit behind .* \(TOML, YAML\), )?"
    r"or write allow_unusual = true at the top of the (model|bicycle) file if it is meant so"
)


def content(key, value):
    """A model file with a value of a bicycle parameter, or of an effect's (``effect.parameter``)."""
    effect, _, name = key.rpartition(".")
    if not effect:
        return {"bicycle": BENCHMARK | {key: value}, "effects": {"relaxation_length": TYRE}}
    whole = {"relaxation_length": TYRE, "front_compliance": {"joint_x": 0.8, "joint_z": -0.8}}.get(effect, {})
    return {"bicycle": BENCHMARK, "effects": {effect: whole | {name: value}}}


LENGTH = "relaxation_length.relaxation_length"


@pytest.mark.parametrize(("key", "value", "words"), [
    (LENGTH, 100.0, f"{LENGTH} = 100 m is far outside the usual 0.05 .. 0.25 m (millimetres?)"),
    ("c", 80.0, "c = 80 m is far outside the usual -0.05 .. 0.2 m (millimetres?)"),
    ("c", 8.0, "c = 8 m is far outside the usual -0.05 .. 0.2 m (centimetres?)"),
    ("rR", 300.0, "rR = 300 m is far outside the usual 0.12 .. 0.48 m (millimetres?)"),
    ("g", 981.0, "g = 981 m/s^2 is far outside the usual 9.76 .. 9.84 m/s^2 (cm/s^2?)"),
    ("IBxx", 9.2e4, "IBxx = 92000 kg m^2 is far outside the usual 0.03 .. 40 kg m^2 (kg cm^2?)"),
    (LENGTH, {"rear": 0.1, "front": 1e-4}, f"{LENGTH}.front = 0.0001 m is far outside the usual 0.05 .. 0.25 m"),
])  # fmt: skip
def test_absurd_values_of_a_file_are_refused_with_the_remedy_and_pass_where_they_are_meant(key, value, words):
    absurd = content(key, value)
    refuses(re.escape(words) + REMEDY, build_model, absurd)
    refuses("allow_unusual = 1 must be true or false", build_model, absurd | {"allow_unusual": 1})
    meant = build_model(absurd | {"allow_unusual": True}).linear_model()
    assert not [text for text in meant.warnings if "the usual" in text]


@pytest.mark.parametrize(("key", "value", "usual"), [
    ("relaxation_length.cornering_stiffness", 110.0, "2000 .. 12000 N/rad (N/deg?)"),
    (LENGTH, {"rear": 0.6, "front": 0.1}, "0.05 .. 0.25 m"),
    ("mB", 4480.0, "2 .. 300 kg (grams?)"),
    ("g", 32.2, "9.76 .. 9.84 m/s^2 (ft/s^2?)"),
    ("g", 1.62, "9.76 .. 9.84 m/s^2"),
    ("lam", 0.8, "0 .. 0.6 rad (degrees?)"),
    ("lam", 1.2, "0 .. 0.6 rad (head angle? lam is the tilt from the vertical, 21.2 deg then)"),
    ("w", 40.0, "0.6 .. 2.2 m (inches?)"),
    ("c", -0.08, "-0.05 .. 0.2 m (wrong sign?)"),
    ("steer_assist.fade_speed", 18.0, "3 .. 8 m/s (km/h?)"),
    ("front_compliance.joint_z", 0.85, "-1 .. -0.55 m (wrong sign?)"),
])  # fmt: skip
def test_doubtful_values_are_one_warning_that_travels_with_the_model(key, value, usual):
    doubtful = content(key, value)
    if "." not in key:
        doubtful["effects"] = {}
    model = build_model(doubtful)
    (words,) = model.linear_model().warnings
    said = f"{key}.rear = 0.6" if isinstance(value, dict) else f"{key} = {value:g}"
    assert re.fullmatch(rf"{re.escape(said)} \S+ is outside the usual {re.escape(usual)}", words)
    assert (words in model.bicycle.warnings) == ("." not in key)


@pytest.mark.parametrize(("bicycle", "effect", "words"), [
    ({}, {"pneumatic_trail": {"trail": 17.0}}, r"trail.rear = 17 m is outside 0 .. 0.2 m \(millimetres\?\)"),
    ({}, {"steer_damper": {"damping": -1.0}}, r"-1 N m s/rad is outside 0 .. inf N m s/rad \(wrong sign\?\)"),
    ({"xB": 30.0}, {}, r"the static load of the rear wheel .*; xB = 30 m is outside .* \(centimetres\?\)"),
    ({"lam": 18.0}, {}, r"lam = 18 rad is out of range.*degrees must be converted to radians\); write its unit "
     r"behind the number \(lam = 18.3 deg; TOML: in quotes\) or in a table units \(TOML, YAML\)$"),
])  # fmt: skip
def test_what_is_refused_for_other_reasons_names_the_slip(bicycle, effect, words):
    refuses(words, build_model, {"bicycle": BENCHMARK | bicycle, "effects": {"relaxation_length": TYRE} | effect})


def test_limits_can_be_studied_in_python():
    stiff = effect_class("relaxation_length")(cornering_stiffness=1e9, relaxation_length=1e-6)
    fast = Bicycle("fast", BENCHMARK | {"g": 981.0})
    warnings = Model(fast, (stiff,)).linear_model().warnings
    assert [text.split(" = ")[0] for text in warnings] == [
        "g", "relaxation_length.cornering_stiffness", "relaxation_length.relaxation_length",
    ]  # fmt: skip


def test_packaged_bicycles_on_packaged_tyres_are_not_doubted():
    """An empty bicycle's tyre is far softer than a typical one; nobody typed that number."""
    softest = math.inf
    assert doubts_about(BENCHMARK | {"mR": 8.6}) == []  # a hub motor of 7 kg in rim and tyre
    for bicycle in available_bicycles():
        assert doubts_about(load_bicycle(bicycle).values) == []
        for tyre, pressure in (("Tyre1", 3.5), ("Tyre2", 7.5), ("Tyre3", 5.5)):
            law = {"tyre": tyre, "pressure_bar": pressure, "extrapolate": True}
            model = build_model({"bicycle": bicycle, "effects": {"relaxation_length": law}})
            softest = min(softest, model.parameters["relaxation_length.cornering_stiffness.front"])
            assert not [text for text in model.linear_model().warnings if "usual" in text]
    assert softest < 2000


def test_a_tyre_table_in_other_units_is_doubted(tmp_path):
    TyreMap.load("Tyre3").to_file(tmp_path / "own.csv")
    head, *rows = (tmp_path / "own.csv").read_text().splitlines()
    at = head.split(",").index("cornering_stiffness_N_per_deg")

    def read(factor):
        cells = [row.split(",") for row in rows]
        scaled = [",".join([*c[:at], repr(float(c[at]) * factor), *c[at + 1 :]]) for c in cells]
        (tmp_path / "own.csv").write_text("\n".join([head, *scaled, ""]))
        law = {"tyre": str(tmp_path / "own.csv"), "pressure_bar": 5.5}
        return build_model({"bicycle": "benchmark", "effects": {"side_slip": law}}).linear_model().warnings

    assert not [text for text in read(1.0) if "usual" in text]
    every = [text for text in read(25.0) if "usual" in text]
    assert any("cornering stiffness over load at 340 N" in text for text in every)  # of the table itself
    found = [text for text in every if "side_slip" in text]
    assert len(found) == 2  # each wheel has its own load and stiffness
    assert all("N/rad (converted from degrees twice?)" in text for text in found)
    refuses(r"stiffness.rear = .* N/rad is far .*\(converted from degrees twice", read, 180 / math.pi)


@settings(max_examples=30)
@given(
    name=st.sampled_from(available_bicycles()), length=st.sampled_from((1, 100, 1000)), mass=st.sampled_from((1, 1000)),
    angle=st.sampled_from((1, 180 / math.pi)), yaml=st.booleans(),
)  # fmt: skip
def test_a_packaged_bicycle_written_in_other_units_never_passes_silently(
    tmp_path_factory, name, length, mass, angle, yaml
):
    factor = {"m": length, "kg": mass, "rad": angle, "m/s^2": length, "kg m^2": mass * length**2}
    values = {key: load_bicycle(name)[key] * factor[unit] for key, unit in UNITS.items()}
    file = tmp_path_factory.mktemp("units") / ("b.yaml" if yaml else "b.toml")
    lines = [f"{key}{': ' if yaml else ' = '}{value!r}" for key, value in values.items()]
    file.write_text("\n".join(lines if yaml else ["[values]", *lines]))
    try:
        said = " ".join(load_bicycle(file).warnings)
    except InputError as error:
        said = str(error)
    assert ("the usual" in said or "degrees must be converted" in said) == ((length, mass, angle) != (1, 1, 1))


@pytest.mark.parametrize("name", ["b.toml", "b.yaml"])
def test_a_bicycle_file_may_say_that_its_values_are_meant(tmp_path, name):
    giant = Bicycle("giant", BENCHMARK | {"c": 7.0})
    text = to_toml(giant) if name == "b.toml" else to_yaml(giant)
    (tmp_path / name).write_text(text)
    refuses(f"{name}: c = 7 m is far outside .* at the top of the bicycle file", load_bicycle, tmp_path / name)
    (tmp_path / name).write_text(("allow_unusual = true\n" if name == "b.toml" else "allow_unusual: true\n") + text)
    assert (load_bicycle(tmp_path / name)["c"], load_bicycle(tmp_path / name).warnings) == (7.0, ())
    (tmp_path / name).write_text(text)
    (tmp_path / "m.toml").write_text(f'allow_unusual = true\nbicycle = "{name}"\n')
    assert read_model(tmp_path / "m.toml").bicycle["c"] == 7.0
    (tmp_path / "b.toml").write_text("allow_unusual = 3\n" + to_toml(giant))
    refuses("allow_unusual = 3 must be true or false", load_bicycle, tmp_path / "b.toml")


@pytest.mark.parametrize(("varied", "words"), [
    ({"grid": {"c": [0.05, 80.0]}}, r"c = 80 m is far outside .* \(millimetres\?\)"),
    ({"grid": {"mB": [50.0, 85000.0]}}, r"mB = 85000 kg is far outside .* \(grams\?\)"),
    ({"grid": {"relaxation_length": {"relaxation_length": {"rear": {"from": 50, "to": 200, "count": 4}}}}},
     r"relaxation_length.relaxation_length.rear = 50 m is far outside .* \(millimetres\?\)"),
    ({"sampled": {"rR": {"low": 290, "high": 310}}, "samples": 9}, r"rR = 290 m is far outside"),
    ({"sampled": {"g": {"mean": 981, "sd": 1}}, "samples": 9}, r"g = 981 m/s\^2 is far outside .*cm/s\^2"),
])  # fmt: skip
def test_axes_and_distributions_of_sweeps_are_judged(varied, words):
    content = {"model": {"bicycle": "benchmark", "effects": {"relaxation_length": TYRE}}, "outputs": ["parameters"]}
    refuses(words + ".*" + REMEDY, build_sweep, content | varied)
    content["model"] |= {"allow_unusual": True}
    assert build_sweep(content | varied).nominal.linear_model().warnings == ()


def test_the_range_of_a_root_locus_is_judged(tmp_path, capsys):
    text = 'bicycle = "benchmark"\n[effects.relaxation_length]\ncornering_stiffness = 6000.0\nrelaxation_length = 0.1\n'
    (tmp_path / "m.toml").write_text(text)
    key = "relaxation_length.relaxation_length"
    call = ["root-locus", str(tmp_path / "m.toml"), "--speed", "5.5", "--parameter", key, "--out", str(tmp_path)]
    with pytest.raises(SystemExit):
        main([*call, "--range", "50:200:50"])
    assert f"{key} = 50 m is far outside the usual 0.05 .. 0.25 m (millimetres?); give" in capsys.readouterr().err
    (tmp_path / "m.toml").write_text("allow_unusual = true\n" + text)
    model, _ = parameter_path(tmp_path / "m.toml", key, speed=5.5).model_and_speed(50.0)
    assert model.parameters[f"{key}.front"] == 50.0


@pytest.mark.parametrize(("key", "parameter"), PARAMETERS, ids=[key for key, _ in PARAMETERS])
def test_defaults_neutral_values_and_typical_ones_are_never_doubted(key, parameter):
    known = [x for x in (parameter.default, parameter.neutral, *parameter.typical) if isinstance(x, float)]
    for value in (*known, 0.0, math.inf, -math.inf, *np.linspace(*parameter.typical, 7)):
        assert parameter.doubt(key, float(value)) is None


RANGES = [(p.unit, p.typical) for _, p in PARAMETERS] + [(UNITS[key], TYPICAL[key]) for key in UNITS]


@given(st.sampled_from(RANGES), st.floats(1.01, 0.99 * ABSURD), st.floats(1.01 * ABSURD, 1e9))
def test_a_factor_of_thirty_separates_warning_and_refusal(declared, little, much):
    unit, (low, high) = declared
    near_end, far_end = sorted((low, high), key=abs)
    beyond = {far_end * little: False, far_end * much: True, -far_end * much: True}
    if low * high > 0:
        beyond |= {near_end / little: False, near_end / much: True}
    assert {value: doubt("x", value, unit=unit, typical=(low, high)).absurd for value in beyond} == beyond


@pytest.mark.parametrize(("unit", "typical"), sorted(set(RANGES)))
def test_a_value_from_the_middle_of_the_range_in_another_unit_is_recognised(unit, typical):
    product = typical[0] * typical[1]
    middle = math.copysign(math.sqrt(product), typical[1]) if product > 0 else max(typical, key=abs) / 2
    for factor, word in SLIPS.get(unit, ()):
        assert suspicion(middle / factor, unit=unit, typical=typical) == f" ({word}?)"
    if unit.endswith("/rad"):  # 1 N/deg is 180/pi N/rad
        assert suspicion(middle * math.pi / 180, unit=unit, typical=typical) == f" ({unit[:-3]}deg?)"


def test_every_bicycle_parameter_has_a_range_that_holds_every_packaged_bicycle():
    assert set(TYPICAL) == set(UNITS)
    for key, (low, high) in TYPICAL.items():
        found = [load_bicycle(name)[key] for name in available_bicycles()]
        assert low <= min(found), key
        assert max(found) <= high, key
