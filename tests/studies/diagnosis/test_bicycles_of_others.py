"""Measurement files and studies take bicycles as other projects write them, with their standard deviations."""

import pytest

from bicycle import load_bicycle
from bicycle.files import to_text, to_yaml
from bicycle.model import read_model
from studies.diagnosis import find_candidates, nuisances, read_measurement

HEAD = "speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s\n"
TABLE = HEAD + "".join(f"{speed},weave,-1,{speed},0.1,0.1\n" for speed in (5, 6, 7))


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "p.txt").write_text(to_text(load_bicycle("pista")))
    (tmp_path / "p.yaml").write_text(to_yaml(load_bicycle("pista")))
    (tmp_path / "weave.csv").write_text(TABLE)
    return tmp_path


@pytest.mark.parametrize("name", ["p.txt", "p.yaml"])
def test_priors_of_a_diagnosis_are_those_of_the_bicycle(folder, name):
    found = {}
    for bicycle in ("pista", name):
        (folder / "m.toml").write_text(f'kind = "modal"\nbicycle = "{bicycle}"\n[modal]\ntable = "weave.csv"\n')
        measurement = read_measurement(folder / "m.toml")
        found[bicycle] = nuisances(measurement.model, measurement.uncertainty)
    assert str(found["pista"]) == str(found[name])
    assert measurement.model.bicycle.sd == load_bicycle("pista").sd


@pytest.mark.parametrize("name", ["sharp1971", "sharp1994", "sharp1994_hands_on", "sharp2004", "kooijman2011"])
def test_every_packaged_model_has_unknowns_that_float(name):
    unknowns, _ = nuisances(read_model(name), {})
    assert all(u.lowest < u.highest and u.lowest <= u.centre <= u.highest for u in unknowns)


def test_a_candidate_whose_neutral_value_is_singular_gives_no_warning():
    find_candidates(read_model("sharp2004"), {}, (), ())
