"""A TOY effect with a joint, outside the package, is there by name wherever the house shows an effect or its mode."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from matplotlib.figure import Figure
from small_library import all_but

from bicycle import Model, effect_class, load_bicycle, modes, read_model
from bicycle.effects import outside_effects, registry
from bicycle.stability import LOOKS, mode_look
from studies.cli import main
from studies.diagnosis import read_measurement
from studies.sweep import read_sweep

PANNIER = str(Path(__file__).with_name("pannier.py"))
MODEL = """bicycle = "benchmark"
[effects.relaxation_length]
cornering_stiffness = 6000.0
relaxation_length = 0.12
[effects.pannier]
mass = 10.0
stiffness = 100.0
"""


def alone(stiffness, mass):
    """Hz: at walking speed the box hangs as a pendulum on the slowly moving frame."""
    return np.sqrt((stiffness + mass * 9.81 * 0.2) / (mass * 0.12**2 + mass * 0.2**2)) / (2 * np.pi)


@pytest.fixture
def model(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m.toml").write_text(MODEL)
    return "m.toml"


def test_modes_and_their_figure(model, capsys):
    main(["modes", model, "--effects", PANNIER, "--speeds", "3,6", "--csv", "modes.csv", "--plot", "modes.svg"])
    assert "pannier 1/s" in capsys.readouterr().out.splitlines()[0]
    assert "pannier" not in registry()  # known while the command runs
    rows = pd.read_csv("modes.csv")
    mine = rows[(rows["mode"] == "pannier") & (rows["speed_m_s"] == 3)]
    assert mine["frequency_Hz"].item() == pytest.approx(alone(100, 10), rel=0.1)
    assert not rows["mode"].str.startswith("other").any()


def test_the_legend_of_a_figure(model):
    with outside_effects([PANNIER]):
        found = modes(read_model(model), [3.0, 6.0])
        frequency, real = found.plot(Figure().subplots(2, 1))
        look = mode_look("pannier")
    words = [text.get_text() for text in frequency.get_legend().get_texts()]
    assert words[-1] == "pannier"  # after the modes of the package
    line = next(line for line in real.lines if line.get_label() == "pannier")
    assert (line.get_color(), line.get_marker()) == (look.colour, look.marker)
    assert mode_look("pannier") == look  # also where the effect is not known
    assert look.colour not in [known.colour for known in LOOKS]


def test_critical_speeds_before_the_command(tmp_path, capsys):
    """An undamped box: its own mode changes its stability, once damped by the rolling bicycle and once driven by it."""
    (tmp_path / "m.toml").write_text(
        'bicycle = "benchmark"\n[effects.pannier]\nmass = 5.0\nstiffness = 30.0\ndamping = 0.0\n'
    )
    main(["--effects", PANNIER, "critical", str(tmp_path / "m.toml"), "--json", "-"])
    found = json.loads(capsys.readouterr().out)["critical_speeds"]
    own = [c for c in found if c["mode"] == "pannier"]
    assert [c["direction"] for c in own] == ["stabilising", "destabilising"]
    assert [c["frequency_Hz"] for c in own] == pytest.approx([alone(30, 5)] * 2, rel=0.15)
    assert not any(c["mode"].startswith("other") for c in found)


def test_sensitivity_and_uncertainty(model, capsys):
    main(["sensitivity", model, "--effects", PANNIER, "--mode", "pannier", "--speed", "3", "--json", "-"])
    ranked = json.loads(capsys.readouterr().out)["parameters"]
    units = {row["parameter"]: row["unit"] for row in ranked}
    assert ranked[0]["parameter"].startswith("pannier.")
    assert units["pannier.gyration"] == "m"
    main(["uncertainty", model, "--effects", PANNIER, "--speeds", "3", "--samples", "4", "--max-speed", "10"])
    assert "pannier frequency at 3 m/s" in capsys.readouterr().out


def test_simulated_outputs_have_its_unit(model):
    main(["simulate", model, "--effects", PANNIER, "--speed", "6", "--duration", "0.5", "--initial", "pannier=0.1",
          "--out", "sim"])  # fmt: skip
    table = pd.read_csv("sim/response_linear.csv")
    assert table["pannier_rad"][0] == 0.1
    assert "pannier_rate_rad_s" in table


def test_root_locus(model):
    main(["root-locus", model, "--effects", PANNIER, "--parameter", "pannier.stiffness", "--range", "50:150:50",
          "--speed", "4", "--out", "locus"])  # fmt: skip
    (csv,) = Path("locus").glob("*.csv")
    rows = pd.read_csv(csv)
    mine = rows[rows["mode"] == "pannier"]["frequency_Hz"].to_numpy()
    assert mine[2] / mine[0] == pytest.approx(alone(150, 10) / alone(50, 10), rel=0.05)
    (figure,) = Path("locus").glob("*.svg")
    assert figure.stat().st_size > 1000


def test_lists_and_pages(capsys, printed):
    main(["effects", "--effects", PANNIER])
    (row,) = [line for line in capsys.readouterr().out.splitlines() if line.startswith("pannier")]
    assert "kg" in row
    page = printed("effects", "pannier", "--effects", PANNIER)
    assert page.startswith("# pannier\n\nTOY: a box")
    assert "- Brings the mode: pannier" in page
    assert json.loads(printed("effects", "pannier", "--effects", PANNIER, "--json", "-"))["modes"] == ["pannier"]


SWEEP = """model = "m.toml"
outputs = ["frequencies", "critical_speeds"]
max_speed_m_s = 5.0
[grid]
speed_m_s = [3.0]
pannier.stiffness = [50.0, 100.0]
"""


def test_sweep_columns_in_other_processes(model, tmp_path):
    (tmp_path / "s.toml").write_text(SWEEP)
    main(["sweep", "s.toml", "--effects", PANNIER, "--processes", "1", "--out", "s.zarr"])
    with xr.open_zarr("s.zarr", consolidated=False) as found:
        names = found["mode"].values.tolist()
        own = found["frequencies"].sel(mode="pannier").values[..., 0]
    packaged = ["weave", "wobble", "capsize", "castering", "rear_tyre", "front_compliance", "rider", "rider_yaw"]
    packaged += ["rider_roll"]
    assert names == [*packaged, "arms", "fork_bending", "muscles", "rear_compliance", "pannier"]
    assert own[1] > own[0] > 1


def test_a_sweep_whose_effect_has_changed_is_another(model, tmp_path):
    (tmp_path / "s.toml").write_text(SWEEP)
    own = tmp_path / "pannier.py"
    prints = set()
    for factor in ("", "2 * "):
        own.write_text(Path(PANNIER).read_text().replace("-self.stiffness", f"-{factor}self.stiffness"))
        with outside_effects([own]):
            prints.add(read_sweep(tmp_path / "s.toml").fingerprint)
    assert len(prints) == 2


def test_diagnosis_names_it(tmp_path, monkeypatch, printed):
    """Synthetic: weave and the mode of a box that the base model does not have."""
    monkeypatch.chdir(tmp_path)
    speeds, rng = [4.5, 5.0, 5.5, 6.0, 6.5], np.random.default_rng(1)
    known = {"x": 0.0, "z": -0.55, "gyration": 0.12, "joint_z": -0.75}
    with outside_effects([PANNIER]):
        truth = effect_class("pannier")(mass=4.0, stiffness=40.0, damping=0.4, **known)
        found = modes(Model(load_bicycle("kooijman2008"), truth), speeds)
    lines = ["speed_m_s,mode,real_1_s,imag_rad_s,real_sd_1_s,imag_sd_rad_s"]
    for mode in ("weave", "pannier"):
        noisy = found.branch(mode)[:, 0] + 0.05 * (rng.normal(size=5) + 1j * rng.normal(size=5))
        lines += [f"{v},{mode},{z.real:.5f},{z.imag:.5f},0.05,0.05" for v, z in zip(speeds, noisy, strict=True)]
    Path("t.csv").write_text("\n".join(lines) + "\n")
    stated = "".join(f"{key} = {value}\n" for key, value in {"mass": 4.0, **known}.items())
    Path("measured.toml").write_text(
        f'kind = "modal"\nbicycle = "kooijman2008"\n[candidates.pannier]\n{stated}[modal]\ntable = "t.csv"\n'
    )
    with outside_effects([PANNIER]):
        left_out = all_but(read_measurement("measured.toml"), ("pannier", "steer_damper", "steer_spring", "luggage"))
    without = [f"--without={name}" for name in left_out]
    verdict = json.loads(printed("diagnose", "measured.toml", "--effects", PANNIER, *without, "--json", "-"))
    assert verdict["verdict"] == "named"
    (named,) = verdict["effects"]
    assert named["identifier"] == "pannier"
    stiffness = named["parameters"]["stiffness"]
    assert abs(stiffness["value"] - 40.0) < 4 * stiffness["sd"] < 4.0
