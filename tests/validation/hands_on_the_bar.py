"""Which arms on the handlebar wobble as the model of Klinger et al. (2014) does?

Its bands: 8 to 12 Hz, from 2 to 6 m/s on, steer 3 to 5 times roll.

Arms of the packaged rider `charlie` on the Pista in three postures (effect rider_hands): the mass that his bodies put
on the hands, all else drawn log-uniformly within assumed ranges, the front's flexibility too. Tyre 1 at 5.5 bar, camber
thrust 0.8 of the load. Wobble is the least damped root at 5 to 14 Hz; it must be in the bands wherever it grows.
"""

from pathlib import Path
from typing import Any

import numpy as np

from bicycle import Model, effect_class, load_bicycle
from bicycle.model import ModelFamily
from bicycle.rider import packaged_geometry, read_geometry, read_rider, rider_on_bicycle
from studies.model_space import choose
from tyre.ground import data_root, read_toml

SPEEDS = np.arange(2.0, 20.5, 1.0)  # m/s
DRAWN = {
    "rider_hands.stiffness": (1.0, 200.0), "rider_hands.damping": (0.1, 6.0),
    "rider_hands.grip_stiffness": (10.0, 3000.0), "rider_hands.grip_damping": (0.02, 6.0),
    "front_compliance.stiffness": (2000.0, 20000.0), "front_compliance.damping": (1.0, 30.0),
}  # fmt: skip
HERTZ = (5.0, 14.0)


def bands() -> dict[str, tuple[float, float]]:
    """Klinger's ranges as the package holds them."""
    every = read_toml(data_root().joinpath("published", "wobble.toml"), "file of findings")["finding"]
    return {one["quantity"]: (one["low"], one["high"]) for one in every if one["who"].startswith("Klinger")}


def model(posture: str) -> Model:
    """The Pista with its rider, tyre, camber thrust, a flexible front and hands."""
    chosen = choose(f"pista_charlie_{posture}", tyre="Tyre1", pressure="5.5").model
    rear, front = chosen.bicycle.static_loads
    geometry = read_geometry(packaged_geometry("pista"), posture)
    rider = rider_on_bicycle(load_bicycle("pista"), read_rider("charlie"), posture=posture, geometry=geometry)
    camber = effect_class("camber_thrust")(camber_stiffness={"rear": 0.8 * rear, "front": 0.8 * front})
    flexible = effect_class("front_compliance")(stiffness=5000.0, damping=20.0, joint_x=0.85, joint_z=-0.65)
    return Model(chosen.bicycle, (*chosen.effects, camber, flexible, effect_class("rider_hands")(**rider.hands)))


def within(values: np.ndarray, grows: np.ndarray, band: tuple[float, float]) -> np.ndarray:
    """Draws (n,) that wobble somewhere, and wherever they do with a value (n, speeds) inside a band."""
    return np.asarray(grows.any(1) & ((values >= band[0]) & (values <= band[1]) | ~grows).all(1))


def posture_of(posture: str, rng: np.random.Generator, draws: int) -> dict[str, Any]:
    """Shares of ``draws`` in each band, and what those in two of them have in common."""
    family, klinger = ModelFamily(model(posture)), bands()
    numbers = {key: np.exp(rng.uniform(*np.log(span), draws)) for key, span in DRAWN.items()}
    roots, vectors = np.linalg.eig(family.state_matrices(numbers, SPEEDS[None, :]))
    names = [state.name for state in family.evaluate.symbolic.declared.states]
    hertz = roots.imag / (2 * np.pi)
    ratio = np.abs(vectors[:, :, names.index("steer")] / vectors[:, :, names.index("lean")])
    seen = np.where((hertz > HERTZ[0]) & (hertz < HERTZ[1]), roots.real, -np.inf)
    place = seen.argmax(-1)[..., None]
    growth, hertz, ratio = (np.take_along_axis(of, place, -1)[..., 0] for of in (seen, hertz, ratio))
    grows = growth > 0
    onset = np.where(grows.any(1), SPEEDS[grows.argmax(1)], np.nan)
    low, high = klinger["onset_m_s"]
    by_band = {
        "onset_m_s": (onset >= low) & (onset <= high),
        "wobble_frequency_Hz": within(hertz, grows, klinger["wobble_frequency_Hz"]),
        "steer_over_roll": within(ratio, grows, klinger["steer_over_roll"]),
    }
    two = by_band["onset_m_s"] & by_band["wobble_frequency_Hz"]
    found = {
        "mass_kg": round(family.base["rider_hands.mass"], 2), "wobbles": int(grows.any(1).sum()),
        "in_band": {key: int(of.sum()) for key, of in by_band.items()}, "onset_and_frequency": int(two.sum()),
        "all_three": int((two & by_band["steer_over_roll"]).sum()),
    }  # fmt: skip
    if two.any():
        found["steer_over_roll_of_those_5_50_95"] = percentiles(ratio[two][grows[two]])
        found["ranges_of_those_5_50_95"] = {key: percentiles(of[two]) for key, of in numbers.items()}
    return found


def percentiles(values: np.ndarray) -> list[float]:
    """The 5th, 50th and 95th of ``values``, three digits."""
    return [float(f"{q:.3g}") for q in np.percentile(values, (5, 50, 95))]


def run(*, out: Path, seed: int, draws: int = 2000) -> dict[str, Any]:
    """Draw arms in three postures and count those in Klinger's bands."""
    rng = np.random.default_rng(seed)
    return {
        "bands": bands(),
        "postures": {name: posture_of(name, rng, draws) for name in ("upright", "hoods", "drops")},
    }
