"""What the answer hinges on: both ends of everything that is varied, against models put together by hand."""

import math

import pytest
from by_hand import ARMS, FRONT, by_hand, growing, least_damping
from small_study import chosen, small

from studies.main_study.hinges import End, Hinge, hinges

ENDS = {
    "hands": ({"front": FRONT}, {"front": FRONT, "arms": ARMS}),
    "front": ({"front": FRONT}, {}),
    "stiffness of the front": ({"front": FRONT | {"stiffness": 2500.0}}, {"front": FRONT | {"stiffness": 1e4}}),
    "damping of the front": ({"front": FRONT | {"damping": 5.0}}, {"front": FRONT | {"damping": 40.0}}),
    "height of its hinge": ({"front": FRONT | {"height": 0.55}}, {"front": FRONT | {"height": 0.75}}),
    "friction of the steering": ({"front": FRONT}, {"front": FRONT, "steer_damper": {"damping": 1.0}}),
    "camber thrust": ({"front": FRONT, "camber": 0.43}, {"front": FRONT, "camber": 0.86}),
    "pressure": ({"front": FRONT}, {"front": FRONT}),
}


def test_everything_assumed_or_chosen_is_varied(racing):
    assert {one.what for one in racing.hinges} == set(ENDS)
    assert racing.focus.condition == "5.5 bar"


@pytest.mark.parametrize("what", ENDS)
def test_both_ends_against_models_put_together_by_hand(racing, what):
    (hinge,) = (one for one in racing.hinges if one.what == what)
    speeds = [float(v) for v in racing.settings.speeds if 3 <= v <= 20]
    contacts = [racing.focus.contact] * 2
    if what == "pressure":
        contacts = [racing.subject[0].contact, racing.subject[-1].contact]
        assert (hinge.low.what, hinge.high.what) == ("3.5 bar", "7.5 bar")
    for end, parts, contact in zip((hinge.low, hinge.high), ENDS[what], contacts, strict=True):
        model = by_hand(racing.settings.bicycle, contact, **parts)
        if end.what != "rigid":  # there the tyres' own vibration comes into the range of frequencies
            assert end.least.damping_ratio == pytest.approx(least_damping(model, speeds), rel=1e-6)
        if end.span is None:
            assert not any(growing(model, float(v)) for v in racing.settings.speeds[1:])  # at rest it is neutral
            continue
        assert (growing(model, end.span.low - 0.01), growing(model, end.span.low + 0.01)) == (0, 1)
        if math.isfinite(end.span.high):
            assert (growing(model, end.span.high - 0.01), growing(model, end.span.high + 0.01)) == (1, 0)
        else:
            assert growing(model, racing.settings.fastest) == 1


def test_the_largest_change_of_the_least_damping_comes_first(racing):
    sizes = [abs(one.high.least.damping_ratio - one.low.least.damping_ratio) for one in racing.hinges]
    assert sizes == sorted(sizes, reverse=True)
    assert sizes == pytest.approx([one.size for one in racing.hinges])
    assert racing.hinges[0].what == "front"


def test_size_where_wobble_is_no_oscillation_at_an_end(racing):
    least = racing.hinges[0].low.least
    there, gone = End("a", None, least), End("b", None, None)
    assert Hinge("x", there, gone).size == Hinge("x", gone, there).size == math.inf
    assert Hinge("x", gone, gone).size == 0.0
    assert Hinge("x", there, there).size == 0.0


def test_what_the_file_gives_or_has_once_is_not_varied():
    given = {"camber_thrust": {"camber_stiffness": 200.0}, "steer_damper": {"damping": 0.5}}
    settings = small(further=given, speeds=small().speeds[::4])
    (case,) = chosen(settings, {"Tyre1 flat": (5.5,)}).found
    found = {one.what for one in hinges(settings, [case], case)}
    assert found == set(ENDS) - {"camber thrust", "friction of the steering", "pressure"}
