"""Questions to a study: five worlds, plausible ranges, and what a user gives: pressures, bicycles, model files."""

import numpy as np
import pytest
from small_study import exactly_known, own_table, small

from bicycle import available_bicycles, load_bicycle
from bicycle.files import to_toml
from bicycle.parameters import Bicycle
from bicycle.rider import seated_rider
from studies import main_study
from tests.shared.refusals import refuses
from tyre.ground import InputError


def test_five_worlds_and_the_first_is_the_one_of_the_question():
    settings = small()
    assert [setup.label for setup in settings.setups] == [
        "hands off, flexible front frame", "relaxed hands on, flexible front frame",
        "tense hands on, flexible front frame", "hands off, rigid front frame", "relaxed hands on, rigid front frame",
    ]  # fmt: skip
    assert settings.setups[0] == settings.reference
    assert {setup.camber_share for setup in settings.setups} == {0.65}


def test_camber_stiffness_is_what_dressel_measured():
    """0.0075 to 0.015 of the load per degree (abstract of Dressel, 2013)."""
    per_radian = np.array([0.0075, 0.015]) * 180 / np.pi
    assert pytest.approx(per_radian[0], abs=0.005) == main_study.LIMITS.camber_range[0]
    assert per_radian[1] < main_study.LIMITS.camber_range[1]
    assert main_study.LIMITS.camber_range[0] < main_study.LIMITS.camber_share < main_study.LIMITS.camber_range[1]
    assert pytest.approx(per_radian.mean(), abs=0.01) == main_study.LIMITS.camber_share


def test_what_a_model_file_gives_narrows_its_own_range_and_no_other():
    assumed = main_study.Ranges()
    front = small(front=main_study.Front(4000.0, 0.1, 0.7, from_file=True)).ranges
    assert (front.stiffness, front.hinge) == ((3200, 5000), (-0.02, 0.02))
    assert front.damping_ratio == pytest.approx((0.08, 0.125))
    assert (front.friction, front.camber_share, front.arm_damping) == (
        assumed.friction, assumed.camber_share, assumed.arm_damping,
    )  # fmt: skip
    arms = small(arms=main_study.Arms(0.2, 10.0, 2.0, from_file=True)).ranges
    assert arms.arm_inertia == arms.arm_stiffness == arms.arm_damping == (0.8, 1.25)  # of those of the file
    assert (arms.stiffness, arms.hinge) == (assumed.stiffness, assumed.hinge)
    camber = small(further={"camber_thrust": {"camber_stiffness": 300.0}}).ranges
    assert camber.camber_share == (0.8, 1.25)  # of what the file gives
    damper = small(further={"steer_damper": {"damping": 2.0}}).ranges
    assert damper.friction == (0.0, 0.0)
    assert damper.damping_ratio == assumed.damping_ratio  # of the front
    saddle = small(further={"rider_saddle": {"mass": 70.0}}).ranges
    assert (saddle.saddle_stiffness, saddle.saddle_damping_ratio) == ((2e3, 4e4), (0.1, 0.5))
    assert (assumed.saddle_stiffness, assumed.saddle_damping_ratio) == (None, None)
    assert saddle.damping_ratio == (0.01, 0.10)  # of the frame alone


@pytest.mark.parametrize("name", ["benchmark", "pista_charlie_drops", "rigid"])
def test_an_assumed_hinge_lies_on_the_steer_axis(name):
    p = exactly_known(name).values
    for height in (0.0, 0.5, 0.75):
        front = main_study.Front(joint_height=height)
        from_ground = np.array([front.hinge_x(p) - (p["w"] + p["c"]), -height])  # from where the axis meets the ground
        axis = np.array([np.sin(p["lam"]), np.cos(p["lam"])])
        assert abs(from_ground[0] * axis[1] - from_ground[1] * axis[0]) < 1e-12
    assert main_study.Front(joint_x=0.9).hinge_x(p) == 0.9


@pytest.fixture
def model(tmp_path):
    """Write a model file about the bicycle ``benchmark``."""

    def write(effects: str, bicycle: str = "benchmark"):
        file = tmp_path / "mine.toml"
        file.write_text(f'bicycle = "{bicycle}"\n{effects}')
        return str(file)

    return write


TYRE = '[effects.relaxation_length]\ntyre = "Tyre1"\npressure_bar = 5.5\n'


def test_pressures_are_read_in_bar_and_sorted():
    assert main_study.read_pressures(None) == ()
    assert main_study.read_pressures("7,3.5, 5") == (3.5, 5.0, 7.0)
    assert main_study.read_pressures("4") == (4.0,)


@pytest.mark.parametrize(("text", "words"), [
    ("", "give bar, for example 3.5,5,7"), ("hard", "'hard': give bar"), ("4;5", "'4;5': give bar"),
    ("0", "0 is out of range; give above 0 and up to 20 bar"), ("-3", "-3 is out of range"),
    ("nan", "give bar"), ("inf", "give bar"), ("350", "350 is out of range"),
    ("4,4.0", "repeats a pressure"), ("4,,5", "give bar"),
])  # fmt: skip
def test_pressures_that_are_refused(text, words):
    refuses(words, main_study.read_pressures, text)


def test_without_a_model_everything_beside_the_bicycle_is_assumed(tmp_path):
    settings = main_study.settings_of(bicycle="rigid_rider", tyre="a.csv", pressures="4,7")
    assert settings.bicycle.name == "rigid_rider"
    assert (settings.front, settings.arms, settings.contact) == (main_study.Front(), main_study.Arms(), None)
    assert (settings.tyre, settings.pressures, dict(settings.further)) == ("a.csv", (4.0, 7.0), {})
    assert main_study.settings_of().bicycle.name == "pista_charlie_drops"


def test_no_front_is_assumed_for_a_cargo_bicycle():
    """A racing frame's hinge on a Long John said "yes" from a front that the user never wrote."""
    long_john = load_bicycle("rigid_rider").replace(w=1.95, rF=0.25)
    assert main_study.assumed_front(long_john) is None
    worlds = main_study.Settings(long_john, front=None).setups
    assert [one.label for one in worlds] == [
        "hands off, rigid front frame", "relaxed hands on, rigid front frame", "tense hands on, rigid front frame"
    ]  # fmt: skip
    assert all(main_study.assumed_front(load_bicycle(name)) for name in available_bicycles())


def test_a_measured_tyre_of_a_model_file(model, tmp_path):
    own = own_table(tmp_path)
    settings = main_study.settings_of(
        model(
            f'[effects.relaxation_length]\ntyre = {{rear = "{own.name}", front = "Tyre1"}}\n'
            "pressure_bar = {rear = 6, front = 5}\n"
        )
    )
    assert settings.contact["tyre"]["rear"] == own.resolve().as_posix()  # found beside the model file
    case = main_study.given_case(settings.contact, settings.bicycle)
    assert case.pressures_bar == (6.0, 5.0)
    assert case.name == "Mine (synthetic) / Tyre1 flat"
    assert not case.packaged
    assert dict(settings.further) == {}


def test_own_front_and_arms_take_the_place_of_the_assumed_ones(model):
    settings = main_study.settings_of(
        model(
            TYRE + "[effects.front_compliance]\nstiffness = 4000\ndamping = 8\njoint_x = 0.95\njoint_z = -0.7\n"
            "axis_tilt = 0.25\n[effects.rider_arms]\ninertia = 0.2\nstiffness = 12\ndamping = 2\n"
        )
    )
    ratio = settings.front.damping_ratio
    assert settings.front == main_study.Front(4000.0, ratio, 0.7, 0.95, 0.25, from_file=True)
    assert settings.arms == main_study.Arms(0.2, 12.0, 2.0, grip="", from_file=True)
    assert [setup.hands for setup in settings.setups] == ["off", "on"]  # a front frame that is stated is not rigid
    assert dict(settings.further) == {}
    assert settings.ranges.stiffness == (3200.0, 5000.0)
    flexible = main_study.effect_tables(settings, settings.reference)
    assert flexible["front_compliance"] == {
        "stiffness": 4000.0, "damping": pytest.approx(8.0, rel=1e-12),
        "joint_x": 0.95, "joint_z": -0.7, "axis_tilt": 0.25,
    }  # fmt: skip
    assert "rider_arms" not in flexible
    assert main_study.effect_tables(settings, settings.setups[1])["rider_arms"] == {
        "inertia": 0.2,
        "stiffness": 12.0,
        "damping": 2.0,
    }


def test_other_effects_are_in_every_world_and_camber_thrust_replaces_the_assumed_one(model):
    settings = main_study.settings_of(
        model(
            TYRE + "[effects.crown_radius]\ncrown_radius = 0.014\n[effects.camber_thrust]\ncamber_stiffness = 210\n"
            "[effects.steer_damper]\ndamping = 0.3\n"
        )
    )
    for setup in settings.setups:
        tables = main_study.effect_tables(settings, setup)
        assert tables["crown_radius"] == {"crown_radius": 0.014}
        assert tables["camber_thrust"] == {"camber_stiffness": 210}
        assert tables["steer_damper"] == {"damping": 0.3}
    assert settings.ranges.camber_share == (0.8, 1.25)


def test_a_tyre_without_a_lag_is_refused(model):
    file = model("[effects.side_slip]\ncornering_stiffness = 6000\n")
    refuses(r"relaxation length, but the file has side_slip; use relaxation_length, or", main_study.settings_of, file)


def test_a_model_and_a_bicycle_are_refused(model, tmp_path, refused):
    file = model(TYRE)
    with pytest.raises(InputError, match="--bicycle rigid: a model file names its own bicycle; remove --bicycle"):
        main_study.settings_of(file, bicycle="rigid")
    said = refused("run", file, "--bicycle", "rigid", "--out", tmp_path / "out")
    assert said.startswith("velotyre: --bicycle rigid: a model file names its own bicycle")


@pytest.mark.parametrize(("effects", "words"), [
    ("[effects.relaxation_length]\ntyre = 'Tyre9'\npressure_bar = 5\n", "Tyre9"),
    ("[effects.front_complience]\nstiffness = 4000\n", "did you mean 'front_compliance'"),
    (TYRE + "[effects.front_compliance]\nstiffness = inf\njoint_x = 0.9\njoint_z = -0.7\n", "infinite"),
])  # fmt: skip
def test_what_is_wrong_in_a_model_file_is_told_with_its_name(model, effects, words):
    with pytest.raises(InputError, match=f"mine.toml: .*{words}"):
        main_study.settings_of(model(effects))


def test_a_bicycle_in_the_place_of_the_model_is_the_bicycle(tmp_path):
    by_option = main_study.settings_of(bicycle="pista", pressures="4,6")
    assert main_study.settings_of("pista", pressures="4,6").bicycle.values == by_option.bicycle.values
    (tmp_path / "mine.toml").write_text(to_toml(load_bicycle("browser")))
    assert main_study.settings_of(str(tmp_path / "mine.toml")).bicycle.values == load_bicycle("browser").values
    refuses("two bicycles, pista and --bicycle rigid; remove one", main_study.settings_of, "pista", bicycle="rigid")
    refuses("unknown bicycle or model 'pisto'; did you mean 'pista'", main_study.settings_of, "pisto")


@pytest.mark.parametrize(("defaults", "assumed"), [((), False), (("damping_ratio",), True)])
def test_what_a_model_file_leaves_out_of_front_frame_and_arms_is_assumed(defaults, assumed):
    front = main_study.Front(from_file=True, defaults=defaults)
    arms = main_study.Arms(from_file=True, defaults=defaults)
    setup = main_study.Setup(front, arms)
    assert (setup.assumed, setup.hands_assumed) == (assumed, assumed)


@pytest.mark.parametrize(("effects", "ratio"), [("", 0.25), ("damping_ratio = 0.06\n", 0.06)])
def test_a_front_frame_without_a_damping_has_that_of_frame_and_seated_rider(model, effects, ratio):
    front = "[effects.front_compliance]\njoint_x = 0.95\njoint_z = -0.7\n" + effects
    settings = main_study.settings_of(model(TYRE + front))
    assert settings.front.damping_ratio == pytest.approx(ratio, rel=1e-12)
    assert settings.front.defaults == (("stiffness",) if effects else ("stiffness", "damping_ratio"))
    assert settings.front.stiffness == main_study.Front().stiffness  # the default of the effect is that of the study


def test_the_rider_turns_on_the_saddle_with_one_option(model):
    settings = main_study.settings_of(rider_saddle=True)
    assert settings.further == {"rider_saddle": {}}
    assert settings.front.damping_ratio == 0.03  # of the frame alone
    assert settings.ranges.damping_ratio == (0.01, 0.10)
    with pytest.raises(InputError, match="--rider-saddle: write .effects.rider_saddle. into .*mine.toml instead"):
        main_study.settings_of(model(TYRE), rider_saddle=True)
    with pytest.raises(InputError, match="--rider-saddle: pista has no rider; choose a bicycle with one"):
        main_study.settings_of(bicycle="pista", rider_saddle=True)


def test_a_rider_known_by_the_bicycle_without_him_follows_the_samples_of_the_bicycle(model):
    """The frame that remains is that of the bicycle without rider, whatever the bicycle with rider weighs."""
    rider = '[effects.rider_saddle]\nwithout_rider = "pista"\n'
    settings = main_study.settings_of(model(TYRE + rider, bicycle="pista_charlie_drops"), pressures="5.5")
    heavier = settings.bicycle.values | {"mB": 90.0, "xB": 0.45, "zB": -1.05, "IBxx": 9.1, "IBzz": 3.3, "IBxz": 0.9}
    body = {key.split(".")[1]: value for key, value in main_study.follow(settings, settings.reference, heavier).items()
            if key.startswith("rider_saddle")}  # fmt: skip
    assert (body.pop("mass_share"), body.pop("inertia_share")) == (1.0, 1.0)
    expected = seated_rider(Bicycle("heavier", heavier), load_bicycle("pista"))
    assert body == pytest.approx(expected, rel=1e-9)
    case = main_study.tyre_cases(settings).studied[0]
    uncertain = main_study.uncertainty(settings, case, settings.reference)
    assert None not in list(main_study.draws(settings, case, uncertain, 20))
