"""Bicycles as other projects write them: notations, units, their extras, and the way back."""

import json
import math

import pytest
import yaml
from built import built
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bicycle import Bicycle, Model, critical_speeds, load_bicycle
from bicycle.files import WRITERS
from bicycle.model import build_model
from bicycle.parameters import UNITS
from bicycle.stability import model_covariance
from tests.shared.refusals import refuses
from tyre.ground import InputError

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
    assert "every standard deviation is 0, so its values are treated as exact" in found.warnings[0]
    assert load_bicycle(write(tmp_path, "y.txt", BENCHMARK)).warnings == ()


@pytest.mark.parametrize(("name", "values", "words"), [
    ("b.txt", {"lam": 18}, r"lam = 18 rad is out of range.*write its unit behind the number \(lam = 18.3 deg"),
    ("b.yaml", {"lam": 18}, r"lam = 18 rad is out of range.*write its unit behind the number \(lam = 18.3 deg"),
    ("b.toml", {"w": 1020}, r"w = 1020 m is far outside .* \(millimetres\?\); give it in SI units, write its unit"),
    ("b.txt", {"w": 102}, r"w = 102 m is far outside .* \(centimetres\?\); give it in SI units, write its unit"),
    ("b.txt", {"w": "1.02+/-3"}, r"deviation of w is 3 m, more than its usual values .* \(millimetres\?\); write"),
    ("b.txt", {"w": "1.02 kg"}, r"line 1, w: 'kg' is no unit of what is given in m"),
    ("b.yaml", {"w": "1,02"}, r"line 1: w = '1,02' has a decimal comma; write a point"),
    ("b.txt", {"lam": "pi/0"}, r"lam = 'pi/0' is not a number; write for example pi/10"),
    ("b.toml", {"zB": 0.9, "zH": 0.7}, r"zB = 0.9 m, zH = 0.7 m: below the ground, as z points down; heights are "
     r"negative: write z_up = true .* signs: zB = -0.9, zH = -0.7, IBxz = -2.4, IHxz = 0.00756, or write allow"),
    ("b.txt", {"allow_unusual": "yes"}, r"allow_unusual = 'yes' must be true or false"),
])  # fmt: skip
def test_refused_values(tmp_path, name, values, words):
    with pytest.raises(InputError, match=words):
        load_bicycle(write(tmp_path, name, BENCHMARK | values))


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


LENGTHS = [(1e3, "mm", "millimetres"), (1e2, "cm", "centimetres"), (1 / 0.0254, "in", "inches")]


@pytest.mark.parametrize(("factor", "unit", "word"), LENGTHS)
def test_a_whole_bicycle_in_another_unit_of_length_is_told_so(tmp_path, factor, unit, word):
    turned = {key: factor * value if UNITS[key] == "m" else value for key, value in BENCHMARK.items()}
    path = write(tmp_path, "b.toml", turned)
    words = rf'\({word}\?\); .*write length = "{unit}" in a table units \(TOML, YAML\), as \d lengths look like {word}'
    refuses(words, load_bicycle, path)
    path.write_text(f'[units]\nlength = "{unit}"\n' + path.read_text())
    assert dict(load_bicycle(path).values) == pytest.approx(BENCHMARK)


def test_three_lengths_in_millimetres_are_no_slip_of_one_of_them(tmp_path):
    """Two are told one by one."""
    for keys, several in ((["rR", "rF"], False), (["w", "rR", "rF"], True)):
        values = BENCHMARK | {key: 1e3 * BENCHMARK[key] for key in keys}
        with pytest.raises(InputError) as refused:
            load_bicycle(write(tmp_path, "b.toml", values))
        assert ("as 3 lengths look like millimetres" in str(refused.value)) == several


FIELD = """IBxx=13.5 IBxz=-0.9 IByy=15.5 IBzz=4.1 IFxx=0.053 IFyy=0.098 IHxx=0.34 IHxz=-0.09 IHyy=0.34 IHzz=0.1
IRxx=0.07 IRyy=0.13 c=0.06 g=9.81 mB=100.0 mF=1.6 mH=5.4 mR=4.9 rF=0.3355
rR=0.3325 w=1.064 xB=0.325 xH=0.818 zB=-1.02 zH=-0.78"""
"""Made-up numbers in the forms of moorepants/HumanControl; weave and capsize by a Routh-Hurwitz of its own."""
FURTHER = """IGxx IGxz IGyy IGzz ISxx ISxz ISyy ISzz d1 d2 d3 mG mS xG xS xcl zG zS zcl""".split()  # noqa: SIM905


def weave_and_capsize(bicycle):
    return {one.mode: one.speed for one in critical_speeds(Model(bicycle), 12.0)}


@pytest.mark.parametrize(("name", "line", "lam", "speeds"), [
    ("e.txt", "{}={}\n", "pi/10", (5.32112, 8.74988)), ("l.txt", "{}={}\n", "pi/10", (5.32112, 8.74988)),
    ("m.m", "P.{} = {};  % SI\n", "pi / 10", (5.32112, 8.74988)),
    ("x.txt", "{} = {}+/-0.01\n", "0.3175", (5.34381, 8.78776)),
])  # fmt: skip
def test_files_of_others_are_used_as_far_as_they_go(tmp_path, name, line, lam, speeds):
    pairs = [pair.split("=") for pair in FIELD.split()] + [["lam", lam]]
    pairs[-1][0] = "lambda" if name == "l.txt" else "lam"
    pairs += [[key, "0.05"] for key in FURTHER] if name == "x.txt" else []
    (tmp_path / name).write_text("".join(line.format(*pair) for pair in sorted(pairs)))
    found = load_bicycle(tmp_path / name)
    at = weave_and_capsize(found)
    assert (at["weave"], at["capsize"]) == pytest.approx(speeds, abs=1e-4 if name != "x.txt" else 6e-6)
    told = [note for note in found.notes if "not used" in note]
    assert told == ([f"{tmp_path / name}: not used, as the lateral motion does not hold them: {', '.join(FURTHER)}"]
                    if name == "x.txt" else [])  # fmt: skip


@pytest.mark.parametrize("content", [BENCHMARK, {"values": BENCHMARK, "rider": "none"}])
def test_json(tmp_path, content):
    (tmp_path / "bike.json").write_text(json.dumps(content))
    found = load_bicycle(tmp_path / "bike.json")
    at = weave_and_capsize(found)
    assert (at["weave"], at["capsize"]) == pytest.approx((4.292383, 6.024262), abs=5e-7)  # Meijaard et al. (2007)
    assert [note.rpartition(": ")[2] for note in found.notes] == ["rider = 'none' is not used"] * ("values" in content)


def test_the_two_mass_skate_runs_without_slip_and_on_no_tyre(tmp_path):
    """BicycleParameters, data/bicycles/Tms: point masses, wheels that are nothing, no load behind; weave 2.841 m/s."""
    skate = dict.fromkeys(UNITS, 0.0) | {"w": 1.0, "lam": 0.0872664626, "g": 9.81, "xB": 1.2, "zB": -0.4, "mB": 10.0}
    found = load_bicycle(write(tmp_path, "Tms.txt", skate | {"xH": 1.02, "zH": -0.2, "mH": 1.0}))
    assert weave_and_capsize(found)["weave"] == pytest.approx(2.841, abs=5e-4)
    words = "r{} = 0 m: a wheel that is nothing; 0.3 m is taken, of no effect"
    assert [text.partition(": ")[2] for text in found.notes] == [words.format(wheel) for wheel in "RF"]
    assert any("static load of the rear wheel is -19.82 N" in text for text in found.warnings)
    with pytest.raises(InputError, match=r"with side_slip: the static load of the rear wheel .*; or take no_slip"):
        built(found, side_slip={"cornering_stiffness": 5000.0})


def test_a_changed_bicycle_is_held_to_the_rules_of_files():
    bicycle = load_bicycle("benchmark")
    refuses(r"c = 80 m is far outside .* \(millimetres\?\); .* or give allow_unusual=T", bicycle.replace, c=80.0)
    assert bicycle.replace(c=80.0, allow_unusual=True).warnings == ()
    assert bicycle.replace(c=0.07)["c"] == 0.07


def test_a_joint_covariance_travels_with_the_bicycle(tmp_path):
    """Half of the variance of both masses is common: the sd of a critical speed knows it."""
    (tmp_path / "b.toml").write_text(WRITERS[".toml"](Bicycle("b", BENCHMARK)) + (
        '[covariance]\nparameters = ["mB", "mH"]\nfactor = [[2.0, 0.0], [0.3, 0.4]]\n'))  # fmt: skip
    found = load_bicycle(tmp_path / "b.toml")
    assert dict(found.sd) == pytest.approx({"mB": 2.0, "mH": 0.5})
    names, spread = model_covariance(Model(found))
    assert (names, spread.tolist()) == (("mB", "mH"), [[4.0, 0.6], [0.6, 0.25]])
    (tmp_path / "c.toml").write_text(WRITERS[".toml"](found))
    again = load_bicycle(tmp_path / "c.toml")
    assert (again.covariance, again.sd) == (found.covariance, found.sd)


def test_luggage_on_an_incomplete_file_and_one_with_stated_deviations(tmp_path):
    box = "[[bodies]]\nmass = 8.0\nplace = [-0.1, 0.8]\n"
    path = write(tmp_path, "b.toml", BENCHMARK, tail="[sd]\nmB = 1.0\nIByy = 0.5\nw = 0.002\n" + box)
    assert dict(load_bicycle(path).sd) == pytest.approx({"mB": 1.0, "IByy": 0.5, "w": 0.002})
    path = write(tmp_path, "b.toml", {"w": 1.0}, tail=box)
    refuses("missing c, lam", load_bicycle, path)
    with pytest.raises(InputError, match=r"bodies must be tables|number 1: place is missing"):
        load_bicycle(write(tmp_path, "b.toml", BENCHMARK, tail="[[bodies]]\nmass = 8.0\n"))


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("b.txt", '{"w": 1.02}', "holds JSON; let its name end in .json"),
        (
            "b.m",
            "P = struct('w', 1.02, 'c', 0.08);",
            r"P = struct\(...\) is not read; write one number per line, such as P.w",
        ),
    ],
)
def test_another_form_is_named(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=words):
        load_bicycle(tmp_path / name)
