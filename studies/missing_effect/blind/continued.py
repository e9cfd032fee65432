"""A laboratory that goes on measuring: a first table of modes, and further runs of the same bicycle. All synthetic.

Like :mod:`studies.missing_effect.blind.generator`, this shares nothing with the fitter.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import load_bicycle
from studies.missing_effect.blind.generator import TRIES, table_row, write_modal
from studies.missing_effect.blind.hidden import HIDDEN, Truth, base_effects, hide, perturbed, pick, uncertainty
from studies.missing_effect.blind.second.closing import Machine
from studies.missing_effect.blind.second.shapes import shapes
from tyre.base.errors import InputError
from tyre.base.files import write_text

FEWEST = 4  # oscillations of a first table
MODES = ("weave", "wobble")
RATIOS = ("steer_over_lean", "yaw_over_lean")


@dataclass
class Laboratory:
    """A bicycle as it is, as the laboratory states it, and what has been measured.

    Attributes
    ----------
    machine : Machine
    bicycle : str
    effects : dict
        Of its file.
    truth : Truth
    speeds : tuple of float, shape (2,)
        Slowest and fastest of the first table, m/s.
    rng : numpy.random.Generator
    rows : list of dict
        Measured so far.
    """

    machine: Machine
    bicycle: str
    effects: dict[str, Any]
    truth: Truth
    speeds: tuple[float, float]
    rng: np.random.Generator
    rows: list[dict[str, Any]] = field(default_factory=list)

    def measure(self, speeds: Sequence[float], ratios: Sequence[str] = ()) -> list[dict[str, Any]]:
        """Rows of a free decay at each of some ``speeds`` (m/s), a speed as often as it is given, with ``ratios``."""
        found = []
        for speed in speeds:
            for shape in (one for name, one in shapes(self.machine, speed).items() if name in MODES):
                row = table_row(speed, shape, self.truth.noise, self.rng, ratios=True)
                left = [name for name in RATIOS if name not in ratios]
                found.append({key: value for key, value in row.items() if not key.startswith(tuple(left))})
        return found

    def write(self, folder: Path, more: Sequence[dict[str, Any]] = ()) -> Path:
        """Write the measurement file into ``folder``; ``more`` rows (units in their keys), if other, are a part."""
        import tomli_w

        stated = uncertainty(load_bicycle(self.bicycle))
        together = not more or set(more[0]) == set(self.rows[0])
        write_modal(folder, self.bicycle, self.effects, stated, [*self.rows, *more] if together else self.rows)
        if not together:
            write_modal(folder / "more", self.bicycle, self.effects, stated, list(more))
            content = {
                "kind": "joint", "bicycle": self.bicycle, "effects": self.effects, "uncertainty": stated,
                "part": [
                    {"name": "first", "kind": "modal", "modal": {"table": "modes.csv"}},
                    {"name": "more", "kind": "modal", "modal": {"table": "more/modes.csv"}},
                ],
            }  # fmt: skip
            write_text(folder / "MEASUREMENT.toml", tomli_w.dumps(content))
        return folder / "MEASUREMENT.toml"


def laboratory(
    rng: np.random.Generator, hidden: tuple[str, ...], *, points: int, noise: float, ratios: Sequence[str] = ()
) -> Laboratory:
    """A bicycle with ``hidden`` effects and a first table.

    Parameters
    ----------
    rng : numpy.random.Generator
    hidden : tuple of str
        Names of effects.
    points : int
        Number of speeds.
    noise : float
        Factor of the usual standard deviations.
    ratios : sequence of str
        Shape ratios that are measured.
    """
    first = HIDDEN[hidden[0]] if hidden else HIDDEN[str(rng.choice(["steer_damper", "twisting_torque"]))]
    for _ in range(TRIES):
        nominal = pick(first.bicycles, rng)
        real = perturbed(nominal, uncertainty(nominal), rng)
        effects = base_effects(first.base, nominal.static_loads, rng)
        drawn, machine = hide(hidden, nominal, real, effects, rng)
        made = Laboratory(machine, nominal.name, effects, Truth(drawn, noise=noise), first.speeds, rng)
        made.rows = made.measure(np.sort(rng.uniform(*first.speeds, points).round(3)).tolist(), ratios)
        if len(made.rows) >= FEWEST:
            return made
    raise InputError(f"no bicycle with {', '.join(hidden) or 'nothing hidden'} oscillates at {FEWEST} points")
