"""Bicycles as other projects write them: notations, units, their extras, and the way back."""

import math

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bicycle import Bicycle, load_bicycle
from bicycle.bicycle_files import WRITERS
from bicycle.model_file import build_model
from bicycle.parameters import UNITS
from tyre.errors import InputError

BENCHMARK = {key: load_bicycle("benchmark").values[key] for key in UNITS}
WORDS = BENCHMARK | {"lam": "18.0(5) deg", "w": "1020 ± 3 mm", "IBxx": "9.2(2)", "c": "0.08 +/- 5 %"}
SD = {"lam": math.radians(0.5), "w": 0.003, "IBxx": 0.2, "c": 0.004}


def write(tmp_path, name, values, head="", tail=""):
    ending = name.rsplit(".")[-1]
    if ending == "toml":
        body = "[values]\n" + "".join(f"{k} = {v!r}\n" for k, v in values.items())
    else:
        body = "".join(f"{k}{':' if ending == 'yaml' else ' ='} {v}\n" for k, v in values.items())
    (tmp_path / name).write_text(head + body + tail, encoding="utf-8")
    return tmp_path / name


@pytest.mark.parametrize("name", ["b.toml", "b.yaml", "b.txt"])
def test_every_notation_in_every_format(tmp_path, name):
    found = load_bicycle(write(tmp_path, name, WORDS))
    assert dict(found.values) == pytest.approx(BENCHMARK | {"lam": math.radians(18)}, rel=1e-15)
    assert dict(found.sd) == pytest.approx(SD, rel=1e-14)


def test_a_model_file_takes_them_too():
    found = build_model({"bicycle": WORDS}).bicycle
    assert dict(found.sd) == pytest.approx(SD, rel=1e-14)
    with pytest.raises(InputError, match=r"bicycle of the model file: w = 'long' is not a finite number"):
        build_model({"bicycle": WORDS | {"w": "long"}})


@pytest.mark.parametrize(("name", "units", "sd"), [
    ("b.toml", "[units]\nlength = 'mm'\nlam = 'deg'\n", "[sd]\nw = 3\nlam = 0.5\n"),
    ("b.yaml", "units:\n  length: mm\n  lam: deg\n", "sd:\n  w: 3\n  lam: 0.5\n"),
])  # fmt: skip
def test_units_of_a_whole_file(tmp_path, name, units, sd):
    values = {key: value * 1000 if UNITS[key] == "m" else value for key, value in BENCHMARK.items()} | {"lam": 18.0}
    found = load_bicycle(write(tmp_path, name, values, head=units, tail=sd))
    assert dict(found.values) == pytest.approx(BENCHMARK | {"lam": math.radians(18)}, rel=1e-15)
    assert dict(found.sd) == pytest.approx({"w": 0.003, "lam": math.radians(0.5)}, rel=1e-14)


NESTED = """description: A commuter
source: measured
parameterization: benchmark
parameters: commuter
values:
{}  v: 5.0
"""


def test_their_nested_form_and_what_of_it_is_not_used(tmp_path):
    (tmp_path / "n.yaml").write_text(NESTED.format("".join(f"  {k}: {v}\n" for k, v in BENCHMARK.items())))
    found = load_bicycle(tmp_path / "n.yaml")
    assert (dict(found.values), found.description, found.source) == (BENCHMARK, "A commuter", "measured")
    assert [note.partition(", ")[2] for note in found.notes] == [
        "line 4: parameters = 'commuter' is not used",
        f"line {6 + len(UNITS)}: the speed v = 5 m/s is not a property of the bicycle and is not used",
    ]


def test_zero_everywhere_is_said(tmp_path):
    found = load_bicycle(write(tmp_path, "z.txt", {k: f"{v}+/-0.0" for k, v in BENCHMARK.items()}))
    assert "every standard deviation is 0, so its values count as exact" in found.warnings[0]
    assert load_bicycle(write(tmp_path, "y.txt", BENCHMARK)).warnings == ()


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("b.txt", {"lam": 18}, r"lam = 18 rad is out of range.*write its unit behind the number \(lam = 18.3 deg"),
        ("b.yaml", {"lam": 18}, r"lam = 18 rad is out of range.*write its unit behind the number \(lam = 18.3 deg"),
        ("b.toml", {"w": 1020}, r"w = 1020 m is far outside .* \(millimetres\?\); give it in SI units, write its unit"),
        ("b.txt", {"w": 102}, r"w = 102 m is far outside .* \(centimetres\?\); give it in SI units, write its unit"),
        ("b.txt", {"w": "1.02+/-3"}, r"deviation of w is 3 m, more than its usual values .* \(millimetres\?\); write"),
        ("b.txt", {"w": "1.02 kg"}, r"line 1, w: 'kg' is no unit of what is given in m"),
        ("b.yaml", {"w": "1,02"}, r"line 1: w = '1,02' has a decimal comma; write a point"),
        ("b.txt", {"kDaa": 1}, r"unknown key 'kDaa'"),
        ("b.txt", {"Ibxx": 1}, r"unknown key 'Ibxx'; did you mean 'IBxx'\?"),
        ("b.toml", {"lambda": 0.3}, r"\[values\]: unknown key 'lambda'; did you mean 'lam'\?"),
        ("b.txt", {"allow_unusual": "yes"}, r"allow_unusual = 'yes' must be true or false"),
    ],
)
def test_refused_values(tmp_path, name, values, words):
    with pytest.raises(InputError, match=words):
        load_bicycle(write(tmp_path, name, BENCHMARK | values))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("b.yaml", "parameterization: principal\nvalues:\n  w: 1.0\n", "line 1: parameterization = 'principal' is an"),
        ("b.yaml", "colour: red\nvalues:\n  w: 1.0\n", "line 1: unknown key 'colour'"),
        ("b.yaml", "values: 3\n", "values must hold one 'key: value' a line"),
        ("b.yaml", "w: 1.0(1)\nsd:\n  w: 0.2\n", "line 3: the standard deviation of w is given twice; keep one"),
        ("b.yaml", "w: 1.0\nsd:\n  x: 0.2\n", "standard deviation: unknown key 'x'"),
        ("b.yaml", "w: 1.0\nsd:\n  w: 0.2(1)\n", r"standard deviation of w = '0.2\(1\)' has one of its own"),
        ("b.yaml", "w: 1.0\nunits:\n  w: kg\n", "units: w: 'kg' is no unit of what is given in m"),
        ("b.toml", "units = {w = 3}\n[values]\nw = 1\n", r'units: w = 3 must be a unit in quotes, such as "mm"'),
        ("b.toml", "units = {W = 'mm'}\n[values]\nw = 1\n", "unknown key of units: 'W'; did you mean 'w'"),
        ("b.txt", "w = 1.0\nw = 1.1\n", "line 2: w is given twice; keep one"),
        ("b.txt", "v = 1.0\nv = 1.1\n", "line 2: v is given twice; keep one"),
        ("b.txt", "long words\n", "line 1: 'long words' is no 'key : value'"),
    ],
)  # fmt: skip
def test_refused_files(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words):
        load_bicycle(tmp_path / name)


FACTORS = st.floats(0.97, 1.03)
TEXT = st.text(st.characters(exclude_categories=["Cs", "Cc"]) | st.sampled_from('\n\t"#:= '), max_size=30)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    factors=st.lists(FACTORS, min_size=len(UNITS), max_size=len(UNITS)), description=TEXT, source=TEXT,
    sd=st.dictionaries(st.sampled_from(tuple(UNITS)), st.floats(0, 0.05), max_size=5),
    ending=st.sampled_from(tuple(WRITERS)),
)  # fmt: skip
def test_written_bicycles_are_read_back_to_the_last_bit(tmp_path, factors, description, source, sd, ending):
    values = {key: value * factor for (key, value), factor in zip(BENCHMARK.items(), factors, strict=True)}
    original = Bicycle("b", values, sd, description, source)
    (tmp_path / f"b{ending}").write_bytes(WRITERS[ending](original).encode())
    found = load_bicycle(tmp_path / f"b{ending}")
    assert found == original
    assert (found.description, found.source) == (description, source)


def test_what_their_readers_find_in_our_files(tmp_path):
    """Their YAML reader takes the numbers at the top; their text reader skips # and splits at = and +/-."""
    original = load_bicycle("pista")
    numbers = yaml.safe_load(WRITERS[".yml"](original))
    assert {key: numbers[key] for key in original.values} == dict(original.values)
    theirs = {}
    for line in WRITERS[".txt"](original).splitlines():
        if line[0] != "#":
            key, value = line.split("#")[0].split("=")
            theirs[key.strip()] = [float(part) for part in value.split("+/-")]
    assert theirs == {key: [value, original.sd[key]] for key, value in original.values.items()}


@pytest.mark.parametrize("ending", WRITERS)
def test_values_that_are_meant_stay_meant(tmp_path, ending):
    giant = Bicycle("giant", BENCHMARK | {"c": 7.0})
    (tmp_path / f"g{ending}").write_text(WRITERS[ending](giant, allow_unusual=True))
    assert load_bicycle(tmp_path / f"g{ending}") == Bicycle("g", giant.values)


@pytest.mark.parametrize(
    ("factor", "unit", "word"),
    [(1e3, "mm", "millimetres"), (1e2, "cm", "centimetres"), (1 / 0.0254, "in", "inches")],
)
def test_a_whole_bicycle_in_another_unit_of_length_is_told_so(tmp_path, factor, unit, word):
    values = load_bicycle("benchmark").values
    turned = {key: factor * value if UNITS.get(key) == "m" else value for key, value in values.items()}
    path = tmp_path / "b.toml"
    path.write_text("[values]\n" + "".join(f"{key} = {value!r}\n" for key, value in turned.items()))
    words = rf'\({word}\?\); .*write length = "{unit}" in a table units \(TOML, YAML\), as \d lengths look like {word}'
    with pytest.raises(InputError, match=words):
        load_bicycle(path)
    path.write_text(f'[units]\nlength = "{unit}"\n' + path.read_text())
    assert dict(load_bicycle(path).values) == pytest.approx(dict(values))


def test_three_lengths_in_millimetres_are_no_slip_of_one_of_them(tmp_path):
    """Two are told one by one."""
    for keys, several in ((["rR", "rF"], False), (["w", "rR", "rF"], True)):
        values = BENCHMARK | {key: 1e3 * BENCHMARK[key] for key in keys}
        with pytest.raises(InputError) as refused:
            load_bicycle(write(tmp_path, "b.toml", values))
        assert ("as 3 lengths look like millimetres" in str(refused.value)) == several
