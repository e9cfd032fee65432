"""The measurement that ``velotyre new`` writes: read and diagnosed as it stands, with every key that it explains."""

import re
from pathlib import Path

import pytest

from bicycle import Bicycle, load_bicycle
from studies.cli import main
from studies.diagnosis import diagnose, example_measurement, read_measurement
from tyre.ground import InputError


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def test_it_is_diagnosed_as_it_stands(capsys):
    main(["new", "m.toml", "--kind", "measurement", "--bicycle", "pista"])
    assert capsys.readouterr().out == (
        "m.toml: synthetic weave of pista in m.csv; next: velotyre diagnose m.toml --out report\n"
    )
    measurement = read_measurement(Path("m.toml"))
    assert measurement.model.bicycle.values == load_bicycle("pista").values
    assert {point.mode for point in measurement.points} == {"weave"}
    sizes = [(point.sd, 0.02 * abs(point.eigenvalue)) for point in measurement.points]
    assert all(sd == pytest.approx((size, size), rel=0.1) for sd, size in sizes)
    assert "SYNTHETIC" in Path("m.toml").read_text()
    assert diagnose(measurement, without=("rider_lean", "front_compliance")).verdict.verdict == "none"


def test_every_key_that_it_explains_is_one(capsys):
    main(["new", "m.toml", "--kind", "measurement"])
    text = Path("m.toml").read_text()
    keys = re.sub(r"^# (?=\[|\w+ = )", "", text, flags=re.M)
    assert len(re.findall(r"^\[", keys, re.M)) == 5
    Path("m.toml").write_text(keys)
    measurement = read_measurement(Path("m.toml"))
    assert measurement.uncertainty["IBxx"] == 0.5
    assert "steer_damper" in [effect.identifier for effect in measurement.model.effects]
    assert "steer_assist" in {candidate.identifier for candidate in measurement.prepare().candidates}
    Path("m.toml").write_text(keys.replace("\nx = 0.0", "\ny = 0.0"))
    with pytest.raises(InputError, match="'y'"):
        read_measurement(Path("m.toml"))


def test_what_is_there_stays(refused):
    Path("m.csv").write_text("mine")
    assert "m.csv exists, where the table of m.toml is written" in refused("new", "m.toml", "--kind=measurement")
    assert Path("m.csv").read_text() == "mine"
    assert not Path("m.toml").exists()
    main(["new", "m.toml", "--kind=measurement", "--force"])
    assert Path("m.csv").read_text().startswith("speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s\n")
    assert "--tyre is of a model file" in refused("new", "b.toml", "--kind=measurement", "--tyre=Tyre2")
    assert "unknown bicycle 'pisto'" in refused("new", "b.toml", "--kind=measurement", "--bicycle=pisto")


def test_a_bicycle_whose_weave_cannot_be_measured_is_refused():
    """A steer axis that leans forward, as on a bicycle that is pushed backwards."""
    values = load_bicycle("benchmark").values | {"lam": -0.3}
    with pytest.raises(InputError, match="--bicycle reversed: its weave can be measured at 0 of 26 speeds"):
        example_measurement(Bicycle("reversed", values), file="m.toml", table="m.csv")


def test_it_is_the_weave_of_the_bicycle_with_the_noise_that_it_states():
    """Weave of the benchmark: Meijaard, Papadopoulos, Ruina & Schwab (2007), table 2."""
    published = {4.0: 0.413253315 + 3.079108186j, 7.0: -2.138756443 + 7.195259133j, 10.0: -3.720168404 + 10.906811395j}
    _, table = example_measurement(load_bicycle("benchmark"), file="m.toml", table="m.csv")
    rows = {row["speed_m_s"]: row for _, row in table.iterrows()}
    off = []
    for speed, root in published.items():
        row = rows[speed]
        off += [
            (row["real_1_s"] - root.real) / row["real_sd_1_s"], (row["imag_rad_s"] - root.imag) / row["imag_sd_rad_s"],
        ]  # fmt: skip
        assert row["real_sd_1_s"] == row["imag_sd_rad_s"] == pytest.approx(0.02 * abs(root), abs=1e-4)
    assert max(map(abs, off)) < 4
    assert min(map(abs, off)) > 1e-3  # noise there is
