"""The generator of riders on the saddle moves as Kane's equations say, and hides what it writes down."""

import numpy as np

from bicycle import load_bicycle
from tests.validation import seated_rider
from tests.validation.blind.closing import build
from tests.validation.independent_derivation import distance
from tests.validation.kane_bicycle import KaneBicycle
from tests.validation.seated_rider import body_of, draw_base, draw_hidden, draw_rider, joined


def test_the_generator_moves_as_kanes_equations_say():
    rng = np.random.default_rng(11)
    ridden, bare = load_bicycle("pista_charlie_hoods"), load_bicycle("pista")
    rider = draw_rider(ridden, bare, rng)
    p = {**bare.values, **joined(body_of(bare.values), rider)}
    effects = draw_base(ridden, rng) | {"rider_saddle": draw_hidden(rider, rng)}
    flat = {
        "front_compliance.axis_tilt": p["lam"],
        "camber_thrust.lag_share": 1.0,
        "rider_saddle.inertia_share": 1.0,
        "rider_saddle.mass_share": 1.0,
    }
    for name, table in effects.items():
        for key, value in table.items():
            pair = value if isinstance(value, dict) else dict.fromkeys(("rear", "front"), value)
            flat |= {f"{name}.{key}": value, **{f"{name}.{key}.{wheel}": number for wheel, number in pair.items()}}
    for speed in (5.0, 12.0):
        kane = KaneBicycle({**p, **flat}, list(effects), speed).state_matrix()[1]
        roots = np.linalg.eigvals(build(p, effects).space(speed).matrix)
        assert distance(roots, np.linalg.eigvals(kane)) < 1e-9


def test_the_rider_and_the_bare_bicycle_are_the_ridden_one():
    """Without errors the rear frame of both is that of the packaged bicycle."""
    ridden, bare = (load_bicycle(name).values for name in ("rigid_rider_joined", "rigid"))
    rider = seated_rider.without(body_of(ridden), body_of(bare))
    for key, value in joined(body_of(bare), rider).items():
        assert abs(value - ridden[key]) < 1e-9 * max(abs(value), 1)
