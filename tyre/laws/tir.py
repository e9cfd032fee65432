"""Tyre property files (.tir) of MF-Tyre 5.2, 6.1, 6.2 and of motorcycle tyres: read, checked, fitted, written."""

import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from math import inf, isfinite, nan
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike

from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, hint, plain_digits, shown
from tyre.ground.files import read_text, write_text
from tyre.ground.units import PASCAL_PER_BAR, find_unit
from tyre.laws import magic_formula as mf61
from tyre.laws.formula_tyre import FormulaTyre
from tyre.laws.tir_laws import OVER_PRESSURE, POSITIVE, TAKEN, Coefficients, Version
from tyre.laws.tir_laws import PRESSURE as PRESSURE_LAW
from tyre.measured.plausible import LARGEST, SMALLEST
from tyre.measured.properties import POSSIBLE_PRESSURE, SAME_PRESSURE

# quantity of the values with a unit; all others are pure numbers
QUANTITY = dict.fromkeys(("FNOMIN", "FZMIN", "FZMAX"), "force") | dict.fromkeys(("UNLOADED_RADIUS", "WIDTH"), "length")
QUANTITY |= dict.fromkeys(("NOMPRES", "IP_NOM", "INFLPRES", "IP", "PRESMIN", "PRESMAX"), "pressure")
QUANTITY |= {"LATERAL_STIFFNESS": "stiffness"}


@dataclass(frozen=True)
class TirText:
    """A .tir file: its text verbatim and its values."""

    source: str  # name for error messages
    text: str = field(repr=False)  # the whole file
    # values by section and key, in the units of the file; keys without a value are left out
    sections: dict[str, dict[str, float | str]]
    comments: dict[str, str]  # ``TYRE`` and ``SURFACE`` from the comment lines, if the file has them
    skipped: tuple[str, ...] = ()  # numbers and beginnings of lines that are nothing, such as ends of wrapped comments

    @cached_property
    def values(self) -> dict[str, float | str]:
        """Values by key; of a key in several sections the first."""
        values: dict[str, float | str] = {}
        for section in self.sections.values():
            values = section | values
        return values

    @cached_property
    def factors(self) -> dict[str, float]:
        """Factors to SI by quantity; the pressure is force over length squared if the file states no unit of it."""
        units = self.sections.get("UNITS", {})
        angle = str(units.get("ANGLE", "radians")).casefold()
        if angle not in ("radian", "radians", "rad"):
            raise InputError(f"{self.source}, [UNITS]: ANGLE = {angle!r}; only coefficients in radians are understood")
        plain = {"pascal": "pa", "kpascal": "kpa", "millimeter": "mm", "centimeter": "cm", "kilonewton": "kn"}
        factors = {}
        for quantity, default in (("force", "newton"), ("length", "meter"), ("pressure", "")):
            text = str(units.get(quantity.upper(), default)).casefold()
            where = f"{self.source}, [UNITS] {quantity.upper()}"
            if text or quantity.upper() in units:
                factors[quantity] = find_unit(plain.get(text, text), quantity, where=where).factor
        stiffness = factors["force"] / factors["length"]
        return {"pressure": stiffness / factors["length"], "stiffness": stiffness} | factors

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
    skipped: list[str] = []
    current: dict[str, float | str] | None = None
    for number, line in enumerate(re.split(r"\r\n|\r|\n", text), start=1):
        where = f"{source}, line {number}"
        stripped = line.strip()
        if not stripped or stripped[0] in "$!#":
            if comment := re.match(r"^!\s*:?\s*(TYRE|SURFACE)\s*:\s*(.+)$", stripped):
                comments.setdefault(comment[1], comment[2].strip())
            continue
        if stripped[0] == "[":
            current = sections.setdefault(stripped.partition("]")[0][1:].strip().upper(), {})
            continue
        assignment = re.match(r"^\s*([A-Za-z_]\w*)\s*=\s*(.*)$", line)
        if assignment is None:
            if stripped[0] == "{" or re.fullmatch(r"[-+.\deEdD\s]+", re.split(r"[$!]", stripped)[0]):
                continue  # a table such as [SHAPE], of no use here and kept in the text
            if "=" in stripped:
                raise InputError(f"{where}: {stripped[:60]!r} is no section, assignment, table row or comment")
            skipped.append(f"line {number} {stripped[:30]!r}")
            continue
        if current is None:
            raise InputError(f"{where}: {stripped[:60]!r} comes before the first [SECTION]; is this a .tir file?")
        key = assignment[1].upper()
        value = _value(assignment[2].strip())
        if value == "":
            continue
        if key in current:
            raise InputError(f"{where}: {key} is given twice in its section; keep one")
        current[key] = value
    if not sections:
        raise InputError(f"{source}: has no [SECTION]; is this a .tir file?")
    return TirText(source, text, sections, comments, tuple(skipped))


def _value(text: str) -> float | str:
    if text[:1] in ("'", '"'):
        return text[1:].partition(text[0])[0].strip()
    text = re.split(r"[$!]", text)[0].strip()
    text = re.sub(r"^([-+]?\d*\.\d*)[dD]([-+]?\d+)$", r"\1e\2", text)  # as Fortran writes it
    try:
        return value if plain_digits(text) and isfinite(value := float(text)) else text
    except ValueError:
        return text


NEW, OLD, EITHER = (60.0, 61.0, 62.0), (5.0, 6.0, 21.0, "PAC2002", "MF05", "MFTYRE"), (51.0, 52.0)
MOTORCYCLE = ("PACMC", "MFMCTYRE")
PRESSURES = ("NOMPRES", "IP_NOM", "INFLPRES", "IP")
# coefficients that velotyre's quantities depend on in one law or another
OF_LATERAL_FORCE = re.compile(r"(P[CDEKHV]Y|PP[YZ]|PTY|Q[BCDEH]Z|QSX|PPMX)\d+")
LEAST_CHANGE = {"cornering stiffness": 0.005, "moment of camber": 0.02}  # relative, by shifts, that is worth a word
LATER = ("PKY4", "PKY5", "PKY6", "PKY7")  # coefficients that MF-Tyre 5.2 does not have


def version_of(file: TirText) -> Version:
    """Identify the model of a file by its name (FITTYP or PROPERTY_FILE_FORMAT) and by its coefficients."""
    model_name = file.values.get("FITTYP", file.values.get("PROPERTY_FILE_FORMAT"))
    model = re.sub(r"[\W_]", "", model_name).upper() if isinstance(model_name, str) else model_name
    later = [name for name in LATER if file.values.get(name)]
    if model is not None and model not in (*NEW, *OLD, *EITHER, *MOTORCYCLE):
        raise InputError(
            f"{file.source}: tyre model FITTYP or PROPERTY_FILE_FORMAT = {model_name!r} is neither MF-Tyre 5.2 (5, 6, "
            "21, PAC2002, MF_05, MF-TYRE), nor 6.1 or 6.2 (60, 61, 62), nor of a motorcycle tyre (PAC_MC, MF-MCTyre)"
        )
    if file.values.get("PCY2") or model in MOTORCYCLE:
        if model in NEW:
            raise InputError(
                f"{file.source}: PCY2 is of a motorcycle tyre, FITTYP = {model_name:g} is not; correct one"
            )
        return "motorcycle"
    if model in NEW or (model is None and later):
        return "6.1"
    if later:
        raise InputError(
            f"{file.source}: {later[0]} is no coefficient of MF-Tyre 5.2 ({model_name!r}); write FITTYP = 61 if it is "
            "of 6.1, or give PCY2 if it is of a motorcycle tyre"
        )
    return "5.2"


def coefficients_of(file: TirText, *, camber_in_trail: bool = False) -> Coefficients:
    """Return the coefficients of a file."""
    version = version_of(file)
    old = version == "5.2"
    needed = {"FNOMIN", "PKY1", "PKY2"}
    if version == "6.1" and any(file.values.get(name) for name in OVER_PRESSURE):
        needed |= {"NOMPRES"}
    needed |= {"PKY3"} if version == "motorcycle" else set()
    if old and file.values.get("PTY1"):
        needed |= {"UNLOADED_RADIUS"}
    zero = {name for name in ("LATERAL_STIFFNESS", "PTY2") if file.values.get(name) == 0}  # it was not fitted
    values = {
        name: file.number(name, positive=name in POSITIVE or (old and name == "UNLOADED_RADIUS"))
        for name in dict.fromkeys(("FNOMIN", "UNLOADED_RADIUS", *TAKEN[version], *sorted(needed)))
        if (name in file.values and name not in zero) or name in needed
    }
    pressures_of_file = {name: file.number(name) for name in PRESSURES if isinstance(file.values.get(name), float)}
    for name, pressure in pressures_of_file.items():
        if not POSSIBLE_PRESSURE[0] <= pressure <= POSSIBLE_PRESSURE[1]:
            raise InputError(f"{file.source}: {name} is {pressure:g} Pa, tyres have 2e4 to 2.5e6 Pa; check [UNITS]")
    nominal = pressures_of_file.get("NOMPRES", pressures_of_file.get("IP_NOM", nan))
    if version != "6.1" and not (nominal > 0 and any(values.get(name) for name in PRESSURE_LAW)):
        nominal = pressures_of_file.get(
            "INFLPRES", pressures_of_file.get("IP", nominal)
        )  # the only one for which the file holds
        values = {name: value for name, value in values.items() if name not in PRESSURE_LAW}
    values |= {"NOMPRES": nominal} if nominal > 0 else {}
    pressures = file.range("PRESMIN", "PRESMAX") if version == "6.1" else (0.0, inf)
    return Coefficients(values, version, file.range("FZMIN", "FZMAX"), pressures, camber_in_trail)


CAMBER_MOMENTS = ("software", "book")
KINDS = {"5.2": "MF-Tyre 5.2", "6.1": "MF-Tyre 6.1", "motorcycle": "motorcycle tyre"}


@dataclass(frozen=True, eq=False)
class TirTyre(FormulaTyre):
    """The tyre of a property file of MF-Tyre 5.2 (PAC2002), 6.1, 6.2 or of a motorcycle tyre.

    Attributes
    ----------
    file : TirText
        The file as it stands; its comments ``TYRE`` and ``SURFACE`` name the tyre, if there are any.
    camber_moment : str
        Moment of a leaning tyre of MF-Tyre 6.1 and 6.2: ``software`` takes -t times the lateral force without camber,
        as the programs do that write such files (Pacejka 2012, 4.E32, 4.E74); ``book`` takes -t times the whole
        (4.E49).
    coefficients : Coefficients
        In SI units, signs as in the file.
    """

    file: TirText
    camber_moment: str = "software"
    coefficients: Coefficients = field(init=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.camber_moment not in CAMBER_MOMENTS:
            raise InputError(f"camber_moment = {self.camber_moment!r} must be {' or '.join(map(repr, CAMBER_MOMENTS))}")
        file, model = self.file, coefficients_of(self.file, camber_in_trail=self.camber_moment == "book")
        tyre, surface = file.comments.get("TYRE", Path(file.source).stem), file.comments.get("SURFACE", "flat")
        width, nominal, pressure_range = file.number("WIDTH", 0.0), model["NOMPRES"], model.pressure_range
        if not model.by_pressure and nominal > 0:
            pressure_range = (1 - SAME_PRESSURE) * nominal, (1 + SAME_PRESSURE) * nominal
        inflation = file.number("IP", nan) if model.by_pressure and isinstance(file.values.get("IP"), float) else nan
        lines = [line.lower() for line in file.text.splitlines() if line.startswith(("!", "$"))]
        label = f"{tyre} on {surface} ({Path(file.source).name})"
        vars(self).update(
            coefficients=model,
            tyre=tyre,
            surface=surface,
            label=label,
            source=file.source,
            description=f"{KINDS[model.version]} coefficients",
            width=width if width > 0 else None,
            load_range=model.load_range,
            pressure_range=pressure_range,
            range_kind=f"for which {label} holds",
            loads=_sort_positive(*model.load_range, model["FNOMIN"]),
            pressures=_sort_positive(*model.pressure_range, nominal, inflation),
            default_pressure=None if model.by_pressure else nominal,
            surface_stated="SURFACE" in file.comments,
            synthetic=any("synthetic" in line for line in lines),
        )

    @cached_property
    def notes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Notes that a reader of any value must know."""
        model, file, any_pressure = self.coefficients, self.file, self.pressure_range[1] == inf
        unused = [n for n, v in file.values.items() if v and OF_LATERAL_FORCE.fullmatch(n) and n not in model.values]
        changes = zip(LEAST_CHANGE.items(), model.change_by_shifts, strict=True)
        shifted = [f"{name} {100 * by:+.1f} %" for (name, least), by in changes if abs(by) > least]
        leans = model.version == "6.1" and model.has("PKY6", "PKY7") and model.has("QDZ1", "QDZ2")
        trail, other_choice = ("the lateral force without camber (4.E32, 4.E74)", "book")
        if model.camber_in_trail:
            trail, other_choice = "the whole lateral force (4.E49)", "software"
        names_model = bool({"FITTYP", "PROPERTY_FILE_FORMAT"} & set(file.values))
        length_from_stiffness = model.old and model["PTY1"] <= 0 and isfinite(model["LATERAL_STIFFNESS"])
        no_pressure = self.default_pressure is not None and any_pressure
        remarks = [
            (self.synthetic, "synthetic: no rig measured this tyre"),
            (True, "from a .tir file"),
            (
                not names_model,
                f"the file names no model; its coefficients are taken as those of MF-Tyre {model.version}",
            ),
            (
                model.version == "motorcycle",
                "coefficients of a motorcycle tyre: lateral force after Pacejka (2012), chapter 11; its moments are "
                "not taken",
            ),
            (
                model["PKY1"] > 0,
                "PKY1 is positive: the file does not keep ISO signs, adapted SAE signs are taken",
            ),
            ("SURFACE" not in file.comments, "the file names no surface: taken as flat"),
            (no_pressure, f"the file states no pressure{self._pressure_in_comments}"),
            (
                model.by_pressure and any_pressure,
                "the file states no range of pressures (PRESMIN, PRESMAX)",
            ),
            (self.load_range[1] == inf, "the file states no range of loads (FZMIN, FZMAX)"),
            (
                length_from_stiffness,
                "no relaxation coefficients PTY1, PTY2: LATERAL_STIFFNESS gives the relaxation length",
            ),
            (
                leans,
                f"moment of camber: -t times {trail} and the residual moment; camber_moment = '{other_choice}' takes "
                "the other",
            ),
            (bool(unused), f"not used of the file: {', '.join(unused)}"),
            (bool(shifted), f"its shifts of the curve are left out; with them {' and '.join(shifted)}"),
            (
                bool(file.skipped),
                f"{len(file.skipped)} lines that are neither section, assignment nor comment are passed over: "
                f"{', '.join(file.skipped)}",
            ),
        ]
        return (*(text for holds, text in remarks if holds), *self.doubts)

    @property
    def _pressure_in_comments(self) -> str:
        """Words of the first comment that names a pressure; it is shown, not used."""
        for line in self.file.text.splitlines():
            comment = re.match(r"\s*[!$#][\s:]*(?:COMMENT\s*:)?\s*(.*\bpress.*\d.*)", line, re.IGNORECASE)
            if comment:
                return f"; a comment states {comment[1].strip()[:80]!r}"
        return ""

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Return the quantities of the file at many conditions; nothing is checked."""
        return self.coefficients.linear(load=load, pressure=pressure)

    def lateral_force(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Lateral force of the full curve, N; adapted SAE signs."""
        with self._named():
            return self.coefficients.lateral_force(slip_angle=slip_angle, load=load, pressure=pressure, camber=camber)

    def aligning_moment(
        self, *, slip_angle: ArrayLike, load: ArrayLike, pressure: float, camber: ArrayLike = 0.0
    ) -> Array:
        """Aligning moment of the full curve, N m; adapted SAE signs."""
        with self._named():
            return self.coefficients.aligning_moment(slip_angle=slip_angle, load=load, pressure=pressure, camber=camber)

    @contextmanager
    def _named(self) -> Iterator[None]:
        try:
            yield
        except InputError as error:
            raise InputError(f"{self.file.source}: {error}") from error

    def _refuse(self, load: float, pressure: float) -> None:
        nominal = self.coefficients["NOMPRES"]
        if not self.coefficients.by_pressure and abs(pressure - nominal) > SAME_PRESSURE * nominal:
            raise InputError(
                f"{self.file.source}: it holds one pressure, here {nominal / PASCAL_PER_BAR:g} "
                f"bar; {pressure / PASCAL_PER_BAR:g} bar needs a file of its own"
            )


def _sort_positive(*values: float) -> Array:
    """Return the positive and finite values, ascending, each once."""
    return np.unique([value for value in values if 0 < value < inf])


def read_tir(path: str | Path) -> TirTyre:
    """Read a tyre property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2."""
    return parse_tir(read_text(Path(path), fallback="latin-1"), source=str(path))


def parse_tir(text: str, *, source: str) -> TirTyre:
    """Interpret the text of a .tir file; the errors name ``source``."""
    return TirTyre(parse(text, source=source))


def fit_mf61(
    *, load: ArrayLike, pressure: ArrayLike, cornering_stiffness: ArrayLike, lateral_stiffness: ArrayLike
) -> Coefficients:
    """Fit the MF-Tyre 6.1 form to measured stiffnesses: the coefficients are those of the trends of a `TyreMap`."""
    fz, p, c, k = (np.asarray(column, float) for column in (load, pressure, cornering_stiffness, lateral_stiffness))
    cornering, lateral = mf61.fit(mf61.CORNERING, fz, p, c), mf61.fit(mf61.LATERAL, fz, p, k)
    coefficients = cornering.coefficients | lateral.coefficients | cornering.nominal | {"PKY4": 2.0}
    coefficients["PKY1"] *= -1
    return Coefficients(coefficients, "6.1", (float(fz.min()), float(fz.max())), (float(p.min()), float(p.max())))


def fit_mf52(
    *,
    load: ArrayLike,
    pressure: float,
    cornering_stiffness: ArrayLike,
    lateral_stiffness: ArrayLike,
    unloaded_radius: float,
) -> Coefficients:
    """Fit the MF-Tyre 5.2 form at one pressure."""
    fz, c, k = (np.asarray(column, float) for column in (load, cornering_stiffness, lateral_stiffness))
    nominal = float(fz.min() + fz.max()) / 2.0
    height, position = _arch(fz / nominal, c / nominal)
    length, place = _arch(fz / nominal, c / k / unloaded_radius)
    coefficients = {"FNOMIN": nominal, "NOMPRES": float(pressure), "UNLOADED_RADIUS": float(unloaded_radius)}
    coefficients |= {"PKY1": -height, "PKY2": position, "PTY1": length, "PTY2": place}
    return Coefficients(coefficients, "5.2", (float(fz.min()), float(fz.max())))


def _arch(relative_load: Array, value: Array) -> tuple[float, float]:
    """Height and load of the maximum of value = height sin(2 atan(relative_load / position))."""
    if len(np.unique(relative_load)) == 1:
        return float(np.mean(value) / mf61.saturation(np.mean(relative_load))), 1.0
    from scipy.optimize import least_squares

    solved = least_squares(
        lambda x: x[0] * mf61.saturation(relative_load / x[1]) / value - 1.0,
        [float(np.mean(value)), 1.0],
        bounds=([0.0, 0.05], [np.inf, 50.0]),
        xtol=1e-14,
        ftol=1e-14,
        gtol=1e-14,
    )
    return float(solved.x[0]), float(solved.x[1])


# sections of a file that is written, and the coefficients in them; those of one version alone come last
LAYOUT = {
    "DIMENSION": ("UNLOADED_RADIUS",), "OPERATING_CONDITIONS": ("INFLPRES", "NOMPRES"),
    "INFLATION_PRESSURE_RANGE": ("PRESMIN", "PRESMAX"), "VERTICAL": ("FNOMIN",),
    "VERTICAL_FORCE_RANGE": ("FZMIN", "FZMAX"), "STRUCTURAL": ("LATERAL_STIFFNESS", "PCFY1", "PCFY2", "PCFY3"),
    "SCALING_COEFFICIENTS": ("LFZO", "LKY", "LSGAL"),
    "LATERAL_COEFFICIENTS": ("PKY1", "PKY2", "PKY3", "PKY4", "PPY1", "PPY2", "PTY1", "PTY2"),
}  # fmt: skip
ONLY_NEW = ("NOMPRES", "PRESMIN", "PRESMAX", *LAYOUT["STRUCTURAL"], "PKY4", "PPY1", "PPY2")
ONLY_OLD = ("LSGAL", "PKY3", "PTY1", "PTY2")


def write_tir(
    coefficients: Coefficients,
    path: str | Path,
    *,
    tyre: str,
    surface: str,
    unloaded_radius: float | None = None,
    notes: tuple[str, ...] = (),
) -> None:
    """Write coefficients as a tyre property file, SI units, ISO signs."""
    path, model = Path(path), coefficients
    if path.suffix.casefold() != ".tir":
        raise InputError(f"{path}: a tyre property file must end in .tir")
    if not model["PKY1"] < 0.0:
        raise InputError(f"{path}: PKY1 = {model['PKY1']:g} must be negative in the ISO signs of a .tir file")
    radius = model.values.get("UNLOADED_RADIUS", unloaded_radius)
    if radius is None or not radius > 0.0:
        raise InputError(f"{path}: the unloaded radius (m) of the tyre is needed in a .tir file, got {radius}")
    operating = {"UNLOADED_RADIUS": float(radius), "INFLPRES": model["NOMPRES"]}
    operating |= dict(
        zip(("FZMIN", "FZMAX", "PRESMIN", "PRESMAX"), model.load_range + model.pressure_range, strict=True)
    )
    comments = (f": TYRE : {tyre}", f": SURFACE : {surface}", *notes, "lateral stiffness and relaxation length only")
    lines = ["[MDI_HEADER]", "FILE_TYPE = 'tir'", "FILE_VERSION = 3.0", "FILE_FORMAT = 'ASCII'"]
    lines += [f"! {' '.join(comment.split())}" for comment in comments]
    lines += ["[UNITS]", "LENGTH = 'meter'", "FORCE = 'newton'", "ANGLE = 'radians'", "MASS = 'kg'", "TIME = 'second'"]
    lines += ["[MODEL]", *(["FITTYP = 52", "PROPERTY_FILE_FORMAT = 'PAC2002'"] if model.old else ["FITTYP = 61"])]
    for section, names in LAYOUT.items():
        of_others = ONLY_NEW if model.old else ONLY_OLD
        values = {name: operating.get(name, model[name]) for name in names if name not in of_others}
        lines += [f"$ {'-' * (69 - len(section))} {section.lower()}", f"[{section}]"] if values else []
        lines += [f"{name:<28} = {value!r}" for name, value in values.items() if isfinite(value)]
    write_text(path, "\n".join(lines) + "\n")
