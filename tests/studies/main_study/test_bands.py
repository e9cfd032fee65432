"""Which critical speeds are wobble's, and where unstable wobble begins and ends."""

import math

import numpy as np
import pytest
from small_study import chosen, small

from bicycle.critical.critical_speeds import critical_speeds
from studies.main_study.assemble import build
from studies.main_study.bands import Span, UncertainCriticalSpeed, unstable_bands, wobble_edges, wobble_span
from studies.main_study.settings import Front
from studies.main_study.solve import solve


def edge(mode, speed, hertz, *, loses=True, kind="oscillatory"):
    direction = "destabilising" if loses else "stabilising"
    return UncertainCriticalSpeed(speed, kind, mode, hertz, direction, sd=0.1, tyre_sd=0.1)


class Growing:
    """A model with one oscillation: its real part and frequency (Hz) are functions of the speed."""

    def __init__(self, real, hertz):
        self.real, self.hertz = real, hertz

    def eigenvalues(self, speed):
        value = complex(self.real(speed), 2 * np.pi * self.hertz(speed))
        return np.array([value, value.conjugate()])


def unstable_oscillations(model, speed, above=3.0) -> int:
    """Growing pairs faster than ``above`` Hz."""
    values = model.eigenvalues(speed)
    return int(((values.real > 0) & (values.imag > above * 2 * np.pi)).sum())


STEADY = Growing(lambda v: -1.0, lambda v: 7.0)


def test_wobble_is_known_by_its_name_and_where_that_is_open_by_its_frequency():
    slow, named, fast = edge("weave", 5, 0.4, loses=False), edge("wobble", 8, 3.8), edge("weave", 20, 6.0, loses=False)
    both, other = edge("weave+wobble", 12, 4.5, loses=False), edge("weave+wobble", 15, 3.5)
    tyres, wheel = edge("rear_tyre", 1, 17.0), edge("wobble", 1.3, 17.0)  # wheels vibrating on their tyres
    real = edge("wobble", 9, 0.0, kind="real")
    assert wobble_edges([both, fast, real, slow, named, tyres, wheel, other]) == [named, both]


def turns(model, found) -> float:
    """Steer over lean in the oscillation at a critical speed."""
    values, vectors = np.linalg.eig(model.state_matrix(found.speed))
    k = np.abs(values - 2j * np.pi * found.frequency_hz).argmin()
    steer, lean = (abs(vectors[model.states.index(name), k]) for name in ("steer", "lean"))
    return float(steer / lean)


def test_the_handlebar_turns_more_in_what_counts_as_wobble(racing):
    setup = racing.settings.reference
    edges = [(r.modes.model, c) for r in racing.of(setup) for c in r.crossings if c.kind == "oscillatory"]
    wobble = [turns(*one) for one in edges if one[1].mode == "wobble"]
    weave = [turns(*one) for one in edges if one[1].mode == "weave" and one[1].frequency_hz > 1]
    assert len(wobble) >= 9
    assert min(wobble) > 8
    assert all(ratio < 3 for ratio in weave)


def test_bands_open_at_both_ends():
    first, second, third = edge("wobble", 4.0, 5, loses=False), edge("wobble", 9.0, 5), edge("wobble", 5.0, 5)
    assert [(b.start, b.end) for b in unstable_bands([second, first])] == [(None, first), (second, None)]
    assert unstable_bands([]) == []
    assert [(b.start, b.end) for b in unstable_bands([third])] == [(third, None)]


def test_a_span_joins_bands_and_is_open_beyond_the_speeds_looked_at():
    edges = [edge("wobble", 4, 6), edge("wobble", 8, 7, loses=False), edge("wobble", 12, 8),
             edge("wobble", 33, 9, loses=False)]  # fmt: skip
    assert wobble_span(STEADY, edges[:2], 30.0) == Span(4.0, 8.0, 30.0)
    assert wobble_span(STEADY, edges, 30.0) == Span(4.0, math.inf, 30.0)
    assert wobble_span(STEADY, edges, 40.0) == Span(4.0, 33.0, 40.0)
    assert wobble_span(STEADY, edges[1:2], 30.0) == Span(0.0, 8.0, 30.0)
    assert wobble_span(STEADY, edges, 3.0) is None


@pytest.mark.parametrize(
    ("span", "words"),
    [
        (Span(3.16, 29.0, 30.0), "from 3.2 to 29.0 m/s (11 to 104 km/h)"),
        (Span(0.0, 10.0, 30.0), "up to 10.0 m/s (36 km/h)"),
        (Span(4.0, math.inf, 30.0), "from 4.0 to beyond 30.0 m/s (14 to beyond 108 km/h)"),
        (Span(0.0, math.inf, 30.0), "from rest to beyond 30.0 m/s"),
    ],
)
def test_spans_in_words(span, words):
    assert span.words == words


@pytest.mark.parametrize(("stiffness", "ends"), [(2500.0, math.inf), (5000.0, 28.2)])
def test_an_undamped_front_wobbles_from_rest_on(stiffness, ends):
    """At rest it is neutral, and at walking speed it grows: no critical speed says where it begins."""
    settings = small(front=Front(stiffness, 0.0))
    linear = build(settings, settings.reference, [6300.0, 0.14, 6000.0, 0.12])
    edges = critical_speeds(linear, max_speed=settings.fastest)
    assert not any(one.direction == "destabilising" and one.kind == "oscillatory" for one in edges)
    span = wobble_span(linear, edges, settings.fastest)
    assert span.low == 0.0
    assert span.high == pytest.approx(ends, abs=0.1)
    assert all(unstable_oscillations(linear, speed) == 1 for speed in (0.01, 1.0, 10.0, 25.0))


def test_band_edges_are_where_the_eigenvalues_lose_and_regain_stability(racing):
    setup, limit = racing.settings.reference, racing.settings.fastest
    for result in racing.of(setup):
        model = build(racing.settings, setup, result.case.contact)
        (band,) = result.bands(limit)
        edges = [(band.start, 0.01)] + ([(band.end, -0.01)] if band.end else [])
        for found, inside in edges:
            assert unstable_oscillations(model, found.speed + inside) == 1
            assert unstable_oscillations(model, found.speed - inside) == 0
        span = result.span(limit)
        assert span.low == band.start.speed
        assert span.high == (band.end.speed if band.end.speed <= limit else math.inf)
        assert unstable_oscillations(model, limit) == (span.high > limit)


@pytest.mark.parametrize("number", [1, 2, 3])
def test_stable_worlds_have_no_growing_fast_oscillation(racing, number):
    setup = racing.settings.setups[number]
    speeds = np.linspace(0.1, racing.settings.fastest, 60)
    for result in racing.of(setup):
        assert result.span(racing.settings.fastest) is None
        assert result.bands(racing.settings.fastest) == []
        assert not any(unstable_oscillations(result.modes.model, speed) for speed in speeds)


@pytest.mark.parametrize("number", range(4))
def test_without_a_rider_weave_is_not_called_wobble(number):
    """Weave of the empty Pista grows and reaches 4 Hz below 30 m/s; the handlebar turns little more than it leans."""
    settings = small("pista")
    (case,) = chosen(settings, {"Tyre1 flat": (3.5,)}).found
    result = solve(settings, case, settings.setups[number])
    assert unstable_oscillations(result.modes.model, 25.0, above=4.0) == 1
    (weave,) = (c for c in result.crossings if c.kind == "oscillatory" and c.destabilising and c.speed < 30)
    assert turns(result.modes.model, weave) < 3.3
    assert result.span(30.0) is None
    assert result.bands(30.0) == []
    assert result.least.damping_ratio > 0.1
