"""What does a fit say of recordings of another rig? SYNTHETIC, by equations that share no line with velotyre's own rig.

The tyre is a string on its contact patch: slip builds up over the relaxation length, sigma / V d(alpha')/dt + alpha' =
alpha, and lateral force and moment follow the full curve at the lagged slip alpha'; the trail falls to nothing where
the tyre slides. Three smooth curves are drawn in turn; the parabolic brush, whose slope has a kink where the slip
changes its sign, is counted apart. The steering has play behind its encoder, the load wanders, the force cell drifts,
the belt does not run evenly, the guides of the lateral stiffness test rub, and every sensor is noisy. A campaign is
slip sweeps at two rates, three pulls and two slip steps of a tyre, and sweeps at three cambers, written as CSV files
with sidecars. Counted: bias of C, K, C/K, step, camber stiffness and trail, how often they hold the truth, and warnings
that the routes disagree.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from tests.validation.cases import KeptCases, Row, attempted, share_of
from tyre import InputError
from tyre.fits import fit_campaign

Real = NDArray[np.float64]
RATE = 200.0  # Hz
CAMBERS = (-3.0, 0.0, 3.0)  # deg
CURVES: dict[str, Callable[[Real], Real]] = {  # force over its largest, of C alpha over the largest force
    "arctangent": lambda x: 2 / np.pi * np.arctan(np.pi / 2 * x),
    "tanh": np.tanh,
    "sine of arctangent": lambda x: np.sin(1.35 * np.arctan(x / 1.35)),
    "brush": lambda x: np.sign(x) * (1 - (1 - np.minimum(np.abs(x) / 3, 1)) ** 3),
}
SMOOTH = 3
TARGETS = {"bias_C_K_percent": 0.05, "bias_step_percent": 0.5, "step_held": 0.9, "disagree": 2 / 30}


@dataclass(frozen=True)
class Tyre:
    """A tyre at one load (N) and pressure (Pa); C and camber stiffness in N/rad, K in N/m, trail in m, slip in rad."""

    load: float
    pressure: float
    c: float
    k: float
    peak: float
    curve: str
    camber_stiffness: float
    trail: float
    ply_force: float
    ply_slip: float

    @property
    def length(self) -> float:
        """Relaxation length, m."""
        return self.c / self.k

    def force_and_moment(self, lagged: Real, camber: float, load: Real) -> tuple[Real, Real]:
        """Lateral force (N) and aligning moment (N m) at a lagged slip and a camber (rad), adapted SAE."""
        heavier = load / self.load
        peak, slip = self.peak * heavier, lagged + self.ply_slip + self.camber_stiffness / self.c * camber
        demand = self.c * heavier**0.8 * slip / peak
        force = peak * CURVES[self.curve](demand)
        sliding = np.minimum(np.abs(demand) / 3, 1)
        return force + self.ply_force, -self.trail * (1 - sliding) ** 2 * force


@dataclass(frozen=True)
class Rig:
    """Faults of a rig: play (rad), wander of the load (relative), drift (N/s), friction (N), noise (N, rad)."""

    play: float
    wander: float
    drift: float
    friction: float
    remounting: float
    white: float
    slow: float
    slip_noise: float


def draw_tyre(number: int, rng: np.random.Generator) -> Tyre:
    """Draw a tyre; every fifth one is 50 to 62 mm wide, every seventh carries 800 N; brushes have negative numbers."""
    wide = number % 5 == 0
    load = 800.0 if number % 7 == 0 else float(round(rng.uniform(250, 600)))
    pressure = 1e5 * rng.uniform(2.0, 3.5) if wide else 1e5 * rng.uniform(3.5, 8.0)
    c, k = load * rng.uniform(9, 18), 1e3 * (rng.uniform(60, 130) if wide else rng.uniform(40, 90)) * load**0.25 / 4.5
    curve = "brush" if number < 0 else list(CURVES)[number % SMOOTH]
    return Tyre(
        load, pressure, c, k, peak=load * rng.uniform(0.75, 1.15), curve=curve,
        camber_stiffness=load * rng.uniform(0.5, 1.2), trail=rng.uniform(0.012, 0.025),
        ply_force=rng.uniform(-8, 8), ply_slip=np.deg2rad(rng.uniform(-0.15, 0.15)),
    )  # fmt: skip


def draw_rig(rng: np.random.Generator) -> Rig:
    """Draw the faults of a rig."""
    return Rig(
        play=np.deg2rad(rng.uniform(0.005, 0.03)), wander=rng.uniform(0.003, 0.015), drift=rng.normal(0, 0.03),
        friction=rng.uniform(0.1, 0.6), remounting=rng.uniform(0.0005, 0.002), white=rng.uniform(1, 3),
        slow=rng.uniform(0.3, 1.0), slip_noise=np.deg2rad(rng.uniform(0.002, 0.01)),
    )  # fmt: skip


def behind_play(driven: Real, play: float) -> Real:
    """Angle of a wheel whose drive has so much play."""
    wheel, at = np.empty_like(driven), driven[0]
    for k, angle in enumerate(driven):
        at = wheel[k] = min(max(at, angle - play / 2), angle + play / 2)
    return wheel


def lagged(slip: Real, way: Real, length: float) -> Real:
    """Solve length d(lagged)/d(way) + lagged = slip, which is straight from sample to sample, from rest."""
    found = slip.copy()
    for k in range(1, len(slip)):
        step = (way[k] - way[k - 1]) / length
        old, slope = np.exp(-step), (slip[k] - slip[k - 1]) / step
        found[k] = slip[k] - slope + (found[k - 1] - slip[k - 1] + slope) * old
    return found


def roll(tyre: Tyre, rig: Rig, driven: Real, speed: float, camber: float, rng: np.random.Generator) -> dict[str, Real]:
    """Roll over a drive of the slip angle (rad) at a speed (m/s) and camber (rad); columns of the file."""
    n, time = len(driven), np.arange(len(driven)) / RATE
    true_speed = speed * (1 + 0.003 * np.sin(2 * np.pi * rng.uniform(0.5, 2) * time + rng.uniform(0, 6)))
    way = np.concatenate([[0.0], np.cumsum((true_speed[1:] + true_speed[:-1]) / 2 / RATE)])
    swing = np.sin(2 * np.pi * rng.uniform(0.1, 0.8) * time + rng.uniform(0, 6)) + 0.3 * slow_noise(n, 1.0, rng)
    load = tyre.load * (1 + rig.wander * swing)
    slip = lagged(behind_play(driven, rig.play), way, tyre.length)
    force, moment = tyre.force_and_moment(slip, camber, load)
    gain = 1 + rig.remounting * rng.standard_normal()
    seen = gain * force + rig.drift * time + rig.white * rng.standard_normal(n) + rig.slow * slow_noise(n, 0.2, rng)
    return {
        "time_s": time, "slip_angle_deg": np.rad2deg(driven + rig.slip_noise * rng.standard_normal(n)),
        "lateral_force_N": seen, "vertical_load_N": load + 3 * rng.standard_normal(n),
        "aligning_moment_Nm": moment + 0.05 * rng.standard_normal(n),
        "speed_km_h": 3.6 * true_speed + 0.02 * rng.standard_normal(n),
    }  # fmt: skip


def slow_noise(n: int, time: float, rng: np.random.Generator) -> Real:
    """Noise of unit sd with a correlation time (s)."""
    kept = np.exp(-1 / RATE / time)
    return np.asarray(lfilter([np.sqrt(1 - kept**2)], [1, -kept], rng.standard_normal(n + 2000)))[2000:]


def pull(tyre: Tyre, rig: Rig, rng: np.random.Generator) -> dict[str, Real]:
    """Pull the standing wheel aside and back twice; the guides rub, the tyre softens by 3 % at the end."""
    stroke = np.linspace(0, 1, 41)
    path = np.concatenate([stroke, stroke[-2::-1], stroke[1:], stroke[-2::-1]]) + 0.0
    path[1:-1] += rng.uniform(-0.005, 0.005, len(path) - 2)
    way = 0.4 * tyre.load / tyre.k * np.abs(path)
    pushed = tyre.k * way * (1 - 0.03 * way / way.max()) * (1 + rig.remounting * rng.standard_normal())
    rub = behind_play(way, 2e-4) - way  # the guides give way by 0.1 mm before they slide
    seen = pushed - rig.friction * rub / 1e-4 + 0.1 * rng.standard_normal(len(way))
    rim = pushed / 2e6
    gauges = {"plate_displacement_mm": 1e3 * (way + rim), "rim_displacement_mm": 1e3 * rim}
    gauges = {name: np.round(x + 0.001 * rng.standard_normal(len(x)), 3) for name, x in gauges.items()}
    return {"time_s": 3.0 * np.arange(len(way)), "lateral_force_N": seen, **gauges}


def sweep_drive(rng: np.random.Generator, faster: float = 1.0) -> Real:
    """Slip angle of three triangles of 3 to 6 degrees at 0.7 to 1.5 degrees/s, or so many times as fast."""
    amplitude, rate = rng.uniform(3, 6), faster * rng.uniform(0.7, 1.5)
    phase = np.arange(round(12 * amplitude / rate * RATE)) / RATE * rate / amplitude
    return np.asarray(np.deg2rad(amplitude) * (np.abs((phase + 3) % 4 - 2) - 1))


def step_drive(length: float, speed: float, rng: np.random.Generator) -> Real:
    """Slip angle of a second straight on, then a step of 0.5 to 1.5 degrees for eight relaxation lengths."""
    time = np.arange(round((1.1 + 8 * length / speed) * RATE)) / RATE
    return np.asarray(np.deg2rad(rng.uniform(0.5, 1.5)) * np.clip((time - 1) / 0.06, 0, 1))


def write(
    folder: Path, name: str, kind: str, tyre: Tyre, columns: dict[str, Real], camber: float = 0.0, axes: str = "ISO"
) -> None:
    """Write a recording and its sidecar."""
    turned = ("lateral_force_N", "aligning_moment_Nm", "plate_displacement_mm", "rim_displacement_mm")
    rows = np.column_stack([-x if axes == "ISO" and key in turned else x for key, x in columns.items()])
    folder.mkdir(exist_ok=True)
    np.savetxt(folder / f"{name}.csv", rows, fmt="%.7g", delimiter=",", header=",".join(columns), comments="")
    (folder / f"{name}.toml").write_text(
        f'kind = "{kind}"\ntyre = "Foreign"\nload_N = {tyre.load}\npressure_bar = {tyre.pressure / 1e5:.4f}\n'
        f'surface = "flat"\ncamber_deg = {camber}\naxes = "{axes}"\nsynthetic = true\n'
    )


def write_campaign(folder: Path, tyre: Tyre, rig: Rig, rng: np.random.Generator) -> None:
    """Write sweeps, pulls and steps into ``folder``, and sweeps at three cambers into a folder beside it."""
    axes, speed, slow = str(rng.choice(["ISO", "adapted SAE"])), rng.uniform(1.5, 4), rng.uniform(0.3, 0.6)
    put = partial(write, tyre=tyre, axes=axes)
    for k, faster in enumerate((1.0, 2.2, 1.0)):
        put(folder, f"sweep_{k}", "slip_sweep", columns=roll(tyre, rig, sweep_drive(rng, faster), speed, 0.0, rng))
    for k in range(3):
        put(folder, f"pull_{k}", "lateral_stiffness", columns=pull(tyre, rig, rng))
    for k in range(2):
        put(folder, f"step_{k}", "slip_step", columns=roll(tyre, rig, step_drive(tyre.length, slow, rng), slow, 0, rng))
    for camber in CAMBERS:
        columns = roll(tyre, rig, sweep_drive(rng), speed, np.deg2rad(camber), rng)
        put(folder.with_name("cambers"), f"sweep_{camber:g}", "slip_sweep", columns=columns, camber=camber)


def one_tyre(seed: int, number: int) -> Row:
    """Measure and fit tyre ``number`` of a ``seed``."""
    return attempted({"seed": seed, "number": number}, partial(_fitted, seed, number))


def _fitted(seed: int, number: int, folder: Path, row: Row) -> None:
    rng = np.random.default_rng([seed, number % 10_000])
    tyre, rig = draw_tyre(number, rng), draw_rig(rng)
    write_campaign(folder / "campaign", tyre, rig, rng)
    (found,) = fit_campaign(folder / "campaign", jobs=1, progress=False).conditions
    told = {
        "C": (found.cornering_stiffness, tyre.c), "K": (found.lateral_stiffness, tyre.k),
        "C_over_K": (found.relaxation_length, tyre.length), "step": (found.direct.get("slip step"), tyre.length),
        "two_rates": (found.direct.get("two sweep rates"), tyre.length),
        "camber_stiffness": (_camber_stiffness(folder / "cambers"), tyre.camber_stiffness),
        "trail": (found.pneumatic_trail, tyre.trail),
    }  # fmt: skip
    for name, (estimate, truth) in told.items():
        if estimate is not None:
            error = estimate.value - truth
            row[name] = {"error": error / truth, "held": bool(abs(error) < 2 * estimate.sd)}
    row["disagree"] = any("disagree" in text for text in found.warnings)
    row |= {"curve": tyre.curve, "load_N": tyre.load, "length_m": tyre.length, "warnings": list(found.warnings)}


def _camber_stiffness(folder: Path) -> Any:
    """Estimate of the camber stiffness; None where recordings at several cambers are refused."""
    try:
        return fit_campaign(folder, jobs=1, progress=False).conditions[0].camber_stiffness  # type: ignore[attr-defined]
    except (InputError, AttributeError):
        return None


def run(*, out: Path, seed: int, tyres: int = 30, brushes: int = 6, workers: int = 2) -> dict[str, Any]:
    """Measure a number of ``tyres`` of smooth curves and of ``brushes``, and fit them."""
    kept = KeptCases(out / "foreign_rig_cases.jsonl", ("seed", "number"))
    numbers = [*range(tyres), *(-1 - k for k in range(brushes))]
    rows = kept.computed([(seed, k) for k in numbers], one_tyre, workers=workers, what="tyres")
    sound = [row for row in rows if not row["error"]]
    return {
        "smooth": summary([row for row in sound if row["number"] >= 0]),
        "brush": summary([row for row in sound if row["number"] < 0]),
        "targets": TARGETS, "errors": [row["error"] for row in rows if row["error"]],
    }  # fmt: skip


def summary(rows: list[Row]) -> dict[str, Any]:
    """Bias (with its standard error) and coverage of each quantity."""
    found: dict[str, Any] = {"routes_disagree": share_of(rows, "disagree")}
    for name in ("C", "K", "C_over_K", "step", "two_rates", "camber_stiffness", "trail"):
        told = [row[name] for row in rows if name in row]
        if len(told) > 1:
            errors = 100 * np.array([one["error"] for one in told])
            spread = float(errors.std(ddof=1))
            found[name] = {
                "bias_percent": round(float(errors.mean()), 3), "sd_percent": round(spread, 3),
                "standard_error_percent": round(spread / len(told) ** 0.5, 3),
                "held_within_2_sd": share_of(told, "held"),
            }  # fmt: skip
    return found
