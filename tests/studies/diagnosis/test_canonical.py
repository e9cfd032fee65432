"""Identified canonical coefficients: the imitated identification, hidden effects, the Davis bicycle, bad tables."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest
from small_library import all_but, among

from bicycle import Bicycle, Model
from bicycle.effects import outside_effects
from bicycle.files import load_bicycle
from bicycle.identification import Canonical
from studies.diagnosis import find_candidates, read_measurement
from tests.shared.refusals import refuses
from tyre.ground import InputError, data_root

G = 9.81
COEFFICIENTS = ("M_phi_delta", "C1_phi_delta", "K0_phi_delta", "M_delta_delta", "C1_delta_phi", "C1_delta_delta",
                "K0_delta_delta", "K2_delta_delta", "H_delta_F")  # fmt: skip
UNITS = {"M": "kg m^2", "C1": "kg m", "K0": "kg m", "K2": "kg", "H": "m"}
LIKELY = ("steer_damper", "steer_spring", "pneumatic_trail", "crown_radius", "steer_torque_scale", "lean_scale",
          "steer_delay", "speed_scale")  # fmt: skip
SLIPPING = ("steer_damper", "side_slip", "relaxation_length")
DAVIS = Path(str(data_root().joinpath("measured", "davis.toml")))
# benchmark bicycle: Meijaard, Papadopoulos, Ruina & Schwab (2007), section 4
M = np.array([[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]])
K0 = np.array([[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]])
K2 = np.array([[0, 76.59734589573222], [0, 2.65431523794604]])
C1 = np.array([[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]])
# force through the rear frame's mass centre (0.3, -0.9) m: height, and x c cos(lam) / w with lam = pi/10
H = np.array([0.9, 0.3 * 0.08 * np.cos(np.pi / 10) / 1.02])
PUBLISHED = np.array([M[0, 1], C1[0, 1], K0[0, 1], M[1, 1], C1[1, 0], C1[1, 1], K0[1, 1], K2[1, 1], H[1]])
SUBSETS = [(rider, place) for rider in "ABC" for place in ("track", "road")]
SUBSETS = [("all-rounder" if rider == "A" else rider, place) for rider, place in SUBSETS]
HEAD = "rider,environment,coefficient,unit,value,sd"
TOML = 'kind = "canonical"\nbicycle = "benchmark"\n[canonical]\ntable = "t.csv"\n'


def unit(name):
    return UNITS[name.split("_")[0]]


def rows_of(values, *, scatter=0.0, seed=1):
    """CSV rows of every subset: the same coefficients with a scatter that is relative to Whipple's."""
    rng = np.random.default_rng(seed)
    size = np.abs(PUBLISHED) * scatter
    found = []
    for rider, place in SUBSETS:
        noisy = values + size * rng.standard_normal(9)
        for name, value, s in zip(COEFFICIENTS, noisy, np.maximum(size / 10, 1e-6), strict=True):
            found.append(f"{rider},{place},{name},{unit(name)},{value:.12g},{s:.3g}")
    return found


def write(tmp_path, rows, *, head=HEAD, toml=TOML):
    (tmp_path / "m.toml").write_text(toml)
    (tmp_path / "t.csv").write_text("\n".join([head, *rows]) + "\n")
    return tmp_path / "m.toml"


@pytest.fixture
def published(tmp_path):
    return read_measurement(write(tmp_path, rows_of(PUBLISHED, scatter=0.1))).ready()


def identified(forward, name, *values):
    """What the forward model predicts with one candidate, its unknowns at these values."""
    found = [c for c in forward.candidates if c.identifier == name]
    theta = [u.centre for u in forward.nuisances] + list(values)
    return forward.identified(tuple(found), np.array([theta]))[0]


def independently(speeds, *, spring=0.0, damper=0.0, torque_scale=1.0, lean_scale=1.0):
    """The identification in the time domain, of sums of harmonics on the published matrices (nothing of velotyre)."""
    rng = np.random.default_rng(5)
    omega = 2 * np.pi * np.geomspace(0.3, 3.0, 16)
    t = np.arange(0, 200, 0.02)
    blocks = []
    for v in speeds:
        delta, phi, force = np.zeros((3, 3, len(t)))
        for w in omega:
            for kind in range(2):
                s, carrier = 1j * w, np.exp(1j * (w * t + rng.uniform(0, 2 * np.pi)))
                d, f = (0.3 / w, 0.0) if kind == 0 else (0.0, 20.0)
                matrix = M * s**2 + v * C1 * s + G * K0 + v**2 * K2
                p = (H[0] * f - matrix[0, 1] * d) / matrix[0, 0]
                for order in range(3):
                    delta[order] += (s**order * d * carrier).real
                    phi[order] += (s**order * p * carrier).real
                force[0] += (f * carrier).real
        q = np.stack([phi, delta])
        own = np.array([spring * delta[0] + damper * delta[1], np.zeros(len(t))])[0]
        steer = M[1] @ q[:, 2] + v * C1[1] @ q[:, 1] + (G * K0[1] + v**2 * K2[1]) @ q[:, 0] + own - H[1] * force[0]
        blocks.append((v, lean_scale * phi, delta, force[0], torque_scale * steer))
    left = np.hstack([[d[2], v * d[1], G * d[0]] for v, _, d, _, _ in blocks]).T
    right = np.hstack([H[0] * f - M[0, 0] * p[2] - G * K0[0, 0] * p[0] - v**2 * K2[0, 1] * d[0]
                       for v, p, d, f, _ in blocks])  # fmt: skip
    roll = np.linalg.lstsq(left, right, rcond=None)[0]
    left = np.hstack([[d[2], v * p[1], v * d[1], G * d[0], v**2 * d[0], -f] for v, p, d, f, _ in blocks]).T
    right = np.hstack([tau - roll[0] * p[2] - G * roll[2] * p[0] for _, p, _, _, tau in blocks])
    return np.concatenate([roll, np.linalg.lstsq(left, right, rcond=None)[0]])


def test_whipple_coefficients_are_the_published_ones(published):
    found = Canonical.of_whipple(published.model)
    for computed, expected in zip(
        (found.mass, found.c1, found.k0, found.k2, found.force), (M, C1, K0, K2, H), strict=True
    ):
        np.testing.assert_allclose(computed, expected, rtol=1e-12, atol=1e-12)


def test_without_effects_the_identification_gives_whipple(published):
    np.testing.assert_allclose(identified(published, ""), PUBLISHED, rtol=1e-9)


def test_a_steer_spring_adds_its_stiffness_over_g(published):
    np.testing.assert_allclose(
        identified(published, "steer_spring", 3.0) - PUBLISHED, [0] * 6 + [3 / G, 0, 0], atol=1e-9
    )


@pytest.mark.parametrize(("name", "value", "keywords"), [
    ("steer_damper", 1.2, {"damper": 1.2}),
    ("steer_torque_scale", np.log(1.1), {"torque_scale": 1.1}),
    ("lean_scale", np.log(1.05), {"lean_scale": 1.05}),
])  # fmt: skip
def test_effective_coefficients_are_those_of_a_time_domain_identification(published, name, value, keywords):
    """Frequencies are spread so finely that 200 s hold no whole number of periods: hence a per mille of the change."""
    expected = independently(published.coefficients.speeds, **keywords)
    change = expected - PUBLISHED
    assert np.abs(change[3:]).max() > 0.05
    np.testing.assert_allclose(identified(published, name, value), expected, atol=0.03 * np.abs(change).max())


def test_slip_halves_the_lateral_acceleration_that_steering_gives():
    """Where the tyres are soft the steered bicycle turns less: C1 of phi,delta falls, and so does C1 of delta,delta."""
    forward = read_measurement(DAVIS).ready()
    stiff, soft = (identified(forward, "side_slip", 1 / c) - forward.whipple.free for c in (1e6, 6e3))
    assert np.abs(stiff[1]) < 0.01 * np.abs(soft[1])
    assert -0.6 < soft[1] / forward.whipple.free[1] < -0.3
    assert soft[5] < -0.1 * forward.whipple.free[5]


def test_slopes_are_the_differences_of_the_residual(published):
    candidates = tuple(c for c in published.candidates if c.identifier == "steer_damper")
    theta = np.array([u.centre for u in published.nuisances] + [0.8])
    at, slope = published.residual(candidates, theta)
    for column, u in enumerate((*published.nuisances, *candidates[0].unknowns)):
        moved = theta.copy()
        moved[column] += 1e-2 * u.scale
        there, none = published.residual(candidates, moved, slopes=False)
        assert none.shape == (54, 0)
        step = (there - at) / (1e-2 * u.scale)
        np.testing.assert_allclose(slope[:, column], step, atol=0.02 * np.abs(step).max() + 1e-12)


@pytest.mark.parametrize(
    ("keywords", "name", "parameter", "truth"),
    [({"damper": 3.0}, "steer_damper", "damping", 3.0), ({"spring": 9.0}, "steer_spring", "stiffness", 9.0)],
)
def test_a_hidden_effect_is_named(tmp_path, keywords, name, parameter, truth):
    """Synthetic: coefficients of an independent identification, scattered by 5 % between subsets."""
    hidden = independently((2.0, 4.0, 6.0), **keywords)
    toml = TOML + "speeds_m_s = [2, 4, 6]\n"
    measurement = read_measurement(write(tmp_path, rows_of(hidden, scatter=0.05), toml=toml))
    verdict = among(measurement, LIKELY).verdict
    assert verdict.verdict in ("named", "class")
    assert verdict.effects[0].identifier == name
    assert all(name in member.split("+") for member in verdict.equivalent)
    value, sd = verdict.effects[0].parameters[parameter]
    assert value == pytest.approx(truth, abs=3 * sd)
    assert sd < truth / 3


def test_nothing_hidden_names_nothing(tmp_path):
    measurement = read_measurement(write(tmp_path, rows_of(PUBLISHED, scatter=0.1, seed=3)))
    assert among(measurement, LIKELY).verdict.verdict == "none"


def test_hands_and_what_is_left_out_are_not_tried():
    forward = read_measurement(DAVIS).ready(without=("steer_damper", "speed_scale"))
    tried = {c.identifier for c in forward.candidates}
    assert not tried & {"rider_arms", "steer_damper", "speed_scale"}
    assert "rider_arms" in {c.identifier for c in find_candidates(forward.model, {})[0]}  # it would be
    assert "the steer torque, which was measured" in forward.refused["rider_arms"]
    slip = tuple(c for c in forward.candidates if c.identifier == "side_slip")
    assert {c.identifier for c in forward.enabled_by(slip)} == {"camber_thrust", "aligning_moment"}
    assert {"steer_delay", "lateral_force_scale"} <= tried


def test_the_davis_bicycle_is_the_one_of_the_thesis():
    """Rider J's Whipple coefficients, from identified value and printed difference, are those of the bicycle; the frame
    and wheels are those of rigid.toml."""
    measurement = read_measurement(DAVIS)
    table, rigid = measurement.coefficients, load_bicycle("rigid")
    assert table.subsets == ("C on H", "C on P", "J on H", "J on P", "L on H", "L on P")
    own = Canonical.of_whipple(Model(Bicycle("J", measurement.model.bicycle.values))).free
    np.testing.assert_allclose(table.whipple[2, :8], own[:8], rtol=2e-3)
    for key in ("w", "c", "lam", "rR", "mR", "IRyy", "mH", "xH", "zH", "IHxx", "IHzz", "rF", "mF", "IFyy"):
        assert measurement.model.bicycle[key] == rigid[key]
    assert measurement.model.bicycle["mB"] == pytest.approx(rigid["mB"] + 83.5)
    with (DAVIS.parent / "davis_canonical_coefficients.csv").open() as stream:
        printed = {(r["rider"], r["environment"], r["coefficient"]): r for r in csv.DictReader(stream)}
    assert len(printed) == 12 * 9
    # two cells as the thesis prints them, and the standard deviation that only the regression gives
    assert (printed["J", "P", "C1_phi_delta"]["value"], printed["C", "P", "C1_delta_phi"]["difference_percent"]) == (
        "30.04", "-366.5",
    )  # fmt: skip
    assert (table.sd > 2 * np.array([[float(printed[(*s.split(" on "), n)]["sd"]) for n in COEFFICIENTS]
                                     for s in table.subsets])).all()  # fmt: skip
    assert any("A-A, A-H, A-P, C-A, J-A, L-A" in note for note in measurement.notes)


def test_the_davis_coefficients_need_two_effects(tmp_path, printed, no_pictures):
    """Slip takes C1 of phi,delta down as measured, but C1 of delta,delta the wrong way: a second effect is needed."""
    files = ["--out", str(tmp_path / "out"), "--json", str(tmp_path / "v.json"), "--no-stability"]
    few = [f"--without={name}" for name in all_but(read_measurement(DAVIS), SLIPPING)]
    assert printed("diagnose", str(DAVIS), *few, *files).startswith("class. ")
    verdict = json.loads((tmp_path / "v.json").read_text())
    assert all(len(name.split("+")) == 2 for name in verdict["class"])
    c = next(e for e in verdict["effects"] if e["identifier"] == "side_slip")["parameters"]
    assert 2e3 < c["cornering_stiffness.front"]["value"] < c["cornering_stiffness.rear"]["value"] < 2e4  # N/rad, a tyre
    assert all({"side_slip", "relaxation_length"} & set(name.split("+")) for name in verdict["class"])
    assert verdict["posterior"]["none"] < 0.01
    assert verdict["held_out_gap"]["final"] < 0.5 * verdict["held_out_gap"]["nuisance_only"]
    report = (tmp_path / "out" / "report.md").read_text()
    assert "| C on H | 9 |" in report
    assert re.search(r"\d to [\d.]+ m/s \|", report) is None  # no thirds of the speeds: there are conditions
    for figure in ("story", "before_after"):
        assert (tmp_path / "out" / f"{figure}.png").exists()


def test_a_base_without_printed_differences_is_the_bicycle_itself(tmp_path):
    forward = read_measurement(write(tmp_path, rows_of(PUBLISHED + 0.1))).ready()
    residual, _ = forward.residual((), forward.nominal)
    np.testing.assert_allclose(residual * forward.data[1], 0.1, atol=1e-6)


GOOD = rows_of(PUBLISHED, scatter=0.1)
DIFFERS = [row + ",10" for row in rows_of(PUBLISHED)]


@pytest.mark.parametrize(("head", "rows", "words"), [
    (HEAD.replace("unit", "units"), GOOD, "unknown column 'units'"),
    ("rider,environment,coefficient,unit,value", [r.rsplit(",", 1)[0] for r in GOOD], "the column sd is missing"),
    (HEAD, [GOOD[0].replace("M_phi", "M_fi"), *GOOD[1:]], "unknown coefficient 'M_fi_delta'; did you mean 'M_phi"),
    (HEAD, [GOOD[0].replace("kg m^2", "g m^2"), *GOOD[1:]], "M_phi_delta is in 'g m.2'; give it in 'kg m.2'"),
    (HEAD, [*GOOD, GOOD[4]], "line 56: the same rider, environment and coefficient as line 6; keep one"),
    (HEAD, [GOOD[0].rsplit(",", 1)[0] + ",0", *GOOD[1:]], "sd = 0 must be .*no identification is free"),
    (HEAD, [GOOD[0].rsplit(",", 1)[0] + ",1e308", *GOOD[1:]], r"sd = 1e\+308 must be .* to 1e\+12"),
    (HEAD, [*GOOD, "," + GOOD[0].split(",", 1)[1]], "line 56: rider and environment need a name"),
    (HEAD, GOOD[:-1], "rider C, environment road lacks H_delta_F"),
    (HEAD, GOOD[:27], "3 subsets that share no runs .A is all of them.; at least 4 are needed"),
    (HEAD, [r.replace(",track,", ",A,") for r in GOOD], "3 subsets that share no runs"),
    (HEAD + ",difference_percent", [r + ",-100" for r in GOOD], "M_phi_delta of rider all-rounder is zero"),
    (HEAD + ",difference_percent", [*DIFFERS[:-1], DIFFERS[-1] + "0"], "rows of rider C disagree on Whipple's"),
    (HEAD + ",difference_percent", [r + "," for r in GOOD], "difference_percent = '' must be a finite number"),
])  # fmt: skip
def test_bad_tables(tmp_path, head, rows, words):
    with pytest.raises(InputError, match=words):
        read_measurement(write(tmp_path, rows, head=head))


@pytest.mark.parametrize(("toml", "words"), [
    (TOML.replace('table = "t.csv"', ""), r'\[canonical\]: no table; write table = "FILE.csv"'),
    (TOML.replace('"t.csv"', "[1]"), r"\[canonical\]: table = \[1\] must be a path in quotes"),
    (TOML + "speed = 3\n", "unknown key 'speed'; did you mean 'speeds_m_s'"),
    (TOML + "speeds_m_s = 3\n", "speeds_m_s = 3 must be a list of two or more numbers in m/s"),
    (TOML + "speeds_m_s = [3, true]\n", "must be a list of two or more numbers"),
    (TOML + "speeds_m_s = [5, 3]\n", "must rise and lie within 0 .. 60 m/s"),
    (TOML + "speeds_m_s = [0, 3]\n", "must rise and lie within 0 .. 60 m/s"),
    (TOML + "band_hz = [0.3, 70]\n", "must rise and lie within 0 .. 50 Hz"),
    (TOML + "band_hz = [0.3, 1, 3]\n", r"band_hz has 3 numbers; write \[lowest, highest\]"),
    (TOML + "[modal]\n", r"the table \[modal\] does not belong here"),
    ('kind = "canonical"\nbicycle = "benchmark"\n', r"the table \[canonical\] is missing"),
    (TOML.replace('"canonical"', '"cannonical"'), "write one of 'bench', 'canonical', .*'tyre_tables'"),
    (TOML.replace("t.csv", "u.csv"), "u.csv: no such table"),
])  # fmt: skip
def test_bad_measurement_files(tmp_path, toml, words):
    with pytest.raises(InputError, match=words):
        read_measurement(write(tmp_path, GOOD, toml=toml))


@pytest.mark.parametrize(("factor", "refused"), [(1000.0, True), (-1000.0, True), (20.0, False)])
def test_a_coefficient_far_from_all_other_subsets_is_refused(tmp_path, factor, refused):
    rows = rows_of(PUBLISHED)
    place = COEFFICIENTS.index("C1_delta_delta")
    cells = rows[place].split(",")
    rows[place] = ",".join([*cells[:4], f"{factor * PUBLISHED[place]:.12g}", cells[5]])
    file = write(tmp_path, rows)
    if not refused:
        read_measurement(file)
        return
    refuses(r"C1_delta_delta = -?1685.4 kg m of all-rounder, track is 1e\+03 times the largest", read_measurement, file)


def test_an_own_effect_with_the_name_of_an_error_of_the_measurement_is_refused(tmp_path):
    (tmp_path / "lean_scale.py").write_text(
        """from bicycle import Effect, Parameter

class Own(Effect):
    'A toy.'
    size = Parameter("N m/rad", "of the toy", bounds=(0.0, 9.0), typical=(1.0, 2.0), default=1.0, neutral=0.0)
    source = signature = "none"
    def apply(self, model):
        model.add_torque(model.steer, -self.size * model.steer.angle)
"""
    )
    measurement = read_measurement(write(tmp_path, rows_of(PUBLISHED, scatter=0.01)))
    said = "the effect 'lean_scale' of .*lean_scale.py has the name of something that may be wrong with a measurement"
    with outside_effects([tmp_path / "lean_scale.py"]), pytest.raises(InputError, match=said):
        measurement.ready()


@pytest.mark.parametrize(("share", "refused"), [(0.995, True), (1.005, False)])
def test_a_row_says_of_whipples_value_what_the_rounding_of_its_percentage_leaves(tmp_path, share, refused):
    """The sd of a number rounded to a step d is d / sqrt(12); a row below it is zero over zero."""
    ratio, name = share * 1e-3 / np.sqrt(12), COEFFICIENTS[-1]
    rows = [f"{row},0" for row in rows_of(PUBLISHED)]
    for place in ("track", "road"):
        (k,) = (k for k, row in enumerate(rows) if row.startswith(f"B,{place},{name},"))
        rows[k] = f"B,{place},{name},{unit(name)},{ratio * PUBLISHED[-1]:.12g},1e-9,{100 * (ratio - 1):.12g}"
    file = write(tmp_path, rows, head=f"{HEAD},difference_percent")
    if refused:
        refuses(f"{name} of rider B is zero in every row", read_measurement, file)
        return
    found = read_measurement(file).coefficients
    np.testing.assert_allclose(found.whipple[found.subsets.index("B on road")], PUBLISHED, rtol=1e-6)
