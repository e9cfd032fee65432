"""Causes of an uncertain result: groups, origins, what is assumed and what counts as exact."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
import tomli_w

from bicycle import Model, load_bicycle
from bicycle.stability import critical_speeds
from studies.cli import main
from studies.uncertainty import Uncertainty

MEASURED = {"bicycle": "benchmark", "effects": {"relaxation_length": {"tyre": "Tyre1", "pressure_bar": 4.0}}}
GIVEN = {"relaxation_length": {"cornering_stiffness": 6000.0, "relaxation_length": 0.1}}


@pytest.fixture
def told(tmp_path, capsys):
    """What the command says of a model file with these options."""

    def ask(content, *options):
        (tmp_path / "model.toml").write_text(tomli_w.dumps(content), encoding="utf-8")
        main(["uncertainty", str(tmp_path / "model.toml"), "--samples", "40", *options])
        return capsys.readouterr().out

    return ask


def test_what_nobody_states_has_the_defaults_and_its_own_share(told):
    """The groups are sums over their measurements; what is assumed is named, and what counts as exact."""
    camber = {"camber_thrust": {"camber_stiffness": 0.0, "lag_share": 0.5}}
    content = MEASURED | {"effects": MEASURED["effects"] | camber}
    found = json.loads(told(content, "--sd", "mB=2", "--sd", "w=0", "--json", "-"))
    sds = found["standard_deviations"]
    assert (sds["mB"]["sd"], sds["mB"]["origin"]) == (2.0, "given")
    assert (sds["c"]["sd"], sds["c"]["origin"]) == (0.003, "assumed")
    assert sds["relaxation_length.cornering_stiffness.rear"]["origin"] == "assumed"
    assert sds["relaxation_length.relaxation_length.rear"]["origin"] == "tyre table"
    off = dict.fromkeys((f"camber_thrust.camber_stiffness.{wheel}" for wheel in ("rear", "front")), "switched off")
    assert found["counted_as_exact"] == {"w": "given as 0", "g": "known"} | off
    for q in found["quantities"]:
        single, group = q["linear_variance_shares"], q["variance_shares_by_group"]
        assert sum(group.values()) == pytest.approx(1)
        assert group["mass centres"] == pytest.approx(sum(single[key] for key in ("xB", "zB", "xH", "zH")))
        assert group["tyre lateral stiffness"] == single["tyre lateral stiffness"]
        origin = q["variance_shares_by_origin"]
        assert origin["given"] == pytest.approx(single["mB"])
        assert origin["assumed"] == pytest.approx(1 - single["mB"] - single["tyre lateral stiffness"])
    assert found["draws_left_out"] == {"count": 0, "reasons": {}}
    shown = told(content, "--stated-only")
    assert "treated as exact: w, c, lam" in shown
    assert "(where it was measured; its source states no uncertainty" in shown
    assert "assumed standard uncertainties" not in shown
    shown = told(content, "--relative-cornering-stiffness-sd", "0.2")
    assert "c 0.08 ± 0.003" in shown
    assert "relaxation_length.cornering_stiffness" not in shown  # given, not assumed


def test_the_bicycle_as_numbers_keeps_what_its_file_states():
    drops = load_bicycle("pista")
    content = {"bicycle": dict(drops.values), "effects": GIVEN}
    own = Uncertainty({"bicycle": "pista", "effects": GIVEN}, defaults=True)
    same = Uncertainty(content, defaults=True, bicycle_sd=drops.sd)
    assert same.deviations == own.deviations
    assert same.names == own.names
    follow = {"relaxation_length.relaxation_length.rear": 0.1}
    other = Uncertainty(content, defaults=True, bicycle_sd=drops.sd, follow=lambda p: follow)
    assert set(own.names) - set(other.names) == set(follow)


NAMES = ("w", "c", "lam", "xB", "zB", "xH", "zH", "mB", "mH", "IBxx", "IBzz", "IHxx", "IFyy")


def test_of_many_numbers_known_together_the_one_that_matters_is_named(told):
    """Their correlation with the result, from the covariance and differences of the speed itself."""
    rng = np.random.default_rng(4)
    bicycle = load_bicycle("benchmark")
    sd = np.array([0.002 * max(abs(bicycle.values[name]), 0.5) for name in NAMES])
    mixed = rng.normal(size=(len(NAMES), 40))
    spread = np.corrcoef(mixed) * np.outer(sd, sd)
    content = {"bicycle": "benchmark", "covariance": {"parameters": list(NAMES), "matrix": spread.tolist()}}
    weave = json.loads(told(content, "--stated-only", "--json", "-"))["quantities"][0]
    assert weave["quantity"].startswith("weave")
    ((name, found),) = weave["known_exactly"].items()
    assert name == "13 correlated parameters (w, …)"

    def speed(**changes):
        model = Model(replace(bicycle, values=dict(bicycle.values) | changes))
        return next(c.speed for c in critical_speeds(model.linear_model()) if c.mode == "weave")

    slope = [(speed(**{n: bicycle.values[n] + d}) - speed(**{n: bicycle.values[n] - d})) / (2 * d)
             for n, d in zip(NAMES, sd / 10, strict=True)]  # fmt: skip
    shared = (spread @ slope) ** 2 / sd**2 / (slope @ spread @ slope)
    assert [found[n] for n in NAMES] == pytest.approx(shared.tolist(), rel=1e-3, abs=1e-6)
    assert list(found.values()) == sorted(found.values(), reverse=True)
    shown = told(content, "--stated-only")
    assert "variance reduction if one parameter were exact, of 13 correlated parameters" in shown
    lines = shown.partition("if one parameter were exact")[2].splitlines()
    (row,) = (line for line in lines if line.startswith("weave stable"))
    assert re.split(r" {2,}", row)[1:3] == [f"{key} {100 * part:.0f} %" for key, part in list(found.items())[:2]]
    assert "replaces its correlation" not in shown
    shown = told(content, "--stated-only", "--sd", "c=0.001", "--sd", "lam=0")
    for name in ("c", "lam"):
        assert f"note: {name}: the sd given replaces its correlation with 11 other parameters (model " in shown
