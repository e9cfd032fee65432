"""Every cell of the blind test makes readable, repeatable cases; its sizes, causes and its baseline."""

import tomllib

import numpy as np
import pytest

from bicycle import load_bicycle
from studies.diagnosis import read_measurement
from tests.validation.blind import baseline as rival
from tests.validation.blind import causes, generator
from tests.validation.blind import motion as moving
from tests.validation.blind.cells import CELLS, make
from tests.validation.blind.generator import modal_case, table_row
from tests.validation.blind.hidden import HIDDEN, UNUSUAL, Hidden, check_rest, true_machine, uncertainty
from tests.validation.blind.histories import CHANNELS, history_case
from tests.validation.blind.motion import Sensor, shapes
from tests.validation.blind.opposed import NOISE as QUIET
from tests.validation.blind.opposed import SPEEDS, opposed_pair, seen_weave, stand_out
from tests.validation.blind.score import CALLED
from tyre.ground import InputError


def contents(folder):
    return {file.name: file.read_text() for file in sorted(folder.iterdir())}


def measured(folder):
    """The measurement file as TOML, and its runs as tables."""
    content = tomllib.loads((folder / "MEASUREMENT.toml").read_text())
    files = [run["file"] for run in content.get("histories", {}).get("runs", ())]
    return content, [np.loadtxt(folder / file, delimiter=",", skiprows=1) for file in files]


@pytest.mark.parametrize("cell", CELLS)
def test_every_cell_makes_readable_cases_that_are_the_same_for_the_same_seed(tmp_path, monkeypatch, cell):
    monkeypatch.setattr(moving, "SUBSTEPS", 2)  # how exact the motion is does not matter here
    for seed in (1, 2):
        truth, left_out = make(cell, seed, tmp_path / str(seed))
        assert bool(truth.effects) == ("none" not in cell)
        assert (truth.cell, truth.seed) == (cell, seed)
        assert set(left_out) <= set(truth.effects)
        assert not left_out or cell.endswith("outside")
        found = read_measurement(tmp_path / str(seed) / "MEASUREMENT.toml")
        assert len(getattr(found, "points", None) or found.runs) >= 3
        assert "hidden" not in "".join(contents(tmp_path / str(seed)).values())
    again, _ = make(cell, 2, tmp_path / "again")
    assert again == truth
    assert contents(tmp_path / "2") == contents(tmp_path / "again")


def test_loud_runs_are_50_times_their_noise_and_some_grow(tmp_path):
    grown = 0
    for seed in range(4):
        make("loud-one", seed, tmp_path / str(seed))
        content, runs = measured(tmp_path / str(seed))
        assert len(runs) == 8
        noise = content["histories"]["noise_sd"]["roll_rate_rad_s"]
        assert np.median([run[:, 1].std() for run in runs]) / noise == pytest.approx(50, rel=0.05)
        thirds = [(run[: len(run) // 3, 1], run[-(len(run) // 3) :, 1]) for run in runs]
        grown += sum(np.ptp(end) > 1.3 * np.ptp(start) for start, end in thirds)
    assert grown > 1


def test_one_speed_is_one_speed(tmp_path):
    make("one-speed", 3, tmp_path)
    speeds = [run["speed_m_s"] for run in measured(tmp_path)[0]["histories"]["runs"]]
    assert len(speeds) == 3
    assert max(speeds) / min(speeds) < 1.01


@pytest.mark.parametrize(
    ("seed", "hidden", "some"), [(3, "steer_spring", 4), (12, "twisting_torque", 2), (9, "steer_damper", 0)]
)
def test_unusual_bicycles_that_fall_are_recorded_shorter_and_not_faster(tmp_path, seed, hidden, some):
    truth, _ = make("history-unusual", seed, tmp_path)
    assert set(truth.effects) == {hidden}
    content, runs = measured(tmp_path)
    low, high = UNUSUAL[hidden].speeds
    speeds = [run["speed_m_s"] for run in content["histories"]["runs"]]
    np.testing.assert_allclose(speeds, np.linspace(max(low, 4.5), high, 4), atol=0.01)
    lengths = [run[-1, 0] for run in runs]
    assert sum(length < 2.99 for length in lengths) == some
    assert min(lengths) > 0.5


def test_tight_priors_are_tighter(tmp_path):
    for name, tight in (("a", 1.0), ("b", 1.5)):
        modal_case(tmp_path / name, hidden=(), rng=np.random.default_rng(1), too_tight=tight)
    loose, close = (measured(tmp_path / name)[0]["uncertainty"] for name in "ab")
    assert loose["lam"] / close["lam"] == pytest.approx(1.5)
    assert (tmp_path / "a" / "modes.csv").read_text() == (tmp_path / "b" / "modes.csv").read_text()


def test_eigenvalues_only_have_no_shapes(tmp_path):
    make("eigenvalues-one", 1, tmp_path)
    assert "over_lean" not in (tmp_path / "modes.csv").read_text()


def test_unusual_sizes_lie_beyond_the_usual_ones():
    for name, unusual in UNUSUAL.items():
        key = next(iter(unusual.draw))
        (low, high), (least, most) = unusual.draw[key], HIDDEN[name].draw[key]
        assert low > most or high < least, name


def test_pairs_that_hide_each_other_could_be_told_apart():
    name, sizes = opposed_pair(np.random.default_rng(2))
    assert stand_out(name, {effect: next(iter(h.draw.values()))[0] for effect, h in sizes.items()}) > 4


def test_weave_is_seen_as_surely_as_a_table_of_it_says():
    bicycle, rng = load_bicycle("benchmark"), np.random.default_rng(0)
    machine, seen = true_machine(bicycle, {}, {}), seen_weave(bicycle, {}).reshape(len(SPEEDS), 6)
    for speed, over_sd in zip(SPEEDS, seen, strict=True):
        weave = shapes(machine, float(speed))["weave"]
        row = table_row(float(speed), weave, QUIET, rng, ratios=True)
        sds = [row[name] for name in ("real_sd_1_s", "steer_over_lean_sd", "yaw_over_lean_sd")]
        values = [part for z in (weave.root, weave.steer, weave.yaw) for part in (z.real, z.imag)]
        np.testing.assert_allclose(over_sd * np.repeat(sds, 2), values)


def test_the_effect_that_is_hidden_by_an_opposed_one_may_be_half_of_what_is_hidden_alone():
    _, sizes = opposed_pair(np.random.default_rng(5))
    ((size, _),) = sizes["pneumatic_trail"].draw.values()
    ((least, _),) = HIDDEN["pneumatic_trail"].draw.values()
    assert least / 2 <= size < least


@pytest.mark.parametrize("name", [*causes.LIBRARY_HISTORIES, *causes.SENSORS])
def test_a_cause_tells_what_it_does(name):
    maker = (causes.LIBRARY_HISTORIES | causes.SENSORS)[name]
    cause = maker(np.random.default_rng(3))
    ((name, values),) = cause.told.items()
    (size,) = values.values()
    done = [cause.extras.rack, cause.extras.bar, cause.speed_offset, cause.friction, *cause.shifts.values()]
    for sensor in cause.sensors.values():
        done += [sensor.gain - 1, sensor.delay, sensor.low_pass, sensor.bias, sensor.drift]
    assert [x for x in done if x] == pytest.approx([size])
    assert name not in HIDDEN


def test_causes_outside_the_library_have_no_name_in_it():
    for maker in causes.OUTSIDE_HISTORIES.values():
        ((name, values),) = maker(np.random.default_rng(3)).told.items()
        assert not values
        assert name not in CALLED


@pytest.mark.parametrize(("name", "key"), [("wrong_tilt", "lam"), ("wrong_trail", "c")])
def test_a_wrong_geometry_is_5_to_12_stated_sd_off_to_either_side(name, key):
    rng, stated = np.random.default_rng(1), uncertainty(load_bicycle("benchmark"))[key]
    off = np.array([causes.LIBRARY[name](rng).shifts[key] / stated for _ in range(200)])
    assert 4.99 < abs(off).min() < 5.2
    assert 9.8 < abs(off).max() < 12.5
    assert off.min() < 0 < off.max()


def test_the_noise_that_drift_and_zero_error_are_counted_in_is_that_of_their_channels():
    noise = {channel: sd for channel, (_, sd) in CHANNELS.items()}
    assert {causes.COLUMNS[name]: level for name, level in causes.LEVELS.items()} == noise


def test_a_loose_mass_on_the_bar_swings_at_1_5_to_3_hz_with_a_tenth_of_critical_damping():
    rng = np.random.default_rng(1)
    for _ in range(50):
        inertia, stiffness, damping = causes.OUTSIDE["bar_mass"](rng).extras.bar_mass
        assert 1.5 <= np.sqrt(stiffness / inertia) / (2 * np.pi) <= 3
        assert damping / (2 * np.sqrt(stiffness * inertia)) == pytest.approx(0.1)


def test_sensors():
    """A ramp through a first-order lag ends one time constant late, through two of them two."""
    time = np.arange(300) * 0.01
    lagged = {Sensor(low_pass=0.05): 0.05, Sensor(low_pass=0.05, order=2): 0.1, Sensor(delay=0.03): 0.03}
    for sensor, late in lagged.items():
        assert sensor.read(time, 2 * time)[-1] == pytest.approx(2 * (time[-1] - late), abs=1e-6)
    waves = np.sin(3 * time)
    np.testing.assert_allclose(Sensor(gain=1.2, bias=0.1, drift=0.5).read(time, waves), 1.2 * waves + 0.1 + 0.5 * time)
    assert np.abs(Sensor(limit=0.3).read(time, waves)).max() < 0.3
    np.testing.assert_allclose(Sensor(crosstalk=0.2).read(time, waves, time), waves + 0.2 * time)


@pytest.mark.parametrize("far", [0.1, 0.3])
def test_a_rider_who_leaves_a_frame_below_the_ground_is_refused(far):
    """A rest of 5 kg so far above or below the ground; its moments of inertia, 1 kg m^2, are physical both ways."""
    whole, rest = load_bicycle("benchmark"), 5.0
    rider = whole["mB"] - rest

    def taken(z):
        height = (whole["mB"] * whole["zB"] - rest * z) / rider
        apart = rider * rest / whole["mB"] * (height - z) ** 2  # parallel axes
        own = {"Ixx": whole["IBxx"] - apart - 1.0, "Izz": whole["IBzz"] - 1.0, "Ixz": whole["IBxz"]}
        check_rest(whole, {"mass": rider, "x": whole["xB"], "z": height, **own})

    taken(-far)
    with pytest.raises(InputError, match="'benchmark' cannot hold rider_lean"):
        taken(far)


@pytest.mark.parametrize("case", [generator.modal_case, history_case])
def test_the_baseline_finds_nothing_in_quiet_data_of_the_stated_bicycle_and_a_strong_damper(
    case, tmp_path, monkeypatch
):
    monkeypatch.setattr(f"{case.__module__}.perturbed", lambda bicycle, sd, rng: bicycle)
    monkeypatch.setattr(
        rival, "TABLE", {name: rival.TABLE[name] for name in ("steer_damper", "steer_spring", "luggage")}
    )
    strong = {"steer_damper": Hidden("rolling", (), {"damping": (2.0, 2.0)})}
    short = {} if case is generator.modal_case else {"runs": 2, "duration": 1.0}
    for names, expected in (((), "none"), (("steer_damper",), "named")):
        settings = {"bicycle": "benchmark", "kind": "rolling", "noise": 0.01, "sizes": strong, **short}
        case(tmp_path, hidden=names, rng=np.random.default_rng(2), **settings)
        found = rival.baseline(tmp_path)
        assert (found["verdict"], tuple(found["class"])) == (expected, names)
        for told in found["effects"]:
            damping = told["parameters"]["damping"]
            assert damping["value"] == pytest.approx(2.0, abs=4 * damping["sd"])
