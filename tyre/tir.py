"""Tyre property files (.tir) of MF-Tyre 5.2, 6.1 and 6.2 for small slip and camber: read, checked, fitted, written."""

import difflib
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
from tyre.errors import InputError, plain_digits, shown
from tyre.files import write_text
from tyre.formula_tyre import FormulaTyre
from tyre.plausible import LARGEST, SMALLEST
from tyre.units import PASCAL_PER_BAR, find_unit


@dataclass(frozen=True)
class TirText:
    """A .tir file: its text verbatim and its values."""

    source: str  # name for error messages
    text: str = field(repr=False)  # the whole file
    # values by section and key, in the units of the file; keys without a value are left out
    sections: dict[str, dict[str, float | str]]
    comments: dict[str, str]  # ``TYRE`` and ``SURFACE`` from the comment lines, where the file has them

    def find(self, *keys: str) -> float | str | None:
        """Return the value of the first of ``keys`` in any section; None where there is none."""
        for key in keys:
            for section in self.sections.values():
                if key in section:
                    return section[key]
        return None

    @cached_property
    def force(self) -> float:
        """Unit of force, N."""
        return self._unit("FORCE", "force", "newton")

    @cached_property
    def length(self) -> float:
        """Unit of length, m."""
        return self._unit("LENGTH", "length", "meter")

    @cached_property
    def pressure(self) -> float:
        """Unit of pressure, Pa; force over length squared if the file states none."""
        if "PRESSURE" in self.sections.get("UNITS", {}):
            return self._unit("PRESSURE", "pressure", "")
        return self.force / self.length**2

    def _unit(self, key: str, quantity: str, default: str) -> float:
        units = self.sections.get("UNITS", {})
        angle = str(units.get("ANGLE", "radians")).casefold()
        if angle not in ("radian", "radians", "rad"):
            raise InputError(f"{self.source}, [UNITS]: ANGLE = {angle!r}; only coefficients in radians are understood")
        text = str(units.get(key, default)).casefold()
        plain = {"pascal": "pa", "kpascal": "kpa", "millimeter": "mm", "centimeter": "cm", "kilonewton": "kn"}
        return find_unit(plain.get(text, text), quantity, where=f"{self.source}, [UNITS] {key}").factor

    def number(self, key: str, default: float | None = None) -> float:
        """Return one number in the units of the file."""
        value = self.find(key)
        if value is None and default is not None:
            return default
        if not isinstance(value, float) or not isfinite(value):
            known = sorted({name for section in self.sections.values() for name in section})
            near = difflib.get_close_matches(key, known, n=1) if value is None else []
            state = "is missing" if value is None else f"is {shown(value)}, not a number"
            raise InputError(f"{self.source}: {key} {state}" + (f"; did you mean {near[0]}?" if near else ""))
        if abs(value) > LARGEST:
            raise InputError(f"{self.source}: {key} = {value:g} must be a number up to {LARGEST:g} in size")
        return value

    def positive(self, key: str, default: float | None = None) -> float:
        """Return one number that must be positive."""
        value = self.number(key, default)
        if not SMALLEST <= value <= LARGEST:
            raise InputError(f"{self.source}: {key} = {value:g} must be positive, {SMALLEST:g} to {LARGEST:g}")
        return value

    def range(self, low: str, high: str, factor: float) -> tuple[float, float]:
        """Return the ends of a range in SI units; (0, inf) if they are missing."""
        ends = self.number(low, 0.0) * factor, self.number(high) * factor if self.find(high) is not None else inf
        if not ends[0] <= ends[1]:
            raise InputError(f"{self.source}: {low} = {ends[0]:g} is above {high} = {ends[1]:g}; exchange them")
        return ends

    def plausible_pressure(self, key: str, pressure: float) -> float:
        """Return a ``pressure`` (Pa) if a tyre can have it."""
        if not 0.2e5 <= pressure <= 25e5:
            raise InputError(f"{self.source}: {key} is {pressure:g} Pa, tyres have 2e4 to 2.5e6 Pa; check [UNITS]")
        return pressure

    @cached_property
    def lateral_stiffness(self) -> float:
        """LATERAL_STIFFNESS, N/m; NaN if it is missing or 0."""
        value = self.number("LATERAL_STIFFNESS", 0.0)
        return self.positive("LATERAL_STIFFNESS") * self.force / self.length if value else nan


def read_text(path: str | Path) -> str:
    """Return the text of a file in UTF-8 or Latin-1."""
    try:
        raw = Path(path).read_bytes()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror})") from None
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


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
        key, value = assignment[1].upper(), _value(assignment[2])
        if value is None:
            continue
        if key in current:
            raise InputError(f"{where}: {key} is given twice in its section; keep one")
        current[key] = value
    if not sections:
        raise InputError(f"{source}: has no [SECTION]; is this a .tir file?")
    return TirText(source, text, sections, comments)


def _value(text: str) -> float | str | None:
    text = text.strip()
    if text[:1] in ("'", '"'):
        return text[1:].partition(text[0])[0].strip()
    text = re.split(r"[$!]", text)[0].strip()
    if not text:
        return None
    if not plain_digits(text):
        return text
    try:
        return value if isfinite(value := float(text)) else text
    except ValueError:
        return text


@dataclass(frozen=True)
class MF61Lateral:
    """Coefficients of MF-Tyre 6.1/6.2 that hold C_Fy and K_y over load and pressure."""

    fnomin: float
    nompres: float
    pky1: float
    pky2: float
    ppy1: float
    ppy2: float
    lateral_stiffness: float
    pcfy1: float
    pcfy2: float
    pcfy3: float
    load_range: tuple[float, float]
    pressure_range: tuple[float, float]
    pky4: float = 2.0
    lfzo: float = 1.0
    lky: float = 1.0

    def cornering_stiffness(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """C_Fy, N/rad."""
        return mf61.cornering_stiffness(
            load, pressure, PKY1=-self.lky * self.pky1, PKY2=self.pky2, PPY1=self.ppy1, PPY2=self.ppy2,
            PKY4=self.pky4, FNOMIN=self.lfzo * self.fnomin, NOMPRES=self.nompres,
        )  # fmt: skip

    def lateral_stiffness_at(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """K_y, N/m."""
        return mf61.lateral_stiffness(
            load, pressure, LATERAL_STIFFNESS=self.lateral_stiffness, PCFY1=self.pcfy1, PCFY2=self.pcfy2,
            PCFY3=self.pcfy3, FNOMIN=self.lfzo * self.fnomin, NOMPRES=self.nompres,
        )  # fmt: skip

    def relaxation_length(self, *, load: ArrayLike, pressure: ArrayLike) -> Array:
        """sigma_y = |Kya / Cy|, m."""
        stiffness = self.cornering_stiffness(load=load, pressure=pressure)
        return np.abs(stiffness / self.lateral_stiffness_at(load=load, pressure=pressure))


@dataclass(frozen=True)
class MF52Lateral:
    """Coefficients of MF-Tyre 5.2 (PAC2002) that hold C_Fy and the relaxation length over load."""

    fnomin: float
    pressure: float
    unloaded_radius: float
    pky1: float
    pky2: float
    pty1: float
    pty2: float
    load_range: tuple[float, float]
    pky3: float = 0.0
    lfzo: float = 1.0
    lky: float = 1.0
    lsgal: float = 1.0

    def cornering_stiffness(self, *, load: ArrayLike) -> Array:
        """C_Fy, N/rad."""
        return -self.lky * self.pky1 * self.lfzo * self.fnomin * self._saturation(load, self.pky2)

    def relaxation_length(self, *, load: ArrayLike) -> Array:
        """sigma_alpha, m."""
        scale = self.unloaded_radius * self.lfzo * self.lsgal
        return self.pty1 * self._saturation(load, self.pty2) * scale

    def lateral_stiffness_at(self, *, load: ArrayLike) -> Array:
        """K_y = C_Fy / sigma_alpha, N/m."""
        return self.cornering_stiffness(load=load) / self.relaxation_length(load=load)

    def _saturation(self, load: ArrayLike, position: float) -> Array:
        return mf61.saturation(np.asarray(load, dtype=np.float64) / (self.lfzo * self.fnomin) / position)


NAMES = (
    "PKY6", "PKY7", "PPY5", "LKYC", "PHY3", "PVY3", "PVY4", "LGAY", "LMUY", "QDZ1", "QDZ2", "PPZ1", "LTR", "QDZ8",
    "QDZ9", "PPZ2", "LKZC", "LGAZ", "QSX2", "QSX4", "QSX5", "QSX6", "QSX7", "QSX10", "QSX11", "PPMX1", "LMX",
)  # fmt: skip
"""Coefficients that are read, all dimensionless; those beginning with L are scale factors, 1 where missing."""


@dataclass(frozen=True)
class TirMoments:
    """Camber force and moments of a file."""

    coefficients: Mapping[str, float]  # of ``NAMES``, as far as the file has them
    nominal_load: float  # FNOMIN' = LFZO FNOMIN, N
    nominal_pressure: float | None  # NOMPRES, Pa; None for MF-Tyre 5.2, which has no pressure
    unloaded_radius: float | None  # r0, m; without it there are no moments
    iso_signs: bool  # PKY1 < 0

    def linear(self, *, load: Array, pressure: Array, cornering_stiffness: Array) -> dict[str, Array]:
        """Return what the file holds, by the name of a field of `TyreProperties`."""
        c, side = self._value, -1.0 if self.iso_signs else 1.0
        dfz = load / self.nominal_load - 1
        dpi = np.zeros_like(load) if self.nominal_pressure is None else pressure / self.nominal_pressure - 1
        old = self.nominal_pressure is None
        held: dict[str, Array] = {}
        if old and self._has("PHY3", "PVY3", "PVY4"):
            upright = side * load * (c("PVY3") + c("PVY4") * dfz) * c("LMUY")
            held["camber_stiffness"] = c("LGAY") * (c("PHY3") * cornering_stiffness + upright)
        if not old and self._has("PKY6", "PKY7"):
            held["camber_stiffness"] = side * load * (c("PKY6") + c("PKY7") * dfz) * (1 + c("PPY5") * dpi) * c("LKYC")
        if self.unloaded_radius is None:
            return held
        arm = load * self.unloaded_radius
        if self._has("QDZ1", "QDZ2"):
            held["pneumatic_trail"] = (
                arm / self.nominal_load * (c("QDZ1") + c("QDZ2") * dfz) * (1 - c("PPZ1") * dpi) * c("LTR")
            )
        if self._has("QDZ8", "QDZ9"):
            scale = c("LMUY") * c("LGAZ" if old else "LKZC")
            held["twisting_stiffness"] = side * arm * (c("QDZ8") + c("QDZ9") * dfz) * (1 + c("PPZ2") * dpi) * scale
        if self._has("QSX2", "QSX4", "QSX10"):
            relative = load / self.nominal_load
            share = c("QSX2") * (1 + c("PPMX1") * dpi) - c("QSX10") * np.arctan(c("QSX11") * relative)
            share -= c("QSX4") * c("QSX7") * np.cos(c("QSX5") * np.arctan((c("QSX6") * relative) ** 2))
            held["overturning_stiffness"] = arm * share * c("LMX")
        return held

    def _value(self, name: str) -> float:
        return self.coefficients.get(name, 1.0 if name.startswith("L") else 0.0)

    def _has(self, *names: str) -> bool:
        return any(self._value(name) for name in names)


def lateral_coefficients(file: TirText) -> MF61Lateral | MF52Lateral:
    """Return the coefficients of C_Fy and K_y; the model must be MF-Tyre 5.2, 6.1 or 6.2."""
    model, new, old = file.find("FITTYP", "PROPERTY_FILE_FORMAT"), (60, 61, 62), (5, 6, 21, 51, 52)
    names = ("PAC2002", "MF_05", "MF-TYRE")
    if isinstance(model, float) and model in new:
        return MF61Lateral(
            fnomin=file.positive("FNOMIN") * file.force,
            nompres=file.plausible_pressure("NOMPRES", file.positive("NOMPRES") * file.pressure),
            pky1=file.number("PKY1"), pky2=file.positive("PKY2"), lateral_stiffness=file.lateral_stiffness,
            load_range=file.range("FZMIN", "FZMAX", file.force),
            pressure_range=file.range("PRESMIN", "PRESMAX", file.pressure), pky4=file.number("PKY4", 2.0),
            **{key.lower(): file.number(key, 0.0) for key in ("PPY1", "PPY2", "PCFY1", "PCFY2", "PCFY3")},
            **{key.lower(): file.positive(key, 1.0) for key in ("LFZO", "LKY")},
        )  # fmt: skip
    if (isinstance(model, float) and model in old) or str(model).upper() in names:
        stated = file.find("INFLPRES", "NOMPRES")
        pressure = nan
        if isinstance(stated, float):
            pressure = file.plausible_pressure("INFLPRES or NOMPRES", stated * file.pressure)
        return MF52Lateral(
            fnomin=file.positive("FNOMIN") * file.force, pressure=pressure,
            unloaded_radius=file.positive("UNLOADED_RADIUS") * file.length, pky1=file.number("PKY1"),
            pky2=file.positive("PKY2"), pty1=file.number("PTY1", 0.0),
            load_range=file.range("FZMIN", "FZMAX", file.force), pky3=file.number("PKY3", 0.0),
            **{key.lower(): file.positive(key, 1.0) for key in ("PTY2", "LFZO", "LKY", "LSGAL")},
        )  # fmt: skip
    raise InputError(
        f"{file.source}: tyre model FITTYP or PROPERTY_FILE_FORMAT = {model!r} is neither MF-Tyre 5.2 "
        f"({old}, {names}) nor 6.1 or 6.2 ({new})"
    )


def moment_coefficients(file: TirText, model: MF61Lateral | MF52Lateral) -> TirMoments:
    """Return the coefficients of camber force and moments."""
    radius = file.number("UNLOADED_RADIUS", nan) * file.length
    return TirMoments(
        coefficients={name: file.number(name) for name in NAMES if file.find(name) is not None},
        nominal_load=model.lfzo * model.fnomin,
        nominal_pressure=model.nompres if isinstance(model, MF61Lateral) else None,
        unloaded_radius=radius if radius > 0 else None,
        iso_signs=model.pky1 < 0,
    )


@dataclass(frozen=True, eq=False)
class TirTyre(FormulaTyre):
    """The tyre of a property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2.

    Attributes
    ----------
    file : TirText
        The file as it stands; its comments ``TYRE`` and ``SURFACE`` name the tyre, if there are any.
    coefficients : MF61Lateral or MF52Lateral
        Lateral coefficients in SI units, ISO signs as in the file.
    moments : TirMoments
        Camber force and moments.
    """

    file: TirText
    coefficients: MF61Lateral | MF52Lateral = field(init=False)
    moments: TirMoments = field(init=False, repr=False)
    same_pressure: ClassVar[float] = 0.02  # MF-Tyre 5.2 has one pressure; a rig sets it within this share

    def __post_init__(self) -> None:
        super().__post_init__()
        file, model = self.file, lateral_coefficients(self.file)
        new = isinstance(model, MF61Lateral)
        tyre, surface = file.comments.get("TYRE", Path(file.source).stem), file.comments.get("SURFACE", "flat")
        width = file.number("WIDTH", 0.0) * file.length
        lines = [line.lower() for line in file.text.splitlines() if line.startswith(("!", "$"))]
        if isinstance(model, MF61Lateral):
            pressure_range, pressures = model.pressure_range, _known(*model.pressure_range, model.nompres)
        else:
            spread = self.same_pressure * model.pressure
            known = isfinite(model.pressure)
            pressure_range = (model.pressure - spread, model.pressure + spread) if known else (0.0, inf)
            pressures = _known(model.pressure)
        vars(self).update(
            coefficients=model, tyre=tyre, surface=surface, label=f"{tyre} on {surface} ({Path(file.source).name})",
            source=file.source, description=f"MF-Tyre {'6.1' if new else '5.2'} coefficients",
            width=width if width > 0 else None, load_range=model.load_range, pressure_range=pressure_range,
            loads=_known(*model.load_range, model.fnomin), pressures=pressures,
            synthetic=any("synthetic" in line for line in lines), moments=moment_coefficients(file, model),
        )  # fmt: skip
        vars(self)["range_kind"] = f"for which {self.label} holds"

    @cached_property
    def notes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Notes that a reader of any value must be told."""
        model, old = self.coefficients, isinstance(self.coefficients, MF52Lateral)
        told = {
            "synthetic: no rig measured this tyre": self.synthetic,
            "from a .tir file": True,
            "PKY1 is positive: the file does not keep ISO signs, adapted SAE signs are taken": model.pky1 > 0,
            "the file names no surface: taken as flat": "SURFACE" not in self.file.comments,
            "the file states no pressure: its values are taken at the one asked for":
                old and self.pressure_range[1] == inf,
            "the file states no range of pressures (PRESMIN, PRESMAX)": not old and self.pressure_range[1] == inf,
            "the file states no range of loads (FZMIN, FZMAX)": self.load_range[1] == inf,
            "no relaxation coefficients PTY1, PTY2: LATERAL_STIFFNESS gives the relaxation length":
                isinstance(model, MF52Lateral) and model.pty1 <= 0 and isfinite(self.file.lateral_stiffness),
        }  # fmt: skip
        return (*(note for note, holds in told.items() if holds), *self.doubts)

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Return the quantities of the file at many conditions; nothing is checked."""
        model, stiffness = self.coefficients, self.file.lateral_stiffness
        if isinstance(model, MF61Lateral):
            cornering = model.cornering_stiffness(load=load, pressure=pressure)
            lateral, held_lateral = model.lateral_stiffness_at(load=load, pressure=pressure), isfinite(stiffness)
        else:
            cornering = model.cornering_stiffness(load=load)
            lateral, held_lateral = np.full(np.shape(load), stiffness), isfinite(stiffness) or model.pty1 > 0
            if model.pty1 > 0:
                lateral = np.abs(cornering) / model.relaxation_length(load=load)
        if model.pky1 > 0:
            cornering = -cornering
        held = {"cornering_stiffness": cornering}
        if held_lateral:
            held |= {"lateral_stiffness": lateral, "relaxation_length": cornering / lateral}
        return held | self.moments.linear(load=load, pressure=pressure, cornering_stiffness=cornering)

    def _check(self, load: float, pressure: float) -> None:
        super()._check(load, pressure)
        model = self.coefficients
        if isinstance(model, MF52Lateral) and abs(pressure - model.pressure) > self.same_pressure * model.pressure:
            raise InputError(
                f"{self.file.source}: an MF-Tyre 5.2 file holds one pressure, here {model.pressure / PASCAL_PER_BAR:g} "
                f"bar; {pressure / PASCAL_PER_BAR:g} bar needs a file of its own"
            )


def _known(*values: float) -> Array:
    """Return the positive and finite values, ascending, each once."""
    return np.unique([value for value in values if 0 < value < inf])


def read_tir(path: str | Path) -> TirTyre:
    """Read a tyre property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2."""
    return parse_tir(read_text(path), source=str(path))


def parse_tir(text: str, *, source: str) -> TirTyre:
    """Interpret the text of a .tir file; the errors name ``source``."""
    return TirTyre(parse(text, source=source))


def fit_mf61(
    *, load: ArrayLike, pressure: ArrayLike, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike
) -> MF61Lateral:
    """Fit the MF-Tyre 6.1 form to measured stiffnesses: the coefficients are those of the trends of a `TyreMap`."""
    fz, p, c, k = _columns(load, pressure, cornering_stiffness, lateral_stiffness)
    cornering, lateral = mf61.fit_cornering_stiffness(fz, p, c), mf61.fit_lateral_stiffness(fz, p, k)
    found = {key.lower(): value for key, value in (cornering.coefficients | lateral.coefficients).items()}
    return MF61Lateral(
        **found | {"pky1": -found["pky1"]}, pcfy2=0.0, fnomin=cornering.nominal["FNOMIN"],
        nompres=cornering.nominal["NOMPRES"], load_range=(float(fz.min()), float(fz.max())),
        pressure_range=(float(p.min()), float(p.max())),
    )  # fmt: skip


def fit_mf52(
    *, load: ArrayLike, pressure: float, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike,
    unloaded_radius: float,
) -> MF52Lateral:  # fmt: skip
    """Fit the MF-Tyre 5.2 form at one pressure."""
    fz, _, c, k = _columns(load, np.full(np.shape(load), pressure), cornering_stiffness, lateral_stiffness)
    if not unloaded_radius > 0.0:
        raise InputError(f"unloaded radius is {unloaded_radius:g} m, it must be positive")
    fnomin = float(fz.min() + fz.max()) / 2.0
    pky1, pky2 = _arch(fz / fnomin, c / fnomin)
    pty1, pty2 = _arch(fz / fnomin, c / k / unloaded_radius)
    return MF52Lateral(
        fnomin=fnomin, pressure=float(pressure), unloaded_radius=float(unloaded_radius), pky1=-pky1, pky2=pky2,
        pty1=pty1, pty2=pty2, load_range=(float(fz.min()), float(fz.max())),
    )  # fmt: skip


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


def _columns(*arrays: ArrayLike) -> list[Array]:
    columns = [np.atleast_1d(np.asarray(array, dtype=np.float64)) for array in arrays]
    shapes = {column.shape for column in columns}
    if len(shapes) != 1 or columns[0].ndim != 1 or not columns[0].size:
        raise InputError("load, pressure and both stiffnesses must be lists of one length, of one condition or more")
    for name, column in zip(("load", "pressure", "cornering stiffness", "lateral stiffness"), columns, strict=True):
        if not (np.isfinite(column) & (column > 0.0)).all():
            raise InputError(f"{name} must be positive everywhere, its smallest value is {column.min():g}")
    return columns


def write_tir(
    coefficients: MF61Lateral | MF52Lateral, path: str | Path, *, tyre: str, surface: str,
    unloaded_radius: float | None = None, version: int = 61, further: Mapping[str, float] | None = None,
    notes: tuple[str, ...] = (),
) -> None:  # fmt: skip
    """Write lateral stiffnesses as a tyre property file, SI units, ISO signs."""
    path = Path(path)
    if path.suffix.casefold() != ".tir":
        raise InputError(f"{path}: a tyre property file must end in .tir")
    if version not in (61, 62):
        raise InputError(f"{path}: version {version} is neither 61 nor 62")
    if not coefficients.pky1 < 0.0:
        raise InputError(f"{path}: PKY1 = {coefficients.pky1:g} must be negative in the ISO signs of a .tir file")
    radius = coefficients.unloaded_radius if isinstance(coefficients, MF52Lateral) else unloaded_radius
    if radius is None or not radius > 0.0:
        raise InputError(f"{path}: the unloaded radius (m) of the tyre is needed in a .tir file, got {radius}")
    sections = _sections(coefficients, radius, version)
    sections["LATERAL_COEFFICIENTS"] |= dict(further or {})
    comments = (f": TYRE : {tyre}", f": SURFACE : {surface}", *notes, "lateral stiffness and relaxation length only")
    lines = ["[MDI_HEADER]", "FILE_TYPE = 'tir'", "FILE_VERSION = 3.0", "FILE_FORMAT = 'ASCII'"]
    lines += [f"! {' '.join(comment.split())}" for comment in comments]
    for section, values in sections.items():
        lines += [f"$ {'-' * (69 - len(section))} {section.lower()}", f"[{section}]"]
        lines += [f"{key:<28} = {_printed(value)}" for key, value in values.items()]
    write_text(path, "\n".join(lines) + "\n")


def _printed(value: float | str) -> str:
    if isinstance(value, str):
        return f"'{value}'"
    return str(value) if isinstance(value, int) else repr(float(value))


def _sections(model: MF61Lateral | MF52Lateral, radius: float, version: int) -> dict[str, dict[str, float | str]]:
    def values(*keys: str) -> dict[str, float | str]:
        return {key: getattr(model, key.lower()) for key in keys}

    low, high = model.load_range
    sections: dict[str, dict[str, float | str]] = {
        "UNITS": {"LENGTH": "meter", "FORCE": "newton", "ANGLE": "radians", "MASS": "kg", "TIME": "second"},
        "MODEL": {"FITTYP": version},
        "DIMENSION": {"UNLOADED_RADIUS": float(radius)},
        "OPERATING_CONDITIONS": {},
        "VERTICAL": values("FNOMIN"),
        "VERTICAL_FORCE_RANGE": {"FZMIN": low, "FZMAX": high},
        "SCALING_COEFFICIENTS": values("LFZO", "LKY"),
        "LATERAL_COEFFICIENTS": values("PKY1", "PKY2"),
    }
    if isinstance(model, MF61Lateral):
        soft, hard = model.pressure_range
        sections["OPERATING_CONDITIONS"] = {"INFLPRES": model.nompres, "NOMPRES": model.nompres}
        sections["INFLATION_PRESSURE_RANGE"] = {"PRESMIN": soft, "PRESMAX": hard}
        lateral = ("LATERAL_STIFFNESS",) if isfinite(model.lateral_stiffness) else ()
        sections["STRUCTURAL"] = values(*lateral, "PCFY1", "PCFY2", "PCFY3")
        sections["LATERAL_COEFFICIENTS"] |= values("PKY4", "PPY1", "PPY2")
    else:
        sections["MODEL"] = {"FITTYP": 52, "PROPERTY_FILE_FORMAT": "PAC2002"}
        sections["OPERATING_CONDITIONS"] = {"INFLPRES": model.pressure}
        sections["SCALING_COEFFICIENTS"] |= values("LSGAL")
        sections["LATERAL_COEFFICIENTS"] |= values("PKY3", "PTY1", "PTY2")
    return sections
