"""Tyre property files (.tir) of MF-Tyre 5.2, 6.1 and 6.2 for small slip and camber: read, checked, fitted, written."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, nan
from pathlib import Path
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from tyre import magic_formula as mf61
from tyre.arrays import Array
from tyre.errors import InputError, hint, plain_digits, shown
from tyre.files import write_text
from tyre.formula_tyre import FormulaTyre
from tyre.plausible import LARGEST, SMALLEST
from tyre.units import PASCAL_PER_BAR, find_unit

# quantity of the values with a unit; all others are pure numbers
QUANTITY = dict.fromkeys(("FNOMIN", "FZMIN", "FZMAX"), "force") | dict.fromkeys(("UNLOADED_RADIUS", "WIDTH"), "length")
QUANTITY |= dict.fromkeys(("NOMPRES", "INFLPRES", "PRESMIN", "PRESMAX"), "pressure")
QUANTITY |= {"LATERAL_STIFFNESS": "stiffness"}


@dataclass(frozen=True)
class TirText:
    """A .tir file: its text verbatim and its values."""

    source: str  # name for error messages
    text: str = field(repr=False)  # the whole file
    # values by section and key, in the units of the file; keys without a value are left out
    sections: dict[str, dict[str, float | str]]
    comments: dict[str, str]  # ``TYRE`` and ``SURFACE`` from the comment lines, if the file has them

    @cached_property
    def values(self) -> dict[str, float | str]:
        """Values by key; of a key in several sections the first."""
        found: dict[str, float | str] = {}
        for section in self.sections.values():
            found = section | found
        return found

    @cached_property
    def factors(self) -> dict[str, float]:
        """Factors to SI by quantity; the pressure is force over length squared if the file states no unit of it."""
        units = self.sections.get("UNITS", {})
        angle = str(units.get("ANGLE", "radians")).casefold()
        if angle not in ("radian", "radians", "rad"):
            raise InputError(f"{self.source}, [UNITS]: ANGLE = {angle!r}; only coefficients in radians are understood")
        plain = {"pascal": "pa", "kpascal": "kpa", "millimeter": "mm", "centimeter": "cm", "kilonewton": "kn"}
        found = {}
        for quantity, default in (("force", "newton"), ("length", "meter"), ("pressure", "")):
            text = str(units.get(quantity.upper(), default)).casefold()
            where = f"{self.source}, [UNITS] {quantity.upper()}"
            if text or quantity.upper() in units:
                found[quantity] = find_unit(plain.get(text, text), quantity, where=where).factor
        stiffness = found["force"] / found["length"]
        return {"pressure": stiffness / found["length"], "stiffness": stiffness} | found

    def number(self, key: str, default: float | None = None, *, positive: bool = False) -> float:
        """Return one number in SI units."""
        value = self.values.get(key, default)
        if not isinstance(value, float):
            state = f"is missing{hint(key, self.values)}" if value is None else f"is {shown(value)}, not a number"
            raise InputError(f"{self.source}: {key} {state}")
        if key in self.values and not (SMALLEST if positive else -LARGEST) <= value <= LARGEST:
            allowed = f"positive, {SMALLEST:g} to" if positive else "a number up to"
            raise InputError(f"{self.source}: {key} = {value:g} must be {allowed} {LARGEST:g} in size")
        return value * self.factors[QUANTITY[key]] if key in QUANTITY else value

    def range(self, low: str, high: str) -> tuple[float, float]:
        """Return the ends of a range; (0, inf) if they are missing."""
        ends = self.number(low, 0.0), self.number(high, inf)
        if not ends[0] <= ends[1]:
            raise InputError(f"{self.source}: {low} = {ends[0]:g} is above {high} = {ends[1]:g}; exchange them")
        return ends


def parse(text: str, *, source: str) -> TirText:
    """Split the text of a .tir file into sections and keys."""
    sections: dict[str, dict[str, float | str]] = {}
    comments: dict[str, str] = {}
    current: dict[str, float | str] | None = None
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        where = f"{source}, line {number}"
        stripped = line.strip()
        if not stripped or stripped[0] in "$!#":
            if found := re.match(r"^!\s*:?\s*(TYRE|SURFACE)\s*:\s*(.+)$", stripped):
                comments.setdefault(found[1], found[2].strip())
            continue
        if stripped[0] == "[":
            current = sections.setdefault(stripped.partition("]")[0][1:].strip().upper(), {})
            continue
        assignment = re.match(r"^\s*([A-Za-z_]\w*)\s*=\s*(.*)$", line)
        if assignment is None:
            if stripped[0] == "{" or re.fullmatch(r"[-+.\deE\s]+", re.split(r"[$!]", stripped)[0]):
                continue  # a table such as [SHAPE], of no use here and kept in the text
            raise InputError(f"{where}: {stripped[:60]!r} is no section, assignment, table row or comment")
        if current is None:
            raise InputError(f"{where}: {stripped[:60]!r} stands before the first [SECTION]; is this a .tir file?")
        key, value = assignment[1].upper(), _value(assignment[2].strip())
        if value == "":
            continue
        if key in current:
            raise InputError(f"{where}: {key} is given twice in its section; keep one")
        current[key] = value
    if not sections:
        raise InputError(f"{source}: has no [SECTION]; is this a .tir file?")
    return TirText(source, text, sections, comments)


def _value(text: str) -> float | str:
    if text[:1] in ("'", '"'):
        return text[1:].partition(text[0])[0].strip()
    text = re.split(r"[$!]", text)[0].strip()
    try:
        return value if plain_digits(text) and isfinite(value := float(text)) else text
    except ValueError:
        return text


# coefficients that are read; those that begin with L are scale factors
NAMES = (
    "FNOMIN", "NOMPRES", "UNLOADED_RADIUS", "LATERAL_STIFFNESS", "PKY1", "PKY2", "PKY3", "PKY4", "PPY1", "PPY2",
    "PCFY1", "PCFY2", "PCFY3", "PTY1", "PTY2", "LFZO", "LKY", "LSGAL",
    "PKY6", "PKY7", "PPY5", "LKYC", "PHY3", "PVY3", "PVY4", "LGAY", "LMUY", "QDZ1", "QDZ2", "PPZ1", "LTR", "QDZ8",
    "QDZ9", "PPZ2", "LKZC", "LGAZ", "QSX2", "QSX4", "QSX5", "QSX6", "QSX7", "QSX10", "QSX11", "PPMX1", "LMX",
)  # fmt: skip
POSITIVE = ("FNOMIN", "NOMPRES", "LATERAL_STIFFNESS", "PKY2", "PTY2", "LFZO", "LKY", "LSGAL")
DEFAULTS = {"PKY4": 2.0, "PTY2": 1.0, "LATERAL_STIFFNESS": nan, "UNLOADED_RADIUS": nan, "NOMPRES": nan}


@dataclass(frozen=True)
class Coefficients:
    """Coefficients by their names in a .tir file, those with a unit in SI, and the ranges in which they hold.

    MF-Tyre 5.2 (``old``) has one pressure, NOMPRES, and PTY1 and PTY2 for the relaxation length; 6.1 and 6.2 have
    the lateral stiffness over load and pressure.
    """

    values: Mapping[str, float]
    old: bool
    load_range: tuple[float, float]
    pressure_range: tuple[float, float] = (0.0, inf)

    def __getitem__(self, name: str) -> float:
        return self.values.get(name, DEFAULTS.get(name, 1.0 if name.startswith("L") else 0.0))

    @property
    def nominal_load(self) -> float:
        """FNOMIN' = LFZO FNOMIN, N."""
        return self["LFZO"] * self["FNOMIN"]

    def cornering_stiffness(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """C_Fy, N/rad, > 0 whatever the signs of the file."""
        by_pressure = {} if self.old else {name: self[name] for name in ("PPY1", "PPY2", "PKY4")}
        return mf61.cornering_stiffness(
            load, pressure, PKY1=self["LKY"] * abs(self["PKY1"]), PKY2=self["PKY2"], FNOMIN=self.nominal_load,
            NOMPRES=1.0 if self.old else self["NOMPRES"], **by_pressure,
        )  # fmt: skip

    def lateral_stiffness(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """K_y, N/m; NaN if the coefficients do not hold it."""
        stiffness = self["LATERAL_STIFFNESS"]
        if not self.old:
            return mf61.lateral_stiffness(
                load, pressure, LATERAL_STIFFNESS=stiffness, FNOMIN=self.nominal_load, NOMPRES=self["NOMPRES"],
                **{name: self[name] for name in ("PCFY1", "PCFY2", "PCFY3")},
            )  # fmt: skip
        if self["PTY1"] <= 0:
            return np.full(np.shape(load), stiffness)
        relative = np.asarray(load, dtype=np.float64) / self.nominal_load
        length = self["PTY1"] * mf61.saturation(relative / self["PTY2"]) * self["UNLOADED_RADIUS"]
        cornering = self.cornering_stiffness(load=load, pressure=pressure)
        return cornering / (length * self["LFZO"] * self["LSGAL"])

    def linear(self, *, load: Array, pressure: Array) -> dict[str, Array]:
        """Return what the coefficients hold, by the name of a field of `TyreProperties`."""
        cornering = self.cornering_stiffness(load=load, pressure=pressure)
        lateral = self.lateral_stiffness(load=load, pressure=pressure)
        held = {"cornering_stiffness": cornering}
        if isfinite(self["LATERAL_STIFFNESS"]) or (self.old and self["PTY1"] > 0):
            held |= {"lateral_stiffness": lateral, "relaxation_length": cornering / lateral}
        side = -1.0 if self["PKY1"] < 0 else 1.0  # ISO signs, or adapted SAE
        relative = load / self.nominal_load
        dfz, dpi = relative - 1, np.zeros_like(load) if self.old else pressure / self["NOMPRES"] - 1
        if self.old and self._has("PHY3", "PVY3", "PVY4"):
            upright = side * load * (self["PVY3"] + self["PVY4"] * dfz) * self["LMUY"]
            held["camber_stiffness"] = self["LGAY"] * (self["PHY3"] * cornering + upright)
        if not self.old and self._has("PKY6", "PKY7"):
            by_load = load * (self["PKY6"] + self["PKY7"] * dfz)
            held["camber_stiffness"] = side * by_load * (1 + self["PPY5"] * dpi) * self["LKYC"]
        if not self["UNLOADED_RADIUS"] > 0:
            return held
        arm = load * self["UNLOADED_RADIUS"]
        if self._has("QDZ1", "QDZ2"):
            by_load = arm / self.nominal_load * (self["QDZ1"] + self["QDZ2"] * dfz)
            held["pneumatic_trail"] = by_load * (1 - self["PPZ1"] * dpi) * self["LTR"]
        if self._has("QDZ8", "QDZ9"):
            scale = self["LMUY"] * self["LGAZ" if self.old else "LKZC"]
            by_load = arm * (self["QDZ8"] + self["QDZ9"] * dfz)
            held["twisting_stiffness"] = side * by_load * (1 + self["PPZ2"] * dpi) * scale
        if self._has("QSX2", "QSX4", "QSX10"):
            share = self["QSX2"] * (1 + self["PPMX1"] * dpi) - self["QSX10"] * np.arctan(self["QSX11"] * relative)
            share -= self["QSX4"] * self["QSX7"] * np.cos(self["QSX5"] * np.arctan((self["QSX6"] * relative) ** 2))
            held["overturning_stiffness"] = arm * share * self["LMX"]
        return held

    def _has(self, *names: str) -> bool:
        return any(self[name] for name in names)


def coefficients_of(file: TirText) -> Coefficients:
    """Return the coefficients of a file; its model must be MF-Tyre 5.2, 6.1 or 6.2."""
    model = file.values.get("FITTYP", file.values.get("PROPERTY_FILE_FORMAT"))
    versions, names = {"6.1 or 6.2": (60, 61, 62), "5.2": (5, 6, 21, 51, 52)}, ("PAC2002", "MF_05", "MF-TYRE")
    old = model in versions["5.2"] or str(model).upper() in names
    if not old and model not in versions["6.1 or 6.2"]:
        raise InputError(
            f"{file.source}: tyre model FITTYP or PROPERTY_FILE_FORMAT = {model!r} is neither MF-Tyre 5.2 "
            f"({versions['5.2']}, {names}) nor 6.1 or 6.2 ({versions['6.1 or 6.2']})"
        )
    needed = ("PKY1", "PKY2", "FNOMIN", "UNLOADED_RADIUS" if old else "NOMPRES")
    absent = ("LATERAL_STIFFNESS",) if file.values.get("LATERAL_STIFFNESS") == 0 else ()
    values = {
        name: file.number(name, positive=name in POSITIVE or (old and name == "UNLOADED_RADIUS"))
        for name in NAMES if (name in file.values and name not in absent) or name in needed
    }  # fmt: skip
    pressure = "INFLPRES" if old and "INFLPRES" in file.values else "NOMPRES"
    if isinstance(file.values.get(pressure), float):
        values["NOMPRES"] = file.number(pressure)
        if not 0.2e5 <= values["NOMPRES"] <= 25e5:
            given = f"{pressure} is {values['NOMPRES']:g} Pa"
            raise InputError(f"{file.source}: {given}, tyres have 2e4 to 2.5e6 Pa; check [UNITS]")
    if old:
        return Coefficients(values, old, file.range("FZMIN", "FZMAX"))
    return Coefficients(values, old, file.range("FZMIN", "FZMAX"), file.range("PRESMIN", "PRESMAX"))


@dataclass(frozen=True, eq=False)
class TirTyre(FormulaTyre):
    """The tyre of a property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2.

    Attributes
    ----------
    file : TirText
        The file as it stands; its comments ``TYRE`` and ``SURFACE`` name the tyre, if there are any.
    coefficients : Coefficients
        In SI units, signs as in the file.
    """

    file: TirText
    coefficients: Coefficients = field(init=False)
    same_pressure: ClassVar[float] = 0.02  # MF-Tyre 5.2 has one pressure; a rig sets it within this share

    def __post_init__(self) -> None:
        super().__post_init__()
        file, model = self.file, coefficients_of(self.file)
        tyre, surface = file.comments.get("TYRE", Path(file.source).stem), file.comments.get("SURFACE", "flat")
        width, nominal, pressure_range = file.number("WIDTH", 0.0), model["NOMPRES"], model.pressure_range
        if model.old and isfinite(nominal):
            pressure_range = (1 - self.same_pressure) * nominal, (1 + self.same_pressure) * nominal
        lines = [line.lower() for line in file.text.splitlines() if line.startswith(("!", "$"))]
        label = f"{tyre} on {surface} ({Path(file.source).name})"
        vars(self).update(
            coefficients=model, tyre=tyre, surface=surface, label=label, source=file.source,
            description=f"MF-Tyre {'5.2' if model.old else '6.1'} coefficients", width=width if width > 0 else None,
            load_range=model.load_range, pressure_range=pressure_range, range_kind=f"for which {label} holds",
            loads=_known(*model.load_range, model["FNOMIN"]), pressures=_known(*model.pressure_range, nominal),
            synthetic=any("synthetic" in line for line in lines),
        )  # fmt: skip

    @cached_property
    def notes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Notes that a reader of any value must be told."""
        model, any_pressure = self.coefficients, self.pressure_range[1] == inf
        told = {
            "synthetic: no rig measured this tyre": self.synthetic,
            "from a .tir file": True,
            "PKY1 is positive: the file does not keep ISO signs, adapted SAE signs are taken": model["PKY1"] > 0,
            "the file names no surface: taken as flat": "SURFACE" not in self.file.comments,
            "the file states no pressure: its values are taken at the one asked for": model.old and any_pressure,
            "the file states no range of pressures (PRESMIN, PRESMAX)": not model.old and any_pressure,
            "the file states no range of loads (FZMIN, FZMAX)": self.load_range[1] == inf,
            "no relaxation coefficients PTY1, PTY2: LATERAL_STIFFNESS gives the relaxation length":
                model.old and model["PTY1"] <= 0 and isfinite(model["LATERAL_STIFFNESS"]),
        }  # fmt: skip
        return (*(note for note, holds in told.items() if holds), *self.doubts)

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Return the quantities of the file at many conditions; nothing is checked."""
        return self.coefficients.linear(load=load, pressure=pressure)

    def _refuse(self, load: float, pressure: float) -> None:
        nominal = self.coefficients["NOMPRES"]
        if self.coefficients.old and abs(pressure - nominal) > self.same_pressure * nominal:
            raise InputError(
                f"{self.file.source}: an MF-Tyre 5.2 file holds one pressure, here {nominal / PASCAL_PER_BAR:g} "
                f"bar; {pressure / PASCAL_PER_BAR:g} bar needs a file of its own"
            )


def _known(*values: float) -> Array:
    """Return the positive and finite values, ascending, each once."""
    return np.unique([value for value in values if 0 < value < inf])


def read_tir(path: str | Path) -> TirTyre:
    """Read a tyre property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2."""
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        return parse_tir(raw.decode("utf-8-sig"), source=str(path))
    except UnicodeDecodeError:
        return parse_tir(raw.decode("latin-1"), source=str(path))


def parse_tir(text: str, *, source: str) -> TirTyre:
    """Interpret the text of a .tir file; the errors name ``source``."""
    return TirTyre(parse(text, source=source))


def fit_mf61(
    *, load: ArrayLike, pressure: ArrayLike, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike
) -> Coefficients:
    """Fit the MF-Tyre 6.1 form to measured stiffnesses: the coefficients are those of the trends of a `TyreMap`."""
    fz, p, c, k = (np.asarray(one, float) for one in (load, pressure, cornering_stiffness, lateral_stiffness))
    cornering, lateral = mf61.fit(mf61.CORNERING, fz, p, c), mf61.fit(mf61.LATERAL, fz, p, k)
    found = cornering.coefficients | lateral.coefficients | cornering.nominal
    found["PKY1"] *= -1
    return Coefficients(found, False, (float(fz.min()), float(fz.max())), (float(p.min()), float(p.max())))


def fit_mf52(
    *, load: ArrayLike, pressure: float, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike,
    unloaded_radius: float,
) -> Coefficients:  # fmt: skip
    """Fit the MF-Tyre 5.2 form at one pressure."""
    fz, c, k = (np.asarray(one, float) for one in (load, cornering_stiffness, lateral_stiffness))
    nominal = float(fz.min() + fz.max()) / 2.0
    height, position = _arch(fz / nominal, c / nominal)
    length, place = _arch(fz / nominal, c / k / unloaded_radius)
    found = {"FNOMIN": nominal, "NOMPRES": float(pressure), "UNLOADED_RADIUS": float(unloaded_radius)}
    found |= {"PKY1": -height, "PKY2": position, "PTY1": length, "PTY2": place}
    return Coefficients(found, True, (float(fz.min()), float(fz.max())))


def _arch(relative_load: Array, value: Array) -> tuple[float, float]:
    """Height and load of the maximum of value = height sin(2 atan(relative_load / position))."""
    if len(np.unique(relative_load)) == 1:
        return float(np.mean(value) / mf61.saturation(np.mean(relative_load))), 1.0
    from scipy.optimize import least_squares

    solved = least_squares(
        lambda x: x[0] * mf61.saturation(relative_load / x[1]) / value - 1.0, [float(np.mean(value)), 1.0],
        bounds=([0.0, 0.05], [np.inf, 50.0]), xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    return float(solved.x[0]), float(solved.x[1])


# sections of a file that is written, and the coefficients in them; those of one version alone come last
LAYOUT = {
    "DIMENSION": ("UNLOADED_RADIUS",),
    "OPERATING_CONDITIONS": ("INFLPRES", "NOMPRES"),
    "INFLATION_PRESSURE_RANGE": ("PRESMIN", "PRESMAX"),
    "VERTICAL": ("FNOMIN",),
    "VERTICAL_FORCE_RANGE": ("FZMIN", "FZMAX"),
    "STRUCTURAL": ("LATERAL_STIFFNESS", "PCFY1", "PCFY2", "PCFY3"),
    "SCALING_COEFFICIENTS": ("LFZO", "LKY", "LSGAL"),
    "LATERAL_COEFFICIENTS": ("PKY1", "PKY2", "PKY3", "PKY4", "PPY1", "PPY2", "PTY1", "PTY2"),
}
ONLY_NEW = ("NOMPRES", "PRESMIN", "PRESMAX", *LAYOUT["STRUCTURAL"], "PKY4", "PPY1", "PPY2")
ONLY_OLD = ("LSGAL", "PKY3", "PTY1", "PTY2")


def write_tir(
    coefficients: Coefficients, path: str | Path, *, tyre: str, surface: str, unloaded_radius: float | None = None,
    notes: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Write coefficients as a tyre property file, SI units, ISO signs."""
    path, model = Path(path), coefficients
    if path.suffix.casefold() != ".tir":
        raise InputError(f"{path}: a tyre property file must end in .tir")
    if not model["PKY1"] < 0.0:
        raise InputError(f"{path}: PKY1 = {model['PKY1']:g} must be negative in the ISO signs of a .tir file")
    radius = model.values.get("UNLOADED_RADIUS", unloaded_radius)
    if radius is None or not radius > 0.0:
        raise InputError(f"{path}: the unloaded radius (m) of the tyre is needed in a .tir file, got {radius}")
    own = {"UNLOADED_RADIUS": float(radius), "INFLPRES": model["NOMPRES"]}
    own |= dict(zip(("FZMIN", "FZMAX", "PRESMIN", "PRESMAX"), model.load_range + model.pressure_range, strict=True))
    comments = (f": TYRE : {tyre}", f": SURFACE : {surface}", *notes, "lateral stiffness and relaxation length only")
    lines = ["[MDI_HEADER]", "FILE_TYPE = 'tir'", "FILE_VERSION = 3.0", "FILE_FORMAT = 'ASCII'"]
    lines += [f"! {' '.join(comment.split())}" for comment in comments]
    lines += ["[UNITS]", "LENGTH = 'meter'", "FORCE = 'newton'", "ANGLE = 'radians'", "MASS = 'kg'", "TIME = 'second'"]
    lines += ["[MODEL]", *(["FITTYP = 52", "PROPERTY_FILE_FORMAT = 'PAC2002'"] if model.old else ["FITTYP = 61"])]
    for section, names in LAYOUT.items():
        values = {name: own.get(name, model[name]) for name in names if name not in (ONLY_NEW, ONLY_OLD)[not model.old]}
        lines += [f"$ {'-' * (69 - len(section))} {section.lower()}", f"[{section}]"] if values else []
        lines += [f"{name:<28} = {value!r}" for name, value in values.items() if isfinite(value)]
    write_text(path, "\n".join(lines) + "\n")
