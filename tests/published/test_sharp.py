"""The motorcycle of Sharp (1971), J. Mech. Eng. Sci. 13(5), 316-329, in his slug, foot, pound-force and second."""

import json
from pathlib import Path

import pytest

from bicycle import Bicycle, Model, effect_class
from bicycle.named_modes import modes

DATA = json.loads((Path(__file__).parent / "sharp1971.json").read_text(), parse_float=str)
WHEELS = ("rear", "front")


def numbers(text):
    """Numbers of a list that was read as printed text."""
    return [float(x) for x in text]


def half_unit(printed):
    """Half a unit of the last printed digit."""
    return 0.5 * 10.0 ** -len(str(printed).partition(".")[2])


@pytest.fixture(scope="module")
def motorcycle():
    def per_wheel(key):
        return dict(zip(WHEELS, numbers(DATA[key]), strict=True))

    bicycle = Bicycle("standard machine", {key: float(value) for key, value in DATA["parameters"].items()})
    effects = (
        effect_class("relaxation_length")(
            cornering_stiffness=per_wheel("cornering_stiffness_rear_front_lb_per_rad"),
            relaxation_length=per_wheel("relaxation_length_rear_front_ft"),
        ),
        effect_class("camber_thrust")(camber_stiffness=per_wheel("camber_stiffness_rear_front_lb_per_rad")),
        effect_class("steer_damper")(damping=float(DATA["steer_damping_lb_ft_s_per_rad"])),
    )
    return Model(bicycle, effects).linear_model()


@pytest.mark.parametrize("position", range(len(DATA["published"]["speed_ft_s"])))
def test_capsize_weave_and_wobble(motorcycle, position):
    published = DATA["published"]
    found = modes(motorcycle, numbers(published["speed_ft_s"])).to_dict()
    for key in ("capsize_re", "weave_re", "weave_im", "wobble_re", "wobble_im"):
        name, part = key.split("_")
        (value,) = found[name][position]
        printed = published[key][position]
        assert value[part == "im"] == pytest.approx(float(printed), abs=0.015 + half_unit(printed)), key
