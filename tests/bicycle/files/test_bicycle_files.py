"""Bicycles as data: packaged sets, neighbouring formats, and what is refused."""

import math

import pytest

from bicycle import Bicycle, available_bicycles, load_bicycle
from tests.shared.refusals import refuses

BENCHMARK = dict(load_bicycle("benchmark").values)


def bicycle(**changes):
    return Bicycle("test", {**BENCHMARK, **changes})


def test_every_packaged_bicycle_has_a_source_and_loads_on_both_wheels():
    assert len(available_bicycles()) >= 10
    for name in available_bicycles():
        found = load_bicycle(name)
        assert found.source
        assert found.description
        assert sum(found.static_loads) == pytest.approx(found["g"] * sum(found[k] for k in ("mB", "mR", "mH", "mF")))
        assert min(found.static_loads) > 0


def test_static_loads_of_the_benchmark():
    # moments about the rear contact by hand: (85*0.3 + 4*0.9 + 3*1.02) kg m * 9.81 / 1.02 m
    assert load_bicycle("benchmark").static_loads[1] == pytest.approx(32.16 * 9.81 / 1.02, rel=1e-14)


def test_neighbours_yaml_with_a_speed_is_read_and_the_speed_is_reported(tmp_path):
    path = tmp_path / "theirs.yml"
    path.write_text("# comment\nv: 3.0\n" + "".join(f"{k}: {v}\n" for k, v in BENCHMARK.items()))
    found = load_bicycle(path)
    assert dict(found.values) == BENCHMARK
    assert "the speed v = 3 m/s is not a property of the bicycle" in found.warnings[0]


def test_neighbours_text_that_repeats_what_symmetry_gives(tmp_path):
    """Some of their sets also give the wheels about the vertical and the centres' lateral places."""
    path, lines = tmp_path / "theirs.txt", [f"{k} = {v}+/-0.001\n" for k, v in BENCHMARK.items()]
    same = [f"IRzz = {BENCHMARK['IRxx']}+/-0.0\n", f"IFzz = {BENCHMARK['IFxx']}\n", "yB = 0.0+/-0.0\n", "yH = 0\n"]
    path.write_text("".join([*lines, *same]))
    found = load_bicycle(path)
    assert dict(found.values) == BENCHMARK
    assert found.warnings == ()
    path.write_text("".join([*lines, "IRzz = 0.07\n", "yH = 0.02\n"]))
    assert load_bicycle(path).warnings == (
        f"{path}, line {len(lines) + 1}: IRzz = 0.07 is not used: "
        "a wheel is symmetric about its axle, so IRxx is taken",
        f"{path}, line {len(lines) + 2}: yH = 0.02 is not used: the bicycle is taken as symmetric",
    )
    path.write_text("".join([*lines, "yB = left\n"]))
    refuses("yB = 'left' is not a finite number", load_bicycle, path)


@pytest.mark.parametrize(("changes", "words"), [
    ({"mB": 0.0, "mR": 0.0, "mH": 0.0, "mF": 0.0}, "total mass is 0 kg"),
    ({"mB": -85.0}, "mB = -85 kg must not be negative"),
    ({"w": 0.0}, "w = 0 m must be positive"),
    ({"w": -1.02}, "w = -1.02 m must be positive"),
    ({"rF": 0.0}, "rF = 0 m must be positive"),
    ({"g": 0.0}, "g = 0 m/s\\^2 must be positive"),
    ({"lam": 18.0}, "lam = 18 rad is out of range.*degrees must be converted"),
    ({"IBxz": 6.0}, "rear frame has a negative principal inertia"),
    ({"IHxx": -0.1}, "front frame has a negative principal inertia"),
    ({"IRxx": -0.1}, "IRxx = -0.1 kg m\\^2 must not be negative"),
    ({"IFyy": -0.1}, "IFyy = -0.1 kg m\\^2 must not be negative"),
    ({"g": 1e308}, r"g = 1e\+308 must be a finite number in SI units, at most 1e\+12 in size"),
    ({"w": 1e300}, r"w = 1e\+300 must be a finite number in SI units, at most 1e\+12 in size"),
    ({"zB": -1e300}, r"zB = -1e\+300 must be a finite number in SI units, at most 1e\+12"),
    ({"xB": 2.0}, "static load of the rear wheel is -"),
    ({"xB": -0.5}, "static load of the front wheel is -"),
    ({"mB": math.nan}, "mB = nan must be a finite number"),
    ({"mB": "85"}, "mB = '85' must be a finite number"),
    ({"mB": True}, "mB = True must be a finite number"),
    ({"mB": 10**400}, "mB = 1000.*\\.\\.\\. must be a finite number"),
    ({"IBxX": 1.0}, "unknown key 'IBxX'; did you mean 'IBxx'"),
])  # fmt: skip
def test_refused_parameter_sets(changes, words):
    refuses(words, bicycle, **changes)


def test_singular_mass_matrix_is_refused():
    nothing_in_front = {"mH": 0.0, "IHxx": 0.0, "IHzz": 0.0, "IHxz": 0.0, "mF": 0.0, "IFxx": 0.0}
    refuses("4x4 mass matrix .* is not positive definite", bicycle, **nothing_in_front, xB=0.5)
    values = {**BENCHMARK, **nothing_in_front, "mH": 4.0}  # a point mass on the steer axis does not feel the steering
    on_axis = values["w"] + values["c"] + values["zH"] * math.tan(values["lam"])
    refuses("4x4 mass matrix .* is not positive definite", bicycle, **nothing_in_front | {"mH": 4.0}, xH=on_axis)
    assert bicycle(**nothing_in_front | {"mH": 4.0}, xH=on_axis + 0.05).static_loads[1] > 0


def test_missing_parameters_are_named():
    values = {key: value for key, value in BENCHMARK.items() if key not in ("IRyy", "zH")}
    refuses("missing IRyy, zH; give every parameter", Bicycle, "test", values)


def test_negative_standard_deviation_is_refused():
    refuses("standard deviation of w is -1", Bicycle, "test", BENCHMARK, {"w": -1.0})


def test_oddities_are_warned_about():
    assert load_bicycle("benchmark").warnings == ()
    assert "violate the triangle inequality" in load_bicycle("browser").warnings[0]
    massless = bicycle(mR=0.0, IRxx=0.0)
    assert any("spin inertia IRyy = 0.12 kg m^2 but no mass" in text for text in massless.warnings)
    assert "lies below the ground (zB = 0.5 m)" in bicycle(zB=0.5).warnings[0]
    assert any("front wheel violates the triangle" in text for text in bicycle(IFxx=0.1).warnings)


@pytest.mark.parametrize(("name", "text", "words"), [
    ("b.toml", "values = 3", r"values = 3 must be a table: write \[values\]"),
    ("b.toml", "source = 'mine'", "missing w, c, lam, .*; give every parameter"),
    ("b.toml", "w = ", "not a TOML file"),
    ("b.toml", "sd = 3\n[values]\nw = 1.0", "sd = 3 must be a table"),
    ("b.yml", "w: [1.0, 2.0]\n", "line 1: expected one 'key: value' a line, found a nested value"),
    ("b.yml", "[1, 2]: 3\n", "found a nested value"),
    ("b.toml", "wheels = 2", "missing w, .*not known: wheels; give every parameter"),
    ("b.json", '{"w": 1.0', "not a JSON file: Expecting"),
    ("b.json", "[" * 100_000, "not a JSON file: maximum recursion depth"),
    ("b.json", '{"a": ' * 200 + "1" + "}" * 200, "lists or tables are more than 50 deep"),
    ("b.json", "[1.0]", 'expected an object such as {"w": 1.02'),
    ("b.yml", "just words", "expected one 'key: value' a line"),
    ("b.yml", "w: 1.0\nw: 1.1\n", "line 2: w is given twice"),
    ("b.yml", "w: heavy\n", "line 1: w = 'heavy' is not a finite number"),
    ("b.yml", "w: [1.0\n", "not a YAML file"),
    ("b.yml", "W: 1.0\n", "missing w, .*did you mean 'w' by 'W'"),
    ("b.yaml", "parameterization: principal\nvalues:\n  w: 1.0\n", "line 1: parameterization = 'principal' is an"),
    ("b.toml", "[values]\nlamb = 0.3\n", "did you mean 'lam' by 'lamb'.; not known: lamb; give every"),
    ("b.txt", "w = 1.0\nTcB1 = 1.2+/-0.1\nTtF1 = 0.9\naB1 = 0.3\n", "holds raw measurements .periods of pendulums "
     "TcB1, TtF1, .*BicycleParameters computes"),
    ("b.yaml", "values: 3\n", r"values = '3' must be a table: write \[values\]"),
    ("b.yaml", "w: 1.0(1)\nsd:\n  w: 0.2\n", "line 3: the standard deviation of w is given twice; keep one"),
    ("b.yaml", "w: 1.0\nsd:\n  x: 0.2\n", "standard deviation: unknown key 'x'"),
    ("b.yaml", "w: 1.0\nsd:\n  w: 0.2(1)\n", r"standard deviation of w = '0.2\(1\)' has one of its own"),
    ("b.yaml", "w: 1.0\nunits:\n  w: kg\n", "units: w: 'kg' is no unit of what is given in m"),
    ("b.toml", "units = {w = 3}\n[values]\nw = 1\n", r'units: w = 3 must be a unit in quotes, such as "mm"'),
    ("b.toml", "units = {W = 'mm'}\n[values]\nw = 1\n", "unknown key of units: 'W'; did you mean 'w'"),
    ("b.txt", "w = 1.0\nw = 1.1\n", "line 2: w is given twice; keep one"),
    ("b.txt", "v = 1.0\nv = 1.1\n", "line 2: v is given twice; keep one"),
    ("b.txt", "long words\n", "line 1: 'long words' is no 'key : value'"),
])  # fmt: skip
def test_unreadable_files(tmp_path, name, text, words):
    (tmp_path / name).write_text(text)
    refuses(words, load_bicycle, tmp_path / name)


def test_unknown_bicycle_and_missing_file(tmp_path):
    refuses("unknown bicycle 'benchmrk'; did you mean 'benchmark'", load_bicycle, "benchmrk")
    refuses("no such bicycle file", load_bicycle, tmp_path / "absent.toml")


def test_a_model_file_in_place_of_a_bicycle_is_recognised(tmp_path):
    path = tmp_path / "model.toml"
    for text, words in (
        ('bicycle = "benchmark"', "is a model file, not a bicycle file; write bicycle = 'benchmark' into the file"),
        ("[bicycle]\nw = 1.0\n[effects.steer_damper]\ndamping = 1.0",
         r"write its table \[bicycle\] and its \[effects.NAME\] into the file that names"),
        ("[bicycle]\nw = 1.0\n[effects.unmodelled_torque]",
         r"\[effects.NAME\] \(a measurement file without unmodelled_torque\) into the file"),
    ):  # fmt: skip
        path.write_text(text)
        refuses(words, load_bicycle, path)
        refuses("In Python, velotyre.read_model reads model files$", load_bicycle, path)
