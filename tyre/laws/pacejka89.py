"""Pacejka-89 coefficients: the tyre that they describe, and their files (TOML, YAML, JSON, MATLAB)."""

import json
import re
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, is_number
from tyre.ground.files import data_root, read_text, read_toml, refuse_deep
from tyre.ground.schema import Check, list_of, maybe, needed, number, read, table, text
from tyre.ground.units import PASCAL_PER_BAR
from tyre.laws.formula_tyre import FormulaTyre
from tyre.laws.magic_formula import Curve, magic_formula_derivatives, saturation
from tyre.measured.plausible import LARGEST, SMALLEST

DEGREE = np.pi / 180.0
LOADS = (200.0, 300.0, 400.0, 600.0, 800.0, 1000.0)  # N, of a bicycle's wheel, at which a fit is looked at
SLIP_UNITS = {"deg": DEGREE, "rad": 1.0}


@dataclass(frozen=True)
class _Formula:
    """Magic Formula at one load and camber, in the units of the coefficients."""

    shape: float  # C
    peak: Array  # D, N or N m
    slope: Array  # B C D, N or N m per unit of slip
    curvature: Array  # E
    shift: Array  # Sh, in the unit of slip
    offset: Array  # Sv, N or N m

    def value(self, slip: Array) -> Array:
        return np.asarray(self.peak * self._unit_curve(slip).value + self.offset)

    @property
    def gradient(self) -> Array:
        """Slope over slip at zero slip (BCD is its value at X = 0, up to 2 % larger in published sets)."""
        return np.asarray(self.slope / self.shape * self._unit_curve(0.0).by_slip)

    def _unit_curve(self, slip: Array | float) -> Curve:
        reduced = self.slope / (self.shape * self.peak) * (slip + self.shift)
        return magic_formula_derivatives(reduced, shape_factor=self.shape, curvature_factor=self.curvature)


@dataclass(frozen=True)
class Pacejka89:
    """One fit: a tyre at one inflation pressure."""

    label: str  # what the authors call the set
    pressure: float  # Pa
    load_max: float  # largest vertical load (N) for which the authors use the set
    lateral_force_coefficients: tuple[float, ...]  # a0 ... a13, lateral force in N
    aligning_moment_coefficients: tuple[float, ...] | None = None  # c0 ... c17, aligning moment in N m
    slip_unit: str = "deg"  # unit of slip inside the formula
    # a112, N/(deg kN^2): lateral force of camber with the square of the load, which sets with a111 in place of a11 have
    camber_by_square: float = 0.0
    # K_y of a lateral stiffness test at this pressure, N/m, which no formula of slip holds; None if not known
    lateral_stiffness: float | None = None

    def __post_init__(self) -> None:
        for letter, numbers in (("a", self.lateral_force_coefficients), ("c", self.aligning_moment_coefficients or ())):
            for place, value in enumerate(numbers):
                if not abs(value) <= LARGEST:
                    raise InputError(
                        f"{self.label}: {letter}{place} = {value:g} must be a number up to {LARGEST:g} in size"
                    )

    def lateral_force(self, *, slip_angle: ArrayLike, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """Lateral force."""
        return self._lateral(self._check_load(load), camber).value(self._slip(slip_angle))

    def aligning_moment(self, *, slip_angle: ArrayLike, load: ArrayLike, camber: ArrayLike = 0.0) -> Array:
        """Aligning moment."""
        return self._aligning(self._check_load(load), camber).value(self._slip(slip_angle))

    def linear(self, *, load: ArrayLike) -> dict[str, Array]:
        """Return the slopes near straight running, over camber the mean of both sides; the load is not checked."""
        fz, unit, a = (
            np.asarray(load, dtype=np.float64) / 1e3,
            SLIP_UNITS[self.slip_unit],
            self.lateral_force_coefficients,
        )
        slope = self._lateral(fz, 0.0).gradient
        by_camber = slope * a[8] + a[11] * fz + self.camber_by_square * fz**2
        quantities = {"cornering_stiffness": slope / unit, "camber_stiffness": by_camber / DEGREE}
        if self.lateral_stiffness is not None:
            quantities["lateral_stiffness"] = np.full(np.shape(load), self.lateral_stiffness)
            quantities["relaxation_length"] = quantities["cornering_stiffness"] / self.lateral_stiffness
        if self.aligning_moment_coefficients is not None:
            c, slope = self.aligning_moment_coefficients, self._aligning(fz, 0.0).gradient
            quantities["pneumatic_trail"] = -slope / unit / quantities["cornering_stiffness"]
            by_camber = (slope * c[11] + c[14] * fz**2 + c[15] * fz) / DEGREE
            quantities["twisting_stiffness"] = (
                by_camber + quantities["pneumatic_trail"] * quantities["camber_stiffness"]
            )
        return quantities

    def _slip(self, slip_angle: ArrayLike) -> Array:
        return np.asarray(slip_angle, dtype=np.float64) / SLIP_UNITS[self.slip_unit]

    def _check_load(self, load: ArrayLike) -> Array:
        """The load in kN."""
        force = np.asarray(load, dtype=np.float64)
        if not ((force > 0.0) & (force <= self.load_max)).all():
            raise InputError(
                f"{self.label}: load of {np.min(force):g} to {np.max(force):g} N is outside of the fit, which holds "
                f"above 0 and up to {self.load_max:g} N"
            )
        return force / 1e3

    def _lateral(self, fz: Array, camber: ArrayLike) -> _Formula:
        a, lean = self.lateral_force_coefficients, np.asarray(camber, dtype=np.float64) / DEGREE
        return _Formula(
            shape=a[0],
            peak=a[1] * fz**2 + a[2] * fz,
            slope=a[3] * saturation(fz / a[4]) * (1.0 - a[5] * np.abs(lean)),
            curvature=a[6] * fz + a[7],
            shift=a[8] * lean + a[9] * fz + a[10],
            offset=(a[11] * fz + self.camber_by_square * fz**2) * lean + a[12] * fz + a[13],
        )

    def _aligning(self, fz: Array, camber: ArrayLike) -> _Formula:
        if self.aligning_moment_coefficients is None:
            raise InputError(f"{self.label}: the set has no aligning moment")
        c, lean = self.aligning_moment_coefficients, np.asarray(camber, dtype=np.float64) / DEGREE
        return _Formula(
            shape=c[0],
            peak=c[1] * fz**2 + c[2] * fz,
            slope=(c[3] * fz**2 + c[4] * fz) * (1.0 - c[6] * np.abs(lean)) * np.exp(-c[5] * fz),
            curvature=(c[7] * fz**2 + c[8] * fz + c[9]) * (1.0 - c[10] * np.abs(lean)),
            shift=c[11] * lean + c[12] * fz + c[13],
            offset=(c[14] * fz**2 + c[15] * fz) * lean + c[16] * fz + c[17],
        )


@dataclass(frozen=True, eq=False)
class Pacejka89Tyre(FormulaTyre):
    """A tyre with one fit per pressure; between them values are linear."""

    tyre: str  # name of the tyre
    surface: str  # ``flat`` or ``drum``
    sets: tuple[Pacejka89, ...]  # by rising pressure
    source: str  # of the coefficients
    notes: tuple[str, ...] = ()  # to be told to a reader of any value
    surface_stated: bool = True  # False: the source names no surface, a flat one is taken

    def __post_init__(self) -> None:
        super().__post_init__()
        label, highest = f"{self.tyre} on {self.surface}", min(fit.load_max for fit in self.sets)
        pressures = np.array([fit.pressure for fit in self.sets])
        vars(self).update(
            label=label,
            description="Pacejka-89 coefficients",
            width=None,
            range_kind=f"for which {label} holds",
            synthetic=any("synthetic" in note.lower() for note in self.notes),
            load_range=(0.0, highest),
            loads=np.array([load for load in LOADS if load <= highest] or [highest]),
            pressures=pressures,
            pressure_range=(self.sets[0].pressure, self.sets[-1].pressure),
        )

    def lateral_force(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Lateral force."""
        return self._interpolate(
            pressure, lambda fit: fit.lateral_force(slip_angle=slip_angle, load=load, camber=camber)
        )

    def aligning_moment(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Aligning moment."""
        return self._interpolate(
            pressure, lambda fit: fit.aligning_moment(slip_angle=slip_angle, load=load, camber=camber)
        )

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Return the slopes at many conditions, linear in pressure; nothing is checked."""
        slopes_of_sets = [fit.linear(load=load) for fit in self.sets]
        for quantities in slopes_of_sets:
            if "pneumatic_trail" in quantities:
                quantities["pneumatic_trail"] = quantities["pneumatic_trail"] * quantities["cornering_stiffness"]
        weights = self._weights(pressure)
        names = set.intersection(*map(set, slopes_of_sets))
        slopes: dict[str, Array] = {
            name: np.sum([quantities[name] for quantities in slopes_of_sets] * weights, 0) for name in names
        }
        if "pneumatic_trail" in slopes:
            slopes["pneumatic_trail"] = slopes["pneumatic_trail"] / slopes["cornering_stiffness"]
        if "lateral_stiffness" in slopes:
            slopes["relaxation_length"] = slopes["cornering_stiffness"] / slopes["lateral_stiffness"]
        return slopes

    def _weights(self, pressure: ArrayLike) -> Array:
        """Weight of each set (first axis) at every pressure, linear between neighbours and beyond the outer ones."""
        lines, at = self.pressures, np.asarray(pressure, dtype=np.float64)
        if lines.size == 1:
            return np.ones((1, *at.shape))
        upper = np.clip(np.searchsorted(lines, at), 1, len(lines) - 1)
        share = (at - lines[upper - 1]) / (lines[upper] - lines[upper - 1])
        return np.array([share * (upper == n) + (1.0 - share) * (upper == n + 1) for n in range(len(lines))])

    def _refuse(self, load: float, pressure: float) -> None:
        low, high = self.pressure_range
        if low == high and not np.isclose(pressure, low, rtol=1e-9):
            raise InputError(
                f"{self.label}: pressure is {pressure / PASCAL_PER_BAR:g} bar, but it was fitted at "
                f"{low / PASCAL_PER_BAR:g} bar only, which says nothing about another pressure"
            )

    def _interpolate(self, pressure: float, evaluate: Callable[[Pacejka89], Array]) -> Array:
        if not self.pressures[0] <= pressure <= self.pressures[-1]:
            low, high, at = (value / PASCAL_PER_BAR for value in (*self.pressure_range, pressure))
            raise InputError(f"{self.tyre}: pressure {at:g} bar is outside of the fitted {low:g} to {high:g} bar")
        weights = self._weights(pressure)
        return np.asarray(sum(w * evaluate(fit) for w, fit in zip(weights, self.sets, strict=True) if w))


KIND, CHRONO = "pacejka89", "Lateral Coefficients"
SIDE, MOMENT, SQUARE = "lateral_force", "aligning_moment", "camber_by_square"
COUNT = {SIDE: 14, MOMENT: 18}
# other spellings of keys, in small letters
KEYS = {
    "fy": SIDE,
    "fy_coef": SIDE,
    "optparametermf_fy": SIDE,
    "sets": "set",
    "mz": MOMENT,
    "mz_coef": MOMENT,
    "optparametermf_mz": MOMENT,
    "load_max_n": "load_max_N",
    "lateral_stiffness_n_per_mm": "lateral_stiffness_N_per_mm",
}
EXPONENT = re.compile(r"[-+]?\d+(\.\d*)?[eE][-+]?\d+")
PRESSURES = {"pressure_kpa": 1.0, "pressure_bar": 100.0, "pressure_psi": 4.4482216152605 / 25.4**2 * 1e3}  # in kPa


def _coefficients(role: str) -> Check:
    count, coefficient = COUNT[role], number(least=-LARGEST, most=LARGEST)
    return list_of(coefficient, f"must be a list of {count} numbers", least=count, most=count)


def _notes(value: Any) -> Any:
    return (value,) if isinstance(value, str) else list_of(text(), "must be text in quotes, or a list of texts")(value)


_SIZE = number(above=0, least=SMALLEST, most=1e5)
SET = table(
    {
        maybe("label", ""): text(),
        needed("pressure_kPa", "no pressure; write pressure_kPa = 300, or name the file NAME_p300"): _SIZE,
        needed(SIDE, f"no {SIDE}; write {SIDE} = [a0, ... a13]"): _coefficients(SIDE),
        maybe(MOMENT): _coefficients(MOMENT),
        maybe(SQUARE, 0.0): number(least=-LARGEST, most=LARGEST),
        maybe("lateral_stiffness_N_per_mm"): number(above=1, most=1000, says="must be a number of 1 to 1000 N/mm"),
    }
)
FILE = table(
    {
        maybe("kind", KIND): text(f"must be {KIND!r}", allowed=(KIND,)),
        maybe("tyre"): text(blank=False),
        maybe("surface"): text("must be 'flat' or 'drum'", allowed=("flat", "drum")),
        maybe("source", "not stated"): text(),
        maybe("licence"): text(),
        maybe("load_max_N"): _SIZE,
        maybe("slip_unit"): text("is neither 'deg' nor 'rad'", allowed=tuple(SLIP_UNITS)),
        maybe("note", []): _notes,
        needed(
            "set", "no coefficients found; write lateral_force = [...], or [[set]] and its coefficients below it"
        ): list_of(SET, "must be tables: write [[set]] and its coefficients below it", least=1, strict=False),
    }
)
# far beyond what is measured: C/Fz is 0.2 to 0.3 per degree in Dell'Orto et al. (C and D: Pacejka, 2012, section 4.3)
LIMITS = {
    "stiffness per load": (0.03, 1.0),  # 1/deg
    "friction": (0.0, 1.5),
    "trail": (0.0, 0.1),  # m
    "C": (0.5, 4.0),
    "D": (0.3, 2.0),  # of the load
}


def check_coefficients(fit: Pacejka89) -> None:
    """Refuse a set that describes no tyre, such as a fit broken off half way."""
    for load in (load for load in LOADS if load <= fit.load_max):
        with np.errstate(all="ignore"):  # values that are not finite are refused
            slopes = fit.linear(load=load)
            forces = fit.lateral_force(slip_angle=np.array([-10.0, -4.0, 4.0, 10.0]) * DEGREE, load=load)
        stiffness, friction = float(slopes["cornering_stiffness"]) * DEGREE, float(np.abs(forces).max()) / load
        (low, high), most = (limit * load for limit in LIMITS["stiffness per load"]), LIMITS["friction"][1]
        trail, longest = float(slopes.get("pneumatic_trail", np.nan)) * 1e3, LIMITS["trail"][1] * 1e3
        for sound, words in (
            (
                low <= stiffness <= high,
                f"cornering stiffness at {load:g} N is {stiffness:.4g} N/deg, a tyre has "
                f"{low:g} to {high:g} N/deg; the fit is not usable",
            ),
            (
                forces[1] < 0.0 < forces[2],
                f"lateral force at {load:g} N is {forces[1]:.4g} N at -4 deg, {forces[2]:.4g} N "
                "at +4 deg; its sign must follow the slip",
            ),
            (
                friction <= most,
                f"lateral force at {load:g} N reaches {friction:.3g} times the load, allowed is {most:g}",
            ),
            (
                0.0 < trail < longest or "pneumatic_trail" not in slopes,
                f"pneumatic trail at {load:g} N is {trail:.3g} mm, allowed are 0 to {longest:g} mm",
            ),
        ):
            if not sound:
                raise InputError(f"{fit.label}: {words}")


def doubts_about(fit: Pacejka89) -> list[str]:
    """Return a note on shape and peak that the data did not settle, if there is anything to say."""
    shape, load = fit.lateral_force_coefficients[0], 0.4  # kN, of a bicycle's wheel
    peak = (fit.lateral_force_coefficients[1] * load + fit.lateral_force_coefficients[2]) / 1e3
    unusual = [
        f"{name} = {value:.4g}{at} (usual {LIMITS[name][0]:g} to {LIMITS[name][1]:g})"
        for name, value, at in (("C", shape, ""), ("D", peak, " times the load at 400 N"))
        if not LIMITS[name][0] <= value <= LIMITS[name][1]
    ]
    if not unusual:
        return []
    return [
        f"{fit.label}: {', '.join(unusual)}: the data did not settle C, D and E one by one; its slope is what holds"
    ]


def read_pacejka89(source: str | Path | Traversable) -> Pacejka89Tyre:
    """Read a packaged tyre by its name, or a file of coefficients, and check them."""
    if isinstance(source, str) and not source.lower().endswith((".toml", ".json", ".yaml", ".yml", ".mat")):
        source = data_root() / "tyres" / f"{source}.toml"
    file = Path(source) if isinstance(source, str) else source
    where = str(source)
    stem = Path(file.name).stem
    try:
        content, unused = _one_mapping(refuse_deep(_read(file), str(file)), stem), []
    except InputError as error:
        raise InputError(str(error) if str(error).startswith(where) else f"{where}: {error}") from error
    if file.name.lower().endswith(".mat"):  # a workspace holds other things too
        unused = sorted({*content} - {*FILE.keys})
        content = {key: value for key, value in content.items() if key not in unused}
    keys = read(FILE, content, where=where)
    notes = [*keys["note"]]
    if unused:
        notes.append(f"not used of {file.name}: {', '.join(unused)}")
    defaults = {"slip_unit": "; degrees are taken, as Magic-Formula-89 has them", "surface": "; flat is taken"}
    silent = [key for key in ("load_max_N", *defaults) if key not in keys]
    notes += [f"the file states no {key}{defaults.get(key, '')}" for key in silent]
    tyre, sets = keys.get("tyre", stem), []
    for entry in keys["set"]:
        stiffness = entry.get("lateral_stiffness_N_per_mm")
        fit = Pacejka89(
            label=", ".join(filter(None, (tyre, entry["label"]))),
            pressure=entry["pressure_kPa"] * 1e3,
            load_max=keys.get("load_max_N", float("inf")),
            lateral_force_coefficients=tuple(entry[SIDE]),
            aligning_moment_coefficients=tuple(entry[MOMENT]) if MOMENT in entry else None,
            slip_unit=keys.get("slip_unit", "deg"),
            camber_by_square=entry[SQUARE],
            lateral_stiffness=None if stiffness is None else stiffness * 1e3,
        )
        try:
            check_coefficients(fit)
        except InputError as error:
            other_unit, hint = "rad" if fit.slip_unit == "deg" else "deg", ""
            with suppress(InputError):
                check_coefficients(replace(fit, slip_unit=other_unit))
                hint = f"; with slip in {other_unit} it would be one: write slip_unit = {other_unit}"
            raise InputError(f"{where}: {error}{hint}") from error
        sets.append(fit)
        if fit.camber_by_square:
            notes.append(f"a112 = {fit.camber_by_square:g} is taken: camber force with the square of the load")
        notes += doubts_about(fit)
    incomplete = [fit for fit in sets if fit.lateral_stiffness is None]
    if incomplete and len(incomplete) < len(sets):
        raise InputError(
            f"{where}: lateral_stiffness_N_per_mm is missing in {incomplete[0].label}; give it in every set"
        )
    if len({fit.pressure for fit in sets}) < len(sets):
        raise InputError(f"{where}: two sets have one pressure_kPa; keep one of them")
    parsed = Pacejka89Tyre(
        tyre=tyre,
        surface=keys.get("surface", "flat"),
        sets=tuple(sorted(sets, key=lambda fit: fit.pressure)),
        source=keys["source"],
        notes=tuple(notes),
        surface_stated="surface" in keys,
    )
    return replace(parsed, notes=(*parsed.notes, *parsed.doubts))


def _one_mapping(content: Any, stem: str) -> Any:
    """Keys in one spelling; a set at the top, or in a struct of its own, below ``set``."""
    if isinstance(content, list):
        content = {"set": content} if content and isinstance(content[0], Mapping) else {SIDE: content}
    if not isinstance(content, Mapping):
        return content
    if CHRONO in content:
        raise InputError(
            f"'{CHRONO}' is of a tyre file of Chrono, which states no pressure; copy its a0 to a13 (and c0 to c17) to "
            "the top of a .json with pressure_kPa"
        )
    top = _normalise_keys(content)
    inner = [key for key, value in top.items() if isinstance(value, Mapping) and SIDE in _normalise_keys(value)]
    if "set" not in top and SIDE not in top and inner:  # beside coefficients a struct with Fy is the measured data
        common = {key: top.pop(key) for key in list(top) if key.lower() in PRESSURES}
        top["set"] = [{"label": key, **common, **_normalise_keys(top.pop(key))} for key in inner]
    if "set" not in top and SIDE in top:
        top["set"] = [{key: top.pop(key) for key in list(top) if key in SET.keys or key.lower() in PRESSURES}]
    if isinstance(top.get("set"), Mapping):
        top["set"] = [top["set"]]
    if isinstance(top.get("set"), list):
        top["set"] = [
            _with_pressure(_normalise_keys(entry), stem) if isinstance(entry, Mapping) else entry
            for entry in top["set"]
        ]
    return top


def _normalise_keys(content: Mapping[str, Any]) -> dict[str, Any]:
    """Keys in one spelling; coefficients by name (a0, ..., a111 for a11) as lists."""
    content_by_key = {KEYS.get(str(key).lower(), str(key)): value for key, value in content.items()}
    for letter, role in (("a", SIDE), ("c", MOMENT)):
        numbered = re.compile(rf"{letter}(\d+)", re.IGNORECASE)
        named = {
            int(match[1]): content_by_key.pop(key) for key in list(content_by_key) if (match := numbered.fullmatch(key))
        }
        if letter == "a" and 111 in named:  # Sv = (a111 Fz + a112 Fz^2) camber + ...
            if 11 in named:
                raise InputError("a11 and a111 are both given; keep a111 with a112, or a11 alone")
            content_by_key[SQUARE] = named.pop(112, 0.0)
            named[11] = named.pop(111)
        if missing := [n for n in range(COUNT[role]) if n not in named] if named else []:
            raise InputError(f"{letter}{missing[0]} is missing; give {letter}0 to {letter}{COUNT[role] - 1}")
        if named:
            content_by_key[role] = [named.pop(n) for n in range(COUNT[role])]
        if named:
            raise InputError(f"unknown key '{letter}{min(named)}'; known: {letter}0 to {letter}{COUNT[role] - 1}")
        if role in content_by_key:
            content_by_key[role] = _flat(content_by_key[role])
    return content_by_key


def _flat(value: Any) -> Any:
    """Coefficients that MATLAB's writers of YAML nest in rows or columns, with exponents that YAML takes for text."""
    if isinstance(value, list):
        coefficients: list[Any] = []
        for part in value:
            coefficients += _flat(part) if isinstance(part, list) else [_flat(part)]
        return coefficients
    return float(value) if isinstance(value, str) and EXPONENT.fullmatch(value.strip()) else value


def _with_pressure(entry: dict[str, Any], stem: str) -> dict[str, Any]:
    for key in list(entry):
        if (factor := PRESSURES.get(key.lower())) and is_number(entry[key]):
            entry["pressure_kPa"] = entry.pop(key) * factor
    named = re.search(r"_p(\d{2,4})(?!\d)", stem)  # of the authors' files: OptParameterMF_T03R01_camber0_p300
    if "pressure_kPa" not in entry and named:
        entry["pressure_kPa"] = float(named[1])
    return entry


def _read(file: Path | Traversable) -> Any:
    """The mapping or list that a file holds; YAML may name a list within itself."""
    kind = "file of Pacejka-89 coefficients"
    ending = Path(file.name).suffix.lower()
    if ending not in (".json", ".yaml", ".yml", ".mat"):
        return read_toml(file, kind)
    if not file.is_file():
        raise InputError(f"{file}: no such {kind}")
    if ending == ".mat":
        from tyre.formats import table_rows

        ((_, (content,)),) = table_rows(Path(str(file)), "")
        return content
    written = read_text(file, fallback="latin-1")
    if ending == ".json":
        try:
            return json.loads(written)
        except (ValueError, RecursionError) as error:
            raise InputError(f"{file}: not a JSON file: {error}") from error
    import yaml

    try:
        return yaml.safe_load(written)
    except (yaml.YAMLError, RecursionError, ValueError) as error:  # a number of thousands of digits is a ValueError
        raise InputError(f"{file}: not a YAML file: {' '.join(str(error).split())}") from error
