"""Bicycles whose z axis points up, and whose fork is described by its offset; right values were found elsewhere."""

import json
import math

import numpy as np
import pytest
import tomli_w
import yaml

from bicycle import Model, critical_speeds, load_bicycle
from bicycle.files import read_bicycles
from bicycle.model import build_model
from tyre.ground import InputError

UP = {
    "w": 1.05, "c": 0.07, "lam": 0.31, "g": 9.81, "rR": 0.34, "mR": 2.2, "IRxx": 0.07, "IRyy": 0.14, "xB": 0.35,
    "zB": 0.95, "mB": 80.0, "IBxx": 9.5, "IBzz": 2.6, "IBxz": -2.1, "xH": 0.92, "zH": 0.72, "mH": 3.6, "IHxx": 0.07,
    "IHzz": 0.008, "IHxz": 0.009, "rF": 0.34, "mF": 1.9, "IFxx": 0.065, "IFyy": 0.13,
}  # fmt: skip
WEAVE, CAPSIZE = 5.046825, 8.539013  # m/s, by an independent program from the appendix of Meijaard et al. (2007)


def write(path, values):
    """A bicycle file of the ending of ``path``."""
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    struct = "".join(f"P.{key} = {json.dumps(value)};\n" for key, value in values.items())
    table = ",".join(["name", *values]) + "\n" + ",".join(["up", *map(json.dumps, values.values())]) + "\n"
    texts = {
        ".toml": tomli_w.dumps(values), ".json": json.dumps(values), ".yml": yaml.safe_dump(values), ".txt": lines,
        ".m": struct, ".csv": table,
    }  # fmt: skip
    path.write_text(texts[path.suffix])
    return path


def speeds(bicycle):
    return [one.speed for one in critical_speeds(Model(bicycle), 10.0)]


@pytest.mark.parametrize("ending", [".toml", ".json", ".yml", ".txt", ".m", ".csv"])
def test_z_up_turns_heights_and_products_of_inertia(tmp_path, ending):
    path = write(tmp_path / f"up{ending}", {"z_up": True, **UP})
    assert speeds(load_bicycle(path)) == pytest.approx([WEAVE, CAPSIZE], abs=1e-6)


def test_z_up_in_a_model_file_and_below_values(tmp_path):
    assert speeds(build_model({"bicycle": {"z_up": True, **UP}}).bicycle) == pytest.approx([WEAVE, CAPSIZE], abs=1e-6)
    path = tmp_path / "up.toml"
    path.write_text(tomli_w.dumps({"z_up": True, "values": UP}))
    assert speeds(load_bicycle(path)) == pytest.approx([WEAVE, CAPSIZE], abs=1e-6)


def test_the_remedy_that_is_named_gives_the_right_speeds(tmp_path):
    with pytest.raises(InputError, match=r"z_up = true if z points up here \(it turns zB, zH, IBxz, IHxz\)") as refusal:
        load_bicycle(write(tmp_path / "up.txt", UP))
    remedy = str(refusal.value).partition("all these signs: ")[2].split(", or write")[0]
    turned = {key: float(value) for key, value in (part.split(" = ") for part in remedy.split(", "))}
    assert set(turned) == {"zB", "zH", "IBxz", "IHxz"}
    down = load_bicycle(write(tmp_path / "down.txt", UP | turned))
    assert speeds(down) == pytest.approx([WEAVE, CAPSIZE], abs=1e-6)
    with pytest.raises(InputError, match="z_up = true, but zB = -0.95 m: heights are positive then; take z_up out"):
        load_bicycle(write(tmp_path / "twice.txt", UP | turned | {"z_up": True}))
    one_sign = UP | turned | {"zH": 0.72}  # a slip of one number: the axes are as they should be
    with pytest.raises(InputError, match="heights are negative: write zH = -0.72, or"):
        load_bicycle(write(tmp_path / "slip.txt", one_sign))


def test_a_covariance_turns_with_its_numbers(tmp_path):
    joint = {"parameters": ["mB", "zB", "IBxz"], "matrix": [[1.0, 0.01, 0.02], [0.01, 4e-4, 0.0], [0.02, 0.0, 0.01]]}
    path = tmp_path / "up.toml"
    path.write_text(tomli_w.dumps({"z_up": True, "values": UP, "covariance": joint}))
    turned = [[1.0, -0.01, -0.02], [-0.01, 4e-4, 0.0], [-0.02, 0.0, 0.01]]
    np.testing.assert_array_equal(load_bicycle(path).covariance.matrix, turned)


OFFSET = 0.045  # m
TRAIL = (0.34 * math.sin(0.31) - OFFSET) / math.cos(0.31)


@pytest.mark.parametrize("key", ["fork_offset", "rake"])
@pytest.mark.parametrize("ending", [".toml", ".json", ".yml", ".txt", ".m", ".csv"])
def test_fork_offset_in_place_of_the_trail(tmp_path, key, ending):
    values = {name: value for name, value in UP.items() if name != "c"} | {"z_up": True, key: OFFSET}
    found = load_bicycle(write(tmp_path / f"fork{ending}", values))
    assert found["c"] == pytest.approx(TRAIL, rel=1e-12)
    assert "c" not in found.sd


def test_the_trail_hangs_together_with_what_it_follows_from(tmp_path):
    """Covariance of 400,000 drawn forks."""
    values = {name: value for name, value in UP.items() if name not in ("c", "lam", "rF")} | {"z_up": True}
    lines = "".join(f"{key} = {json.dumps(value)}\n" for key, value in values.items())
    path = tmp_path / "fork.txt"
    path.write_text(lines + "lam = 0.31+/-0.01\nrF = 340 ± 3 mm\nfork_offset = 45(1) mm\n")
    found = load_bicycle(path)
    lam, radius, offset = np.random.default_rng(5).normal([0.31, 0.34, 0.045], [0.01, 0.003, 0.001], (400_000, 3)).T
    drawn = np.cov([lam, radius, (radius * np.sin(lam) - offset) / np.cos(lam)])
    scale = np.sqrt(np.outer(np.diag(drawn), np.diag(drawn)))
    np.testing.assert_allclose(found.covariance.among(["lam", "rF", "c"]) / scale, drawn / scale, atol=0.01)
    assert set(found.sd) == {"lam", "rF", "c"}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"c": 0.07}, "c and fork_offset both give the trail; keep one"),
        ({"fork_offset": 45.0}, "fork_offset = 45 m is far outside the usual 0 .. 0.12 m .*write its unit behind"),
    ],
)
def test_a_fork_that_cannot_be_is_refused(tmp_path, change, message):
    values = {name: value for name, value in UP.items() if name != "c"} | {"z_up": True, "fork_offset": OFFSET}
    with pytest.raises(InputError, match=message):
        load_bicycle(write(tmp_path / "fork.txt", values | change))


def test_a_table_needs_the_trail_or_the_offset(tmp_path):
    path = write(tmp_path / "fork.csv", {name: value for name, value in UP.items() if name != "c"})
    with pytest.raises(InputError, match="the column c is missing"):
        read_bicycles(path)
