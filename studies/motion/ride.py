"""A rider who steers a bicycle on a tyre: stabilised speeds, stability margins, and the softest rideable tyre."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy

from bicycle.effects.effect_registry import effect_class
from bicycle.model.eigen import eigensystem, frequency_hz
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from studies.reporting.markdown_text import render_file, write_page
from studies.reporting.plotting import drawing, look
from tyre.ground import schema
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, is_number, shown, unknown
from tyre.ground.files import data_root, read_toml
from tyre.ground.schema import maybe, needed, number, text
from tyre.ground.units import factor_to_si

if TYPE_CHECKING:
    import pandas as pd

EFFECTS = {
    "rider_control": {"roll": "N m/rad", "roll_rate": "N m s/rad", "steer": "N m/rad", "steer_rate": "N m s/rad"},
    "rider_steer_memory": {"steer_integral": "N m/rad s"}, "rider_path": {"heading": "N m/rad", "position": "N m/m"},
}  # fmt: skip
"""Effect -> its gains as columns of a control file, with SI units."""
NESTED = {"k_delta": "N m/rad", "k_phi_dot": "s", "k_phi": "1/s", "k_psi": "1", "k_y": "rad/m"}
"""Columns of loops inside each other (Hess, Moore & Hubbard 2012), and their units."""
COLUMNS = {"run": "", "speed": "m/s"} | {key: si for gains in EFFECTS.values() for key, si in gains.items()} | NESTED
FREQUENCIES = np.geomspace(1e-3, 1e3, 2000)  # rad/s, at which margins are looked for
FACTORS = np.geomspace(1 / 16, 16, 33)  # of the cornering stiffness, among which the softest tyre is looked for
SPEEDS = 61  # of the curve over speed
CONTROL = schema.table(
    {
        needed("description", "the key 'description' is missing: state whose gains these are"): text(blank=False),
        maybe("kind", "assumed"): schema.name_in("kind", ("identified", "designed", "assumed")),
        maybe("source", "not stated"): text(),
        maybe("licence", "not stated"): text(),
        maybe("bicycle", ""): text(),
        maybe("assumes", ""): text(),
        maybe("filter_frequency"): number(above=0),
        maybe("filter_damping"): number(above=0),
        maybe("delay", 0.0): number(least=0),
        maybe("repeats_within", 0.0): number(least=0),
        needed("columns"): schema.list_of(schema.name_in("column", COLUMNS), "must be a list of columns", strict=False),
        maybe("units", []): schema.list_of(text(), "must be a list of units, one for each column"),
        needed("rows"): schema.list_of(schema.list_of(schema.anything, "must be lists"), "must be lists", least=1),
    }
)


@dataclass(frozen=True, eq=False)
class RiderGains:
    """Gains (SI) of a rider at the speeds (m,) of the ``runs``; ``about`` is the description in the control file."""

    name: str  # of the rider
    about: Mapping[str, Any]  # description, source, kind, bicycle and what else the control file says
    runs: Sequence[str]  # name of each run
    speeds: Array  # (m,), m/s
    gains: Mapping[str, Array]  # gain -> (m,), SI, as the parameters of the effects of a rider who steers

    def at(self, speed: float) -> dict[str, float]:
        """Gains at a ``speed`` (m/s): linear between runs, repeats by their mean; outside their range it is refused."""
        low, high = self.speeds.min(), self.speeds.max()
        if not low <= speed <= high:
            raise InputError(f"rider control {self.name}: {speed:g} m/s is outside its speeds, {low:g} to {high:g} m/s")
        order = np.argsort(self.speeds, kind="stable")
        starts = np.flatnonzero(np.diff(self.speeds[order], prepend=-np.inf) > self.about["repeats_within"])
        sizes = np.diff(np.append(starts, len(order)))
        nodes, *means = (np.add.reduceat(x[order], starts) / sizes for x in (self.speeds, *self.gains.values()))
        return {name: float(np.interp(speed, nodes, mean)) for name, mean in zip(self.gains, means, strict=True)}

    def add_rider(self, model: Model, gains: Mapping[str, float], *, delayed: bool = True) -> Model:
        """Add the rider with these ``gains`` (SI) to a ``model``; ``delayed``: with the delay, as Pade."""
        for effect in model.effects:
            if effect.identifier in EFFECTS:
                raise InputError(f"the model has a rider already, [effects.{effect.identifier}]; remove it")
        muscles = {key: self.about[key] for key in ("filter_frequency", "filter_damping") if key in self.about}
        tables = {effect: {key: gains[key] for key in keys if key in gains} for effect, keys in EFFECTS.items()}
        tables["rider_control"] |= muscles
        if memory := tables["rider_steer_memory"]:
            tables["rider_steer_memory"] = {"gain": memory["steer_integral"]}
        tables["rider_delay"] = {"delay": self.about["delay"]} if delayed and self.about["delay"] else {}
        rider = [effect_class(name)(**table) for name, table in tables.items() if table]
        return Model(model.bicycle, (*model.effects, *rider), unusual=model.unusual)


def available_controls() -> tuple[str, ...]:
    """Names of the packaged rider controls."""
    return tuple(sorted(f.name.removesuffix(".toml") for f in data_root().joinpath("riders", "controls").iterdir()))


def read_rider_control(name_or_path: str | Path) -> RiderGains:
    """Read a rider control: a packaged one by name, or a TOML file.

    Raises
    ------
    InputError
        No such control, an unknown column or unit, a row that is not of numbers, or gains that make no rider.
    """
    name, path = str(name_or_path), Path(name_or_path)
    packaged = name in available_controls()
    if not packaged and path.suffix != ".toml":
        raise InputError(f"{unknown('rider control', name, available_controls())}; or give a file (.toml)")
    source = data_root().joinpath("riders", "controls", f"{name}.toml") if packaged else path
    content = read_toml(source, "rider control")
    about = schema.read(CONTROL, content, where=name)
    columns, units, rows = about.pop("columns"), about.pop("units"), about.pop("rows")
    units = units or [COLUMNS[key] for key in columns]
    if "speed" not in columns or len(set(columns)) < len(columns) or len(units) != len(columns):
        raise InputError(f"{name}: columns must hold speed and each gain once, and units one for each of them")
    nested = [key for key in columns if key in NESTED]
    if nested and set(columns) - {"run", "speed"} != set(NESTED):
        raise InputError(f"{name}: columns: {', '.join(NESTED)} belong together, without other gains")
    if not nested and not set(columns) & {"roll", "roll_rate"}:
        raise InputError(
            f"{name}: columns: give a gain on roll or roll_rate; no rider stabilises a bicycle without one"
        )
    for place, row in enumerate(rows):
        numbers = [value for key, value in zip(columns, row, strict=False) if key != "run"]
        if len(row) != len(columns) or not all(is_number(value) and math.isfinite(value) for value in numbers):
            raise InputError(f"{name}: rows, number {place + 1} = {shown(row)} must hold {len(columns)} finite numbers")
    by_column = {}
    for key, unit, values in zip(columns, units, zip(*rows, strict=True), strict=True):
        factor = 1 if unit == COLUMNS[key] else factor_to_si(unit, COLUMNS[key], where=f"{name}: {key}")
        by_column[key] = np.array(values) if key == "run" else float(factor) * np.array(values, float)
    runs = by_column.pop("run", range(1, len(rows) + 1))
    speeds = by_column.pop("speed")
    if (speeds <= 0).any():
        raise InputError(f"{name}: speed = {speeds.min():g} m/s must be above 0")
    gains = _combine_nested_loops(by_column) if nested else by_column
    return RiderGains(path.stem, about, [str(run) for run in runs], speeds, gains)


def _combine_nested_loops(loops: Mapping[str, Array]) -> dict[str, Array]:
    """Gains on each signal, of loops inside each other: T = k_delta (k_phi_dot (k_phi (...) - phi') - delta)."""
    inner = -loops["k_delta"] * loops["k_phi_dot"]
    roll = inner * loops["k_phi"]
    heading = roll * loops["k_psi"]
    gains = (-loops["k_delta"], inner, roll, heading, heading * loops["k_y"])
    return dict(zip(("steer", "roll_rate", "roll", "heading", "position"), gains, strict=True))


def margins(rider: RiderGains, model: Model, gains: Mapping[str, float], speed: float) -> dict[str, float]:
    """Margins of a rider's loop cut at the torque, at a ``speed`` (m/s), with the exact delay; NaN: nothing limits.

    L = -1 is the limit; crossings are those of ``control.stability_margins``. ``gain_up`` and ``gain_down`` are factors
    on all gains; the delay is the least phase that may be lost over its frequency.
    """
    import control

    linear = rider.add_rider(model, gains, delayed=False).linear_model()
    state, inputs, _ = linear.matrices_at(speed)
    torque, applied = linear.states.index("rider_torque"), inputs[:, linear.inputs.index("steer_torque")]
    state[:, torque] -= applied  # his torque no longer acts: what is applied in its place comes back as L
    turned = 1j * FREQUENCIES[:, None, None] * np.eye(len(state)) - state
    returned = -np.linalg.solve(turned, np.broadcast_to(applied[:, None], (*turned.shape[:2], 1)))[:, torque, 0]
    loop = control.FRD(returned * np.exp(-1j * FREQUENCIES * rider.about["delay"]), FREQUENCIES)
    gain, phase, _, _, at, _ = (np.atleast_1d(part) for part in control.stability_margins(loop, returnall=True))
    return {
        "gain_up": float(min(gain[gain > 1], default=math.nan)),
        "gain_down": float(max(gain[(gain > 0) & (gain < 1)], default=math.nan)),
        "phase_deg": float(min(np.abs(phase), default=math.nan)),
        "delay_s": float(min(np.radians(phase % 360) / at, default=math.nan)),
    }


@dataclass(frozen=True, eq=False)
class Ride:
    """A rider on one bicycle and tyre, called ``label``, over ``speeds`` (m,) in m/s."""

    label: str  # name in table and figure
    rider: RiderGains  # gains at speeds
    model: Model  # bicycle and tyre, without the rider's control
    speeds: Array  # (m,), m/s, rising

    def root(self, gains: Mapping[str, float], speed: float) -> tuple[complex, dict[str, float]]:
        """Rightmost root (1/s, Im >= 0) at a ``speed`` and the share of each role of states in it, largest first."""
        linear = self.rider.add_rider(self.model, gains).linear_model()
        values, right, left = eigensystem(linear.state_matrix([speed]))
        place = int(np.lexsort((values[0].imag, values[0].real))[-1])
        weights = np.abs(left[0, place] * right[0, :, place])
        shares: dict[str, float] = {}
        for state, weight in zip(linear.declared.states, weights / weights.sum(), strict=True):
            shares[state.role] = shares.get(state.role, 0.0) + float(weight)
        return complex(values[0, place]), dict(sorted(shares.items(), key=lambda pair: -pair[1]))

    def growth(self, speed: float) -> float:
        """Largest real part (1/s) at a ``speed``, gains interpolated."""
        return self.root(self.rider.at(speed), speed)[0].real

    @cached_property
    def curve(self) -> Array:
        """Largest real part (1/s) at each of the speeds."""
        return np.array([self.growth(speed) for speed in self.speeds])

    @cached_property
    def held(self) -> tuple[tuple[float, float], ...]:
        """Ranges of stabilised speeds (m/s)."""
        signs = np.flatnonzero(np.diff(self.curve < 0))
        inner = [scipy.optimize.brentq(self.growth, *self.speeds[k : k + 2], xtol=1e-4) for k in signs]
        ends = [float(speed) for speed in (self.speeds[0], *inner, self.speeds[-1])]
        ends = ends[int(self.curve[0] >= 0) : len(ends) - int(self.curve[-1] >= 0)]
        return tuple(zip(ends[::2], ends[1::2], strict=True))

    @cached_property
    def worst(self) -> tuple[float, complex, dict[str, float]]:
        """Speed, root and shares where the growth over the speeds is largest: what limits."""
        speed = float(self.speeds[self.curve.argmax()])
        return speed, *self.root(self.rider.at(speed), speed)

    @cached_property
    def runs(self) -> pd.DataFrame:
        """A row per run: growth at its own speed, margins where it holds, and the softest front tyre it holds."""
        import pandas as pd

        rows = []
        for k, (run, speed) in enumerate(zip(self.rider.runs, self.rider.speeds, strict=True)):
            gains = {name: float(values[k]) for name, values in self.rider.gains.items()}
            root, shares = self.root(gains, speed)
            row = {
                "case": self.label,
                "run": run,
                "speed_m_s": float(speed),
                "growth_1_s": root.real,
                "frequency_Hz": float(frequency_hz(root)),
                "motion": next(iter(shares)),
                "softest_front_N_rad": self.find_softest_tyre(gains, speed),
            }
            rows.append(row | (margins(self.rider, self.model, gains, speed) if root.real < 0 else {}))
        return pd.DataFrame(rows, columns=[*row, "gain_up", "gain_down", "phase_deg", "delay_s"])

    def find_softest_tyre(self, gains: Mapping[str, float], speed: float) -> float:
        """Front cornering stiffness (N/rad), the rear in proportion, above which the rider holds.

        NaN without a tyre, inf if no stiffness looked at is enough, 0 if all are.
        """
        family = ModelFamily(self.rider.add_rider(self.model, gains))
        keys, factors = [key for key in family.base if ".cornering_stiffness." in key], FACTORS  # rear, front
        if not keys:
            return math.nan
        for _ in range(2):  # the second time between the last that falls and its neighbour
            numbers = {key: factors * family.base[key] for key in keys}
            falls = np.flatnonzero(np.linalg.eigvals(family.state_matrices(numbers, [[speed]])[:, 0]).real.max(1) >= 0)
            if not falls.size or falls[-1] == len(factors) - 1:
                return math.inf if falls.size else 0.0
            factors = np.geomspace(factors[falls[-1]], factors[falls[-1] + 1], 33)
        return float(factors[0] * family.base[keys[-1]])


def rides(rider: RiderGains, models: Mapping[str, Model], speeds: Array | None = None) -> tuple[Ride, ...]:
    """A rider on several models by their label, over ``speeds`` (m/s) or all that the runs cover."""
    if speeds is None:
        speeds = np.linspace(rider.speeds.min(), rider.speeds.max(), SPEEDS)
    return tuple(Ride(label, rider, model, np.unique(speeds)) for label, model in models.items())


def table(compared: Sequence[Ride]) -> list[dict[str, str]]:
    """Rows of the table of cases: ranges held, runs held, and median margins of these."""
    rows = []
    for ride in compared:
        middle, runs_held = ride.runs.median(numeric_only=True), int((ride.runs.growth_1_s < 0).sum())
        rows.append(
            {
                "case": ride.label,
                "stabilised m/s": ", ".join(f"{a:.2f} to {b:.2f}" for a, b in ride.held) or "none",
                "runs stabilised": f"{runs_held} of {len(ride.runs)}",
                "gain up": _number(middle.gain_up, ".2f"),
                "gain down": _number(middle.gain_down, ".2f"),
                "phase °": _number(middle.phase_deg, ".0f"),
                "delay ms": _number(1e3 * middle.delay_s, ".0f"),
            }
        )
    return rows


def _number(value: float, form: str) -> str:
    return "-" if math.isnan(value) else "never" if math.isinf(value) else format(value, form)


def render_rides(compared: Sequence[Ride], template: str) -> str:
    """Fill a ``template`` for the terminal (.txt.j2) or the page (.md.j2)."""
    rider = compared[0].rider
    tyred = [ride for ride in compared if all(effect.identifier != "no_slip" for effect in ride.model.effects)]
    content = {
        "rider": rider,
        "rides": compared,
        "range": (rider.speeds.min(), rider.speeds.max()),
        "table": table(compared),
        "tyred": tyred,
        "softest": [ride.runs.softest_front_N_rad.max(skipna=False) for ride in compared],
        "others": [ride.label for ride in compared if rider.about["bicycle"] not in ("", ride.model.bicycle.name)],
        "upright": [r.label for r in tyred if all(effect.identifier != "camber_thrust" for effect in r.model.effects)],
    }
    filters = {"number": _number, "hertz": lambda root: float(frequency_hz(root))}
    return render_file("studies.reporting", template, content, escaped="md" in template, filters=filters)


def write_ride(compared: Sequence[Ride], out: Path) -> None:
    """Write figure and page into ``out``."""
    name = f"Rider {compared[0].rider.name}"
    with drawing(out / "ride", width=8.5, height=6.4) as canvas:
        growth, delay = canvas.subplots(2, 1, sharex=True)
        for place, ride in enumerate(compared):
            case_look, runs = look(place), ride.runs
            growth.plot(ride.speeds, ride.curve, color=case_look.colour, linestyle=case_look.line, label=ride.label)
            marks = {"color": case_look.colour, "marker": "os^Dv"[place % 5], "linestyle": "none", "markersize": 4}
            growth.plot(runs.speed_m_s, runs.growth_1_s, **marks)
            delay.plot(runs.speed_m_s, 1e3 * runs.delay_s, **marks)
        growth.axhline(0, color="black", linewidth=0.8)
        growth.set(ylabel="Maximum growth rate, 1/s", title=f"{name} (marks: each run's own gains)")
        growth.legend()
        delay.set(ylabel="Delay margin, ms", xlabel="Speed, m/s")
        delay.set_ylim(bottom=0)
    write_page(out, title=name, text=render_rides(compared, "ride.md.j2"))
