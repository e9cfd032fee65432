"""Numbers that others published beside those of velotyre: rows of the page "Who computed what, and what we get".

``ROWS`` and ``SIGNS`` are what ``test_papers.py`` checks and what the documentation prints.
"""

import csv
import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from bicycle import Bicycle, LinearModel, Model, critical_speeds, effect_class, load_bicycle, modes, registry
from bicycle.model import read_model

HERE = Path(__file__).parent
EXAMPLES = HERE.parents[1] / "docs" / "examples"
FOOT = 0.3048  # m


@dataclass(frozen=True)
class Row:
    """One published quantity, at several speeds or of several entries."""

    paper: str
    quantity: str
    unit: str
    published: tuple[str, ...]  # as printed
    compute: Callable[[], Sequence[float]] = field(repr=False)
    # what the difference may be beyond half a unit of the last printed digit, absolute and relative
    slack: float = 0.0
    share: float = 0.0

    @property
    def here(self) -> tuple[float, ...]:
        """The same by velotyre."""
        return tuple(float(value) for value in self.compute())

    @property
    def difference(self) -> float:
        """Largest difference to a printed number."""
        return max(abs(here - float(text)) for here, text in zip(self.here, self.published, strict=True))

    @property
    def allowed(self) -> tuple[float, ...]:
        """Largest difference to each printed number."""
        return tuple(half_unit(text) + self.slack + self.share * abs(float(text)) for text in self.published)


def half_unit(text: str) -> float:
    """Half a unit of the last digit of a number printed as ``text``."""
    return 0.5 * 10.0 ** int(Decimal(text).as_tuple().exponent)


def canonical(bicycle: Bicycle) -> dict[str, np.ndarray]:
    """Matrices of M q'' + v C1 q' + (g K0 + v^2 K2) q = T, q = (lean, steer)."""
    found, zero = Model(bicycle).linear_model().ranges[0].matrices, np.zeros((4, 4))
    constant, linear, square = (found.dynamics.get(power, zero) for power in (0, 1, 2))
    return {
        "M": found.mass[:2, :2], "C1": -linear[:2, :2], "K0": -constant[:2, 2:] / bicycle["g"], "K2": -square[:2, 2:],
    }  # fmt: skip


def part_of(model: Model, mode: str, part: str, speeds: Sequence[float]) -> list[float]:
    """Real (``re``) or imaginary (``im``) part of a named mode along speed, 1/s."""
    return [values[0][part == "im"] for values in modes(model, list(speeds)).to_dict()[mode]]


def critical(model: Model) -> list[float]:
    """Critical speeds, m/s."""
    return [one.speed for one in critical_speeds(model.linear_model())]


def spoken(speeds: Sequence[float]) -> str:
    """The ends and the number of ``speeds``."""
    return f"{len(speeds)} speeds, {min(speeds):.3g} to {max(speeds):.3g}"


def meijaard() -> Iterator[Row]:
    paper, table = "Meijaard, Papadopoulos, Ruina & Schwab (2007)", json.loads((HERE / "meijaard2007.json").read_text())
    rows = [row for row in table["eigenvalues"] if row["speed_m_s"] > 0]
    model = Model(load_bicycle("benchmark"))
    for mode in ("weave", "capsize", "castering"):
        held = [row for row in rows if mode in row]
        speeds = [row["speed_m_s"] for row in held]
        printed = tuple(f"{np.atleast_1d(row[mode])[0]:.12f}" for row in held)
        yield Row(paper, f"{mode}, real part, at {spoken(speeds)} m/s", "1/s", printed,
                  lambda mode=mode, speeds=speeds: part_of(model, mode, "re", speeds), 1e-10)  # fmt: skip

    printed = tuple(f"{table[key]:.14f}" for key in ("weave_speed_m_s", "capsize_speed_m_s"))
    yield Row(paper, "stable from, to", "m/s", printed, lambda: critical(model), 1e-10)


def sharp1971() -> Iterator[Row]:
    table = json.loads((HERE / "sharp1971.json").read_text(), parse_float=str)["published"]
    speeds, model = [FOOT * float(text) for text in table["speed_ft_s"]], read_model("sharp1971")
    for key in ("capsize_re", "weave_re", "weave_im", "wobble_re", "wobble_im"):
        mode, part = key.split("_")
        words = f"{mode}, {'real' if part == 're' else 'imaginary'} part, at {spoken(speeds)} m/s"
        yield Row("Sharp (1971)", words, "1/s", tuple(map(str, table[key])),
                  lambda mode=mode, part=part: part_of(model, mode, part, speeds), 0.015)  # fmt: skip


def astrom() -> Iterator[Row]:
    paper, ridden = "Åström, Klein & Lennartsson (2005)", read_model("astrom2005").bicycle
    frame = {"mB": 12.0, "xB": 0.439, "zB": -0.579, "IBxx": 0.476, "IBxz": 0.274, "IBzz": 0.527}  # without rider
    entries = [("M", 0, 0), ("M", 0, 1), ("M", 1, 1), ("C1", 0, 1), ("C1", 1, 0), ("C1", 1, 1),
               ("K0", 0, 0), ("K0", 0, 1), ("K0", 1, 1), ("K2", 0, 1), ("K2", 1, 1)]  # fmt: skip
    printed = {
        "with the rider": "96.8 3.57 0.258 50.8 0.436 2.20 901.0 35.17 12.03 87.06 3.50",
        "of the bicycle alone": "6.00 0.472 0.152 5.84 0.436 0.666 91.72 7.51 2.57 9.54 0.848",
    }
    for (whose, text), bicycle in zip(printed.items(), (ridden, ridden.replace(**frame)), strict=True):

        def sizes(bicycle=bicycle) -> list[float]:
            found = canonical(bicycle)
            return [abs(found[name][i, k]) * (bicycle["g"] if name == "K0" else 1.0) for name, i, k in entries]

        # with the rider the printed parameters, of two to three digits, do not give the last printed ones
        share = 2e-3 if bicycle is ridden else 2e-4
        yield Row(paper, f"coefficients of M, C, K0, K2 {whose}, sizes", "SI", tuple(text.split()), sizes, share=share)
    yield Row(paper, "with the rider, stable from, to", "m/s", ("5.96", "10.36"),
              lambda: critical(read_model("astrom2005")), share=1e-3)  # fmt: skip


def skate() -> Iterator[Row]:
    paper = "Kooijman, Meijaard, Papadopoulos, Ruina & Schwab (2011)"
    yield Row(paper, "two-mass skate, weave becomes stable at", "m/s", ("2.841",),
              lambda: critical(read_model("kooijman2011")))  # fmt: skip


def sharp2004() -> Iterator[Row]:
    bicycle = read_model("sharp2004").bicycle
    paper = "Sharp, Evangelou & Limebeer (2004), sheets of Passigato et al. (2020)"
    yield Row(paper, "static load of the rear and the front wheel", "N", ("1272.19", "1172.57"),
              lambda: bicycle.static_loads, 0.02)  # fmt: skip
    yield Row(paper, "wheelbase", "m", ("1.41",), lambda: [bicycle["w"]])


ROWS = (*meijaard(), *astrom(), *skate(), *sharp1971(), *sharp2004())


@dataclass(frozen=True)
class Implied:
    """Whipple coefficients that a thesis implies by a value and its difference in per cent, both rounded."""

    rider: str
    inside: int
    of: int


def moore() -> list[Implied]:
    """Riders J, C and L of Moore (2012): coefficients of velotyre within what the printed digits leave open."""
    with (EXAMPLES / "kinds" / "davis_canonical_coefficients.csv").open() as file:
        rows = [row for row in csv.DictReader(file) if not row["coefficient"].startswith("H")]
    counted, place = [], {"phi": 0, "delta": 1}
    for rider, name in (("J", "rigid_rider_joined"), ("C", "davis_c"), ("L", "davis_l")):
        found, inside, own = canonical(load_bicycle(name)), 0, [row for row in rows if row["rider"] == rider]
        for row in own:
            matrix, i, k = row["coefficient"].split("_")
            value, percent = row["value"], row["difference_percent"]
            corners = [
                (float(value) + s * half_unit(value)) / (1 + (float(percent) + t * half_unit(percent)) / 100)
                for s in (-1, 1) for t in (-1, 1)
            ]  # fmt: skip
            inside += bool(min(corners) <= found[matrix][place[i], place[k]] <= max(corners))
        counted.append(Implied(rider, inside, len(own)))
    return counted


def of_sharp(q: dict[str, float]) -> LinearModel:
    """The model of Sharp's (1971) parameters: two bodies, wheels that spin in them, one relaxation length."""
    c, s = np.cos(q["varepsilon"]), np.sin(q["varepsilon"])
    turned = np.array([[c, s], [-s, c]])  # the front's inertias are along the steer axis and across it
    front = turned @ np.diag([q["I_fx"], q["I_fz"]]) @ turned.T
    values = {
        "w": q["b"] + q["l"], "c": q["a_n"] / c, "lam": q["varepsilon"], "g": q["g"],
        "rR": q["r_r"], "mR": 0.0, "IRxx": 0.0, "IRyy": q["i_ry"], "rF": q["r_f"], "mF": 0.0, "IFxx": 0.0,
        "IFyy": q["i_fy"], "xB": q["b"], "zB": -q["h"], "mB": q["m_r"], "IBxx": q["I_rx"], "IBzz": q["I_rz"],
        "IBxz": q["C_rxz"], "xH": q["b"] + q["k"], "zH": -q["j"], "mH": q["m_f"],
        "IHxx": front[0, 0], "IHzz": front[1, 1], "IHxz": front[0, 1],
    }  # fmt: skip
    effects = {
        "relaxation_length": {"cornering_stiffness": {"rear": q["C_r1"], "front": q["C_f1"]},
                              "relaxation_length": q["sigma"]},
        "camber_thrust": {"camber_stiffness": {"rear": q["C_r2"], "front": q["C_f2"]}},
        "steer_damper": {"damping": q["C_delta"]},
    }  # fmt: skip
    bicycle = Bicycle("Sharp", values, kind="motorcycle", unusual=True)
    return Model(bicycle, [effect_class(name)(**table) for name, table in effects.items()]).linear_model()


@dataclass(frozen=True)
class Code:
    """Eigenvalues of another author's code, and the largest relative difference of one of them."""

    code: str
    cases: int
    difference: float


def other_code() -> Code:
    """Sharp's (1971) equations by another author: every eigenvalue of three motorcycles at twelve speeds."""
    table, worst, count = json.loads((HERE / "sharp_equations.json").read_text()), 0.0, 0
    for case in table["cases"]:
        model = of_sharp(case["parameters"])
        for row in case["rows"]:
            theirs, count = np.array([complex(*pair) for pair in row["eigenvalues"]]), count + 1
            apart = np.abs(model.eigenvalues(row["speed_m_s"])[:, None] - theirs)
            mine, other = linear_sum_assignment(apart)
            worst = max(worst, float((apart[mine, other] / np.abs(theirs[other])).max()))
    return Code("Sharp (1971) in aerotinez/trajopt, symbolic, three motorcycles at twelve speeds", count, worst)


SPEEDS_1994 = (10.0, 15.0, 20.0, 25.0, 30.0, 35.0, 40.0, 45.0, 50.0, 53.5)  # m/s
STIFF = ("front_compliance", "rear_compliance")


def sharp1994(
    mode: str, *, hands_on: bool = False, rigid: bool = False, force: float = 0.0, **signs: float
) -> np.ndarray:
    """Real parts (1/s) along ``SPEEDS_1994`` under a drive (> 0) or brake ``force`` (N).

    ``signs`` are those of the products of inertia, frame and rider.
    """
    model = read_model("sharp1994_hands_on" if hands_on else "sharp1994")
    effects = {e.identifier: e for e in model.effects if not (rigid and e.identifier in STIFF)}
    if force:
        drive = {"drive_force": force} if force > 0 else {"brake_force": -force}
        tables = tyres_1994(*loads_1994(model.bicycle, force)) | {"longitudinal": drive}
        effects |= {name: effect_class(name)(**table) for name, table in tables.items()}
    model = Model(model.bicycle, list(effects.values()), unusual=True)
    if signs:
        model = with_products(model, **signs)
    return np.array(part_of(model, mode, "re", SPEEDS_1994))


def loads_1994(bicycle: Bicycle, force: float = 0.0) -> tuple[float, float]:
    """Loads (N) of the rear and the front wheel; a ``force`` along the road acts against inertia at the mass centre."""
    parts = [(bicycle["mR"], bicycle["rR"]), (bicycle["mB"], -bicycle["zB"]), (bicycle["mH"], -bicycle["zH"])]
    height = sum(mass * z for mass, z in parts) / sum(mass for mass, _ in parts)
    rear, front = bicycle.static_loads
    return rear + force * height / bicycle["w"], front - force * height / bicycle["w"]


def tyres_1994(rear: float, front: float) -> dict[str, dict[str, Any]]:
    """Tyre effects of Sharp's (1994) set at two loads (N), polynomials of the definition file, lowest power first."""

    def at(of_rear: Sequence[float], of_front: Sequence[float]) -> dict[str, float]:
        return {"rear": float(np.polyval(of_rear[::-1], rear)), "front": float(np.polyval(of_front[::-1], front))}

    length = at((0.03594, 1.941e-4, -5.667e-8, 5.728e-12), (0.1012, 1.297e-4, -3.267e-8))
    cornering = at((-92.9, 23.129, -4.663e-3, -6.457e-7, 1.887e-10), (-300, 28.577, -0.0143, 1.431e-6, 3.347e-10))
    aligning = at((9, 0.3573, 3.378e-5), (-0.281, 0.2442, 8.575e-5))
    return {
        "relaxation_length": {"cornering_stiffness": cornering, "relaxation_length": length},
        "aligning_moment": {"aligning_stiffness": aligning, "relaxation_length": length},
        "camber_thrust": {"camber_stiffness": at((27.38, 0.9727, -4e-6), (-13.25, 1.302, -1.39e-4))},
        "twisting_torque": {"twisting_stiffness": at((2.056, 0.01282, 4.928e-6), (2.788, 0.0165, 3.9e-6))},
        "overturning_moment": {"overturning_stiffness": at((0, 0.07), (0, 0.06))},
    }


def with_products(model: Model, *, frame: float, rider: float) -> Model:
    """The model with other signs of the products of inertia than the packaged ones (both -1)."""
    lean = next(e for e in model.effects if e.identifier == "rider_lean")
    shift = 7.4 * (frame + 1) + 0.26 * (rider + 1)
    bicycle = model.bicycle.replace(IBxz=model.bicycle["IBxz"] + shift, allow_unusual=True)
    numbers = {p.name: getattr(lean, p.name) for p in lean.parameters} | {"Ixz": 0.26 * rider}
    others = [e for e in model.effects if e is not lean]
    return Model(bicycle, [*others, effect_class("rider_lean")(**numbers)], unusual=True)


def tyred(name: str, **effects: Any) -> LinearModel:
    """A bicycle on tyres of 110 N/deg and a relaxation length of 110 mm, with camber thrust of 0.65 of the load."""
    bicycle = load_bicycle(name)
    rear, front = bicycle.static_loads
    tables = {
        "relaxation_length": {"cornering_stiffness": 110 * 180 / np.pi, "relaxation_length": 0.11},
        "camber_thrust": {"camber_stiffness": {"rear": 0.65 * rear, "front": 0.65 * front}},
    } | effects
    return Model(bicycle, tuple(effect_class(effect)(**table) for effect, table in tables.items())).linear_model()


def arms(**given: float) -> dict[str, dict[str, float]]:
    return {"rider_arms": {"inertia": 0.0, "stiffness": 0.0, "damping": 0.0} | given}


def slowest_real(model: LinearModel, speed: float) -> float:
    """The real eigenvalue farthest to the right, 1/s: capsize."""
    values = model.eigenvalues(speed)
    return float(values[np.abs(values.imag) < 1e-9].real.max())


def weave(model: LinearModel, speed: float) -> complex:
    """The least stable pair slower than 4 Hz, 1/s."""
    values = model.eigenvalues(speed)
    slow = values[(values.imag > 1e-6) & (values.imag < 8 * np.pi)]
    return complex(slow[slow.real.argmax()])


SPEEDS_RIDDEN = (7.0, 9.0, 12.0, 15.0, 20.0)  # m/s


def ridden(root: Callable[[LinearModel, float], complex], **effects: Any) -> Callable[..., np.ndarray]:
    """Real part of a root of the benchmark bicycle on tyres along ``SPEEDS_RIDDEN``; ``effects`` as ``tyred`` has."""
    model = tyred("benchmark", **effects)
    return lambda **_: np.array([np.real(root(model, speed)) for speed in SPEEDS_RIDDEN])


@dataclass(frozen=True)
class Sign:
    """What the literature says grows or falls, and the real parts here (1/s)."""

    paper: str
    says: str
    cases: dict[str, Callable[..., np.ndarray]]  # real parts by the name of the case
    holds: Callable[..., Any] = field(repr=False)  # of the real parts, by name
    model: str = "sharp1994"
    speeds: tuple[float, ...] = SPEEDS_1994

    def here(self, **signs: float) -> dict[str, np.ndarray]:
        """Real parts along ``speeds``; ``signs`` are those of the products of inertia of Sharp's motorcycle."""
        return {name: case(**signs) for name, case in self.cases.items()}


def sharp(mode: str, **arguments: Any) -> Callable[..., np.ndarray]:
    """:func:`sharp1994`, to be called with the signs alone."""
    return partial(sharp1994, mode, **arguments)


SIGNS = (
    Sign("Sharp (1971), Sharp (1994)", "on rigid frames the damping of wobble decreases from 10 to 45 m/s",
         {"rigid": sharp("wobble", rigid=True)}, lambda rigid: (np.diff(rigid[:8]) > 0).all()),
    Sign("Spierings (1981), Sharp (1994)", "front-frame compliance reverses it from 30 m/s on",
         {"flexible": sharp("wobble")}, lambda flexible: (np.diff(flexible[4:]) < 0).all()),
    Sign("Sharp (1994)", "hands on the handlebar increase the damping of wobble at every speed",
         {"off": sharp("wobble"), "on": sharp("wobble", hands_on=True)}, lambda off, on: (on < off).all()),
    Sign("Sharp (1994)", "hands on the handlebar decrease the damping of weave from 30 m/s on",
         {"off": sharp("weave"), "on": sharp("weave", hands_on=True)}, lambda off, on: (on > off)[4:].all()),
    Sign("Bulsink, Doria, van de Belt & Koopman (2015)", "a tyre's twisting torque (3 N m/rad) stabilises capsize",
         {"without": ridden(slowest_real), "with": ridden(slowest_real, twisting_torque={"twisting_stiffness": 3.0})},
         lambda **of: (of["with"] < of["without"]).all(), "benchmark on tyres", SPEEDS_RIDDEN),
    Sign("Bulsink et al. (2015), Doria & Tognazzo (2014)", "stiffness of the arms (10 N m/rad) destabilises capsize",
         {"without": ridden(slowest_real), "with": ridden(slowest_real, **arms(stiffness=10.0))},
         lambda **of: (of["with"] > of["without"]).all(), "benchmark on tyres", SPEEDS_RIDDEN),
    Sign("Bulsink et al. (2015), Doria & Tognazzo (2014)", "damping of the arms (2 N m s/rad) destabilises weave",
         {"without": ridden(weave), "with": ridden(weave, **arms(damping=2.0))},
         lambda **of: (of["with"] > of["without"]).all(), "benchmark on tyres", SPEEDS_RIDDEN),
)  # fmt: skip
if "longitudinal" in registry():
    SIGNS += (
        Sign("Evangelou (2003)", "braking (1000 N) decreases the damping of wobble, drive (500 N) increases it",
             {"brake": sharp("wobble", force=-1000.0), "coast": sharp("wobble"), "drive": sharp("wobble", force=500.0)},
             lambda brake, coast, drive: (brake > coast).all() and (drive < coast).all()),
    )  # fmt: skip

UNREAD = {
    "Limebeer & Sharp (2006), IEEE Control Systems Magazine 26(5)": "root loci are figures; no table was found",
    "Sharp (1994), Vehicle NVH and Refinement": "the paper; its numbers come from a definition file of 2002",
    "Sharp, Evangelou & Limebeer (2004), Multibody System Dynamics 12":
        "root loci are figures; the numbers come from the sheets of another model",
    "Evangelou (2003), thesis": "all but the abstract",
    "Plöchl, Edelmann, Angrosch & Ott (2012), Vehicle System Dynamics 50": "tables",
    "Klinger, Nusime, Edelmann & Plöchl (2014), Vehicle System Dynamics 52": "tables",
    "Bulsink, Doria, van de Belt & Koopman (2015), Advances in Mechanical Engineering 7(12)":
        "tables; the signs of its abstract are tested",
}  # fmt: skip


def shown(values: Iterable[float | str], most: int = 11) -> str:
    """Numbers of a cell of the page."""
    cells = [f"{float(value):.4g}" for value in values]
    return ", ".join(cells if len(cells) <= most else [*cells[: most - 1], "…"])


def page() -> dict[str, Any]:
    """What the page shows."""
    return {
        "rows": [
            {"paper": r.paper, "quantity": r.quantity, "unit": r.unit, "published": shown(r.published),
             "here": shown(r.here), "difference": r.difference} for r in ROWS
        ],
        "moore": moore(),
        "code": other_code(),
        "signs": [
            {"paper": s.paper, "says": s.says, "where": f"{s.model}, {shown(s.speeds)} m/s",
             "here": {name: shown(values) for name, values in s.here().items()}} for s in SIGNS
        ],
        "unread": UNREAD,
    }  # fmt: skip
