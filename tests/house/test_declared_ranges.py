"""One range for a number: what occurs, the default sd, the prior of a diagnosis and the samples of the main study."""

import math
import re
from collections import defaultdict

import pytest
from pages import page

import velotyre as vt
from bicycle import Model, effect_class, load_bicycle, registry
from bicycle.effects import describe
from bicycle.model import EFFECT, build_model, standard_deviations
from bicycle.parameters import ParameterKey
from studies import main_study
from studies.bicycles import own_bicycle
from studies.diagnosis import find_candidates
from studies.main_study import ASSUMED
from studies.uncertainty import UncertainModel
from tyre.measured import BANDS

SHIFTS = {"hinge": "joint_z"}  # range of the main study, as a shift -> the number that it shifts
OF_THE_LOAD = {"camber_share"}  # 1/rad, camber stiffness over the load of the wheel: no parameter of an effect
OF_ARMS = {"arm_inertia", "arm_stiffness", "arm_damping"}  # ranges are factors on the arms of the case
UNDECLARED = {"damping_ratio", "dry friction"}  # no parameter of an effect
LOADS = (350.0, 745.0)  # N, of the wheels of ridden bicycles


def declared(effect, name):
    return next(p for p in effect_class(effect).parameters if p.name == name)


def described_sd(p, value):
    """One sd by the words of docs/measurement_files.md: None where a tenth of the value is taken."""
    (low, high), either_sign = p.typical, p.typical[0] < 0 < p.typical[1]
    if p.without_cause or (either_sign and p.neutral is not None):
        return None
    if p.bounds[0] >= 0 and low > 0 and high / low > 3:
        return value * math.log(high / low) / 4
    if either_sign or (p.neutral is None and all(map(math.isfinite, p.bounds))):
        return (high - low) / 4
    return abs(value) * (high - low) / 4 / abs((low + high) / 2)


def test_every_range_of_the_main_study_is_the_declared_one_or_stands_in_the_table_with_its_reason():
    ranges = vars(main_study.Ranges())
    further_cases = {"bare_damping_ratio", "dry_friction", *(f"tense_{name}" for name in OF_ARMS)}
    assert set(ranges) == (set(ASSUMED) - set(SHIFTS.values()) - further_cases) | set(SHIFTS) | OF_THE_LOAD
    for name, ends in ranges.items():
        if name in OF_THE_LOAD | OF_ARMS or ends is None:
            continue
        number = ASSUMED[SHIFTS.get(name, name)]
        expected = number.range or declared(number.effect, number.name).typical
        middle = number.usual if name in SHIFTS else 0.0
        assert ends == pytest.approx([end - middle for end in expected]), name


@pytest.mark.parametrize("name", ASSUMED)
def test_what_the_main_study_assumes_is_the_declared_default_or_has_a_reason(name):
    number = ASSUMED[name]
    if number.name in UNDECLARED:
        assert number.reason
        assert number.ends[0] < number.usual < number.ends[1]
        return
    parameter = declared(number.effect, number.name)
    if number.value is None and number.range is None:
        assert (number.usual, number.ends) == (parameter.default, parameter.typical)
        assert not number.reason
    else:
        assert number.reason
        assert (number.value, number.range) != (parameter.default, parameter.typical)
    # what the study draws is never told to be unusual
    assert parameter.typical[0] <= number.ends[0] <= number.usual <= number.ends[1] <= parameter.typical[1]


def test_the_main_study_takes_its_numbers_from_the_table():
    setup = main_study.Settings(load_bicycle("pista_charlie_drops")).setups[1]
    front, arms = setup.front, setup.arms
    taken = {
        "stiffness": front.stiffness, "damping_ratio": front.damping_ratio, "joint_z": -front.joint_height,
        "friction": setup.friction, "trail": setup.trail, "twisting": setup.twisting, "arm_inertia": arms.inertia,
        "arm_stiffness": arms.stiffness, "arm_damping": arms.damping,
    }  # fmt: skip
    tense = main_study.Settings(load_bicycle("pista_charlie_drops")).setups[2].arms
    taken |= {f"tense_arm_{name}": getattr(tense, name) for name in ("inertia", "stiffness", "damping")}
    others = ASSUMED.keys() - taken
    # with the effect rider_saddle, and beside the model
    assert others == {"bare_damping_ratio", "saddle_stiffness", "saddle_damping_ratio", "dry_friction"}
    assert taken == {name: ASSUMED[name].usual for name in taken}


ROWS = {
    "stiffness": ("front-frame stiffness", 1.0),
    "damping_ratio": ("front-frame damping ratio", 1.0),
    "trail": ("pneumatic trail", 1e-3),
    "twisting": ("twisting torque", 1.0),
    "joint_z": ("front-frame joint height, on the steer axis", -1.0),
    "friction": ("steering friction, viscous", 1.0),
    "dry_friction": ("steering friction, dry", 1.0),
}
"""Number of the study -> its row on the page, and the unit of the page in SI (z is down)."""


def read_numbers(cell):
    """Numbers of a cell of a table."""
    return [float(number) for number in re.findall(r"\d+(?:\.\d+)?", cell)]


def test_the_page_of_the_main_study_states_the_numbers_that_it_takes():
    text = page("main_study")
    rows = {cells[0]: cells[1:] for cells in re.findall(r"^\| ([^|]+) \| ([^|]+) \| ([^|]+) \|", text, re.MULTILINE)}
    for grip, prefix in (("relaxed", ""), ("tense", "tense_")):
        values, factors = (read_numbers(cell) for cell in rows[f"{grip} arms: inertia, stiffness, damping"])
        assert values == [ASSUMED[f"{prefix}arm_{name}"].usual for name in ("inertia", "stiffness", "damping")]
        assert tuple(factors) == main_study.LIMITS.arms
    for name, (row, unit) in ROWS.items():
        usual, ends = (read_numbers(cell) for cell in rows[row])
        if "±" in rows[row][1]:
            ends = [usual[0] + ends[0], usual[0] - ends[0]]
        assert [usual[0] * unit, *(end * unit for end in ends[:2])] == pytest.approx(
            [ASSUMED[name].usual, *ASSUMED[name].ends]
        ), name


def test_sensitivity_and_uncertainty_take_the_same_deviation_and_the_page_of_the_effect_states_the_range():
    effects = {
        "relaxation_length": {"cornering_stiffness": 6000.0, "relaxation_length": 0.1},
        "front_compliance": {"joint_x": 0.8, "joint_z": -0.85},
        "twisting_torque": {},
    }
    content = {"bicycle": "benchmark", "effects": effects}
    ranked = vt.sensitivity(build_model(content), "wobble", 9.0).set_index("parameter")["sd"]
    deviations = UncertainModel(content, defaults=True).deviations
    for key, value, (low, high) in (
        ("front_compliance.damping", 20.0, (5.0, 40.0)),
        ("twisting_torque.twisting_stiffness.front", 5.0, (2.4, 12.0)),
    ):
        expected = value * math.log(high / low) / 4
        assert (ranked[key], deviations[key].sd) == pytest.approx((expected, expected))
        kind = effect_class(key.partition(".")[0])
        row = next(line for line in describe(kind).splitlines() if line.startswith(f"| `{key.split('.')[1]}`"))
        assert f"| {low:g} .. {high:g} | 0 .. inf | {value:g} |" in row
        assert declared(kind.identifier, key.split(".")[1]).evidence in describe(kind)


def test_a_bicycle_of_everyday_numbers_flexes_as_in_the_main_study():
    limits, ranges = own_bicycle.LIMITS, main_study.Ranges()
    assert (limits.stiffness, limits.damping_ratio) == (ranges.stiffness, ranges.damping_ratio)
    assert limits.friction == ranges.friction
    height = main_study.Front().joint_height
    assert limits.height == pytest.approx((height + ranges.hinge[0], height + ranges.hinge[1]))


def test_ranges_of_a_flexible_front_and_of_a_leaning_tyre():
    """Assumed, and measured on a Schwalbe tyre."""
    damping = declared("front_compliance", "damping")
    assert (damping.typical, damping.default) == ((5.0, 40.0), 20.0)
    assert (declared("twisting_torque", "twisting_stiffness").typical, ASSUMED["twisting"].usual) == ((2.4, 12.0), 5.0)


def test_the_camber_stiffness_that_occurs_is_the_share_of_the_main_study_times_the_load():
    shares = main_study.Ranges().camber_share
    expected = [share * load for share, load in zip(shares, LOADS, strict=True)]
    assert declared("camber_thrust", "camber_stiffness").typical == pytest.approx(expected, rel=0.01)


DEFAULTS = [(effect, p) for effect, kind in registry().items() for p in kind.parameters]


@pytest.mark.parametrize(("effect", "p"), DEFAULTS, ids=[f"{effect}-{p.name}" for effect, p in DEFAULTS])
def test_an_unmeasured_number_is_as_uncertain_as_its_range_says(effect, p):
    low, high = p.typical
    for value in (low + 0.4 * (high - low), low + 0.6 * (high - low)):
        if not p.bounds[0] < value < p.bounds[1]:
            continue
        expected, sd = described_sd(p, value), p.assumed_sd(value)
        if expected is None:
            assert sd is None
            continue
        bounded = math.sqrt((value - p.bounds[0]) * (p.bounds[1] - value)) if math.isfinite(sum(p.bounds)) else math.inf
        assert sd == pytest.approx(min(expected, bounded / 2))
        assert 0 < sd < high - low


@pytest.mark.parametrize("effect", ["front_compliance", "twisting_torque", "rider_arms", "steer_damper", "luggage"])
def test_default_or_written_a_number_without_an_sd_has_that_of_its_range(effect):
    kind, bare = effect_class(effect), Model(load_bicycle("pista_charlie_drops"))
    needed = {p.name: sum(p.typical) / 2 for p in kind.parameters if p.default is None}
    for factor in (1.0, 1.1):
        numbers = {p.name: factor * p.default for p in kind.parameters if isinstance(p.default, int | float)}
        model = bare.with_effect(kind(**needed, **numbers))
        deviations = standard_deviations(model)
        for key in deviations:
            place = ParameterKey.parse(key)
            if place.effect == effect:
                p, value = declared(effect, place.name), model.parameters[key]
                assert deviations[key].sd == pytest.approx(described_sd(p, value) or EFFECT * abs(value)), key


def test_priors_of_a_diagnosis_are_those_of_the_range():
    """A size: the upper end is two sigma, a compliance has the softest; another number spans four."""
    model = Model(load_bicycle("pista_charlie_drops"), (effect_class("side_slip")(cornering_stiffness=6000.0),))
    seen = 0
    for candidate in find_candidates(model, {})[0]:
        parameters = {p.name: p for p in registry()[candidate.identifier].parameters}
        for u in candidate.unknowns:
            low, high = parameters[u.name].typical
            if not u.size:
                assert u.scale == pytest.approx(math.log(high / low) / 4 if u.power == 0 else (high - low) / 4), u.name
            elif u.power == -1:
                assert u.scale == pytest.approx(0.5 / low)
            else:
                assert u.scale == pytest.approx(0.5 * max(abs(low), abs(high)))
            seen += 1
    assert seen > 20


def test_effects_that_take_one_number_of_the_tyre_declare_one_range():
    ranges = defaultdict(set)
    for kind in registry().values():
        for p in kind.parameters:
            if p.tyre:
                ranges[p.tyre].add(p.typical)
    assert {name: len(found) for name, found in ranges.items()} == dict.fromkeys(ranges, 1)
    for name in ranges.keys() & BANDS.keys():
        (low, high), band = ranges[name].pop(), BANDS[name]
        assert band.typical[0] <= low <= band.published[0] < band.published[1] <= high <= band.typical[1], name


def test_a_number_of_a_model_file_is_drawn_within_a_fifth():
    front = main_study.Front(4000.0, 0.10, 0.65, from_file=True)
    ranges = main_study.Settings(load_bicycle("pista_charlie_drops"), front=front).ranges
    assert ranges.damping_ratio == pytest.approx((0.08, 0.125))
    assert ranges.stiffness == pytest.approx((3200.0, 5000.0))


LEAVES_OUT = """
bicycle = "pista_charlie_drops"
[effects.front_compliance]
stiffness = 4000.0
joint_x = 0.87
joint_z = -0.65
[effects.twisting_torque]
[effects.rider_arms]
inertia = 0.1
damping = 2.0
"""


def test_what_a_model_file_leaves_out_is_assumed_and_drawn_from_the_declared_range(tmp_path):
    """Only a number that somebody wrote is known to a fifth."""
    file = tmp_path / "model.toml"
    file.write_text(LEAVES_OUT, encoding="utf-8")
    settings = main_study.settings_of(str(file))
    assert settings.left_out == ("front-frame damping ratio", "arm stiffness")
    assert settings.further == {}
    ranges = settings.ranges
    assert (ranges.damping_ratio, ranges.twisting, ranges.arm_stiffness) == ((0.15, 0.40), (2.4, 12.0), (0.5, 2.0))
    assert (ranges.stiffness, ranges.arm_damping) == (pytest.approx((3200.0, 5000.0)), (0.8, 1.25))
    assert (settings.front.damping_ratio, settings.twisting) == (0.25, 5.0)
