"""Modal data: eigenvalues of named modes at speeds, optionally with mode-shape ratios, with standard deviations.

d(lambda) = u (dF - lambda dE) x with left and right eigenvectors, u E x = 1, and dx from the other modes.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from bicycle.identification.scatter import about_one_speed, repeats, surprise
from bicycle.model.eigen import eigensystem
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.parameters.parameter_covariance import entries_of
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import known_modes
from studies.diagnosis.bicycle_kind import SPEED, SPEED_AXIS, BicycleKind, refuse_repeats
from studies.diagnosis.corrected_model import with_values
from studies.diagnosis.doubts import ANGLES, FREQUENCIES, SPEEDS
from studies.diagnosis.family import Family, MatrixSlopes, Settings, flat_parts
from studies.diagnosis.mistakes import (
    apply_sensor,
    bias_identified,
    delay_error,
    errors_of,
    gain_error,
    identification_errors,
    lowpass_error,
    rotation_error,
    speed_errors,
    turn_ratios,
)
from studies.diagnosis.modal_columns import read_modal_columns
from studies.diagnosis.pairing import Wanted, compared_with_another, misnamed, root_of
from studies.inference import kind as base
from studies.inference.evidence import folds
from studies.inference.fit import Fit
from studies.inference.judge import Judgement
from studies.inference.kind import Candidates, Proposal, Rows, Series
from studies.inference.parameter import Candidate
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, unknown
from tyre.ground.schema import Check, number, path_key, read, table
from tyre.ground.text_table import Columns
from tyre.measured.plausible import LARGEST

# ---- the table ----

RATIOS = {"steer_over_lean": "steer_rate", "yaw_over_lean": "yaw_rate"}  # and their output over the lean rate
EIGENVALUE = ("real_1_s", "imag_rad_s")
SD = ("real_sd_1_s", "imag_sd_rad_s")
UNUSED = ("speed_min_m_s", "speed_max_m_s")
SPEED_SD = "speed_sd_m_s"
FASTEST_ROOT = 200.0  # 1/s, about 30 Hz
NOISE = number(
    least=1e-5,
    most=LARGEST,
    outside=f"must be 1e-05 or more, {LARGEST:g} or less: no measurement is free of noise; leave an unknown one out",
)
RATIO = number(least=-1e5, most=1e5)  # a ratio of two rates


def _or_empty(check: Check) -> Check:
    """Let an empty cell be NaN (not measured, or not known) beside what a ``check`` allows."""
    return lambda cell: np.nan if cell == "" else check(cell)


NUMBERS: dict[str, Check] = {
    "speed_m_s": SPEED,
    "real_1_s": _or_empty(number(least=-FASTEST_ROOT, most=FASTEST_ROOT)),
    "imag_rad_s": _or_empty(
        number(
            least=0,
            most=FASTEST_ROOT,
            outside=f"is outside 0 .. {FASTEST_ROOT:g}: give the root with imag_rad_s >= 0, in rad/s and not in Hz",
        )
    ),
    **dict.fromkeys((*SD, SPEED_SD), _or_empty(NOISE)),
    **{f"{ratio}_{part}": NOISE if part == "sd" else RATIO for ratio in RATIOS for part in ("re", "im", "sd")},
    **dict.fromkeys(UNUSED, number()),
}
DEFAULT_SD = 0.03  # of |eigenvalue|, without sd and repeats
DEFAULT_RATIO_SD = 0.05
MOST_ROWS = 5000  # beyond, a diagnosis takes hours and tells no more than the means
FEWEST_REPEATS = 5  # degrees of freedom of all repeats together


@dataclass(frozen=True)
class ModalPoint:
    """A measured eigenvalue (imaginary part >= 0), the sd of its parts, and shape ratios ``name -> (value, sd)``."""

    speed: float  # m/s
    mode: str  # weave, capsize ... of :func:`known_modes`
    eigenvalue: complex  # 1/s and rad/s; a part that was not measured is NaN
    sd: tuple[float, float]  # 1/s and rad/s; 0 of the frequency of a real root, which has none to be measured
    # of two rates, -; one sd for both parts of the number
    ratios: Mapping[str, tuple[complex, float]] = field(default_factory=dict)
    group: str = ""
    settings: Settings = ()  # parameters of effects that were set otherwise in this row, exactly

    def times(self, real: float = 1.0, imag: float = 1.0, speed: float = 1.0) -> "ModalPoint":
        """The point with factors on both parts of its eigenvalue, their sd alike, and on its speed."""
        root = complex(real * self.eigenvalue.real, imag * self.eigenvalue.imag)
        sd = (abs(real) * self.sd[0], abs(imag) * self.sd[1])
        return replace(self, eigenvalue=root, sd=sd, speed=speed * self.speed)

    def without_frequency(self) -> "ModalPoint":
        """The point with an imaginary part that is not measured."""
        return replace(self, eigenvalue=complex(self.eigenvalue.real, np.nan))

    def with_ratios(self, names: Mapping[str, str], factor: float) -> "ModalPoint":
        """The point with ratios under other ``names``, times a ``factor``; those that are not named stay."""
        renamed = {names[n]: (factor * x, abs(factor) * sd) for n, (x, sd) in self.ratios.items() if n in names}
        return replace(self, ratios={**self.ratios, **renamed})

    @property
    def called(self) -> str:
        """The mode, with its settings: ``weave (steer_assist.gain = 8)``."""
        settings = ", ".join(f"{key} = {value:g}" for key, value in self.settings)
        return f"{self.mode} ({settings})" if settings else self.mode


def _read_points(
    content: Any, folder: Path, model: Model, uncertainty: Mapping[str, float]
) -> tuple[tuple[ModalPoint, ...], list[str]]:
    """Points of the table, and notes."""
    path = folder / content["table"]
    settable = {
        f"{effect.identifier}.{entry}": p.unit
        for effect in model.effects
        for p in effect.parameters
        for entry in dict.fromkeys((p.name, *p.entries()))
    }
    columns, notes = read_modal_columns(
        path,
        numbers=NUMBERS | dict.fromkeys(settable, number()),
        texts=("mode", "group"),
        needed=("speed_m_s", "mode"),
        units=settable,
    )
    if not set(EIGENVALUE) & set(columns.numbers):
        raise InputError(f"{path}: the column {' or '.join(EIGENVALUE)} is missing; give decay, frequency, or both")
    if (count := len(columns.lines)) > MOST_ROWS:
        raise InputError(
            f"{path}: {count} rows are more than {MOST_ROWS}; average the runs at each speed and give their means with "
            "the standard deviations of the means, or a part of the rows"
        )
    settings = _read_settings(path, columns, model, tuple(settable), uncertainty)
    points = tuple(_point(path, row, columns, known) for row, known in enumerate(settings))
    refuse_repeats(path, columns.lines, [(p.speed, p.called, repr(p.eigenvalue)) for p in points], "run")
    points, sd_notes = _with_sd(points, [name in columns.numbers for name in SD])
    notes += sd_notes
    if SPEED_SD in columns.numbers:
        points = tuple(map(partial(_with_speed_sd, model), points, columns.numbers[SPEED_SD].tolist()))
    if unused := [name for name in UNUSED if name in columns.numbers]:
        notes.append(f"{', '.join(unused)}: read, but not used")
    if settings[0]:
        notes.append(f"{', '.join(dict(settings[0]))}: known in each row of the table, without uncertainty")
    return points, notes


def _read_settings(
    path: Path, columns: Columns, model: Model, settable: Sequence[str], uncertainty: Mapping[str, float]
) -> list[Settings]:
    """Settings of each row: a controller's gain, a damper's notch, a pressure's stiffness."""
    entries_by_column = {name: entries_of(name, model.parameters) for name in settable if name in columns.numbers}
    keys = [key for entries in entries_by_column.values() for key in entries]
    for key in keys:
        if keys.count(key) > 1:
            raise InputError(f"{path}: {key} is given by two columns, for both wheels and for one; keep one of them")
    for key, sd in uncertainty.items():
        if sd and set(keys).intersection(entries_of(key, model.parameters)):
            raise InputError(
                f"{path}: {key} is a column, known in each row, but [uncertainty] gives it a standard deviation of "
                f"{sd:g}; take one of the two out (for a gain, what all rows have in common, steer_motor.share, may be "
                "uncertain)"
            )
    family, settings = ModelFamily(model), []
    for row, line in enumerate(columns.lines):
        values = {
            key: float(columns.numbers[name][row]) for name, entries in entries_by_column.items() for key in entries
        }
        try:
            if values:
                family.with_values(values)
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from error
        settings.append(tuple(values.items()))
    return settings


def _point(path: Path, row: int, columns: Columns, settings: Settings) -> ModalPoint:
    place, texts = f"{path}, line {columns.lines[row]}", columns.texts
    cell = {name: float(column[row]) for name, column in columns.numbers.items()}
    mode, ratios = texts["mode"][row], {}
    if mode not in known_modes():
        raise InputError(f"{place}: {unknown('mode', mode, known_modes())}")
    for ratio in RATIOS:
        parts = [f"{ratio}_re" in cell, f"{ratio}_im" in cell]
        if not all(parts) and (any(parts) or f"{ratio}_sd" in cell):
            raise InputError(f"{path}: a ratio needs both columns {ratio}_re and {ratio}_im")
        if all(parts):
            ratios[ratio] = (complex(cell[f"{ratio}_re"], cell[f"{ratio}_im"]), cell.get(f"{ratio}_sd", 0.0))
    real, imag, *sd = (cell.get(name, np.nan) for name in (*EIGENVALUE, *SD))
    if np.isnan(real) and np.isnan(imag):
        raise InputError(f"{place}: neither real_1_s nor imag_rad_s is given; take the row out")
    group = texts["group"][row] if "group" in texts else ""
    eigenvalue_sd = float(np.nan_to_num(sd[0])), float(np.nan_to_num(sd[1]))
    return ModalPoint(cell["speed_m_s"], mode, complex(real, imag), eigenvalue_sd, ratios, group, settings)


def _with_speed_sd(model: Model, point: ModalPoint, speed_sd: float) -> ModalPoint:
    """The ``point`` whose speed is known to ``speed_sd`` (m/s): a critical speed is a row with real_1_s = 0."""
    if np.isnan(speed_sd):
        return point
    speeds = point.speed + np.array([-0.02, 0.02])  # m/s
    root = modes(model.linear_model(), speeds).branches.get(point.mode, np.full((2, 1), np.nan))[:, 0]
    slope = (root[1] - root[0]) / 0.04
    if not np.isfinite(slope):
        raise InputError(f"{SPEED_SD}: the base model has no {point.mode} near {point.speed:g} m/s, so leave it out")
    real, imag = (float(np.hypot(sd, by * speed_sd)) for sd, by in zip(point.sd, (slope.real, slope.imag), strict=True))
    return replace(point, sd=(real, imag if point.sd[1] else 0.0))


def _with_sd(points: tuple[ModalPoint, ...], has_sd: list[bool]) -> tuple[tuple[ModalPoint, ...], list[str]]:
    """Fill in missing standard deviations, and add the scatter of repeats beyond the stated ones."""
    notes: list[str] = []
    is_real = np.array([point.eigenvalue.imag == 0 and point.sd[1] == 0 for point in points])
    oscillating = tuple(
        point if not real else point.without_frequency() for point, real in zip(points, is_real, strict=True)
    )
    real_sd = _sd_of_part(points, 0, notes, given=has_sd[0])
    imag_sd = np.where(is_real, 0.0, _sd_of_part(oscillating, 1, notes, given=has_sd[1]))
    eigenvalue_sd = np.stack([real_sd, imag_sd], 1)
    if is_real.any():
        notes.append(f"{is_real.sum()} roots are real: they have no frequency that could be off, so it is not counted")
    if any(sd == 0 for point in points for _, sd in point.ratios.values()):
        notes.append(f"a shape ratio without sd: {DEFAULT_RATIO_SD:g} is assumed for both parts")
    filled = tuple(
        replace(
            point,
            sd=(float(sd[0]), float(sd[1])),
            ratios={name: (value, s or DEFAULT_RATIO_SD) for name, (value, s) in point.ratios.items()},
        )
        for point, sd in zip(points, eigenvalue_sd, strict=True)
    )
    return filled, notes


def _sd_of_part(points: tuple[ModalPoint, ...], part: int, notes: list[str], *, given: bool) -> Array:
    """Sd (n,) of the real or imaginary parts, of which ``notes`` are taken."""
    name, stated_sd = SD[part], np.array([point.sd[part] for point in points])
    parts = np.array([(point.eigenvalue.real, point.eigenvalue.imag) for point in points])
    default = DEFAULT_SD * np.linalg.norm(np.nan_to_num(parts), axis=1)
    if np.isnan(parts[:, part]).all():
        return default
    series: dict[str, list[int]] = {}  # rows of one mode at one setting
    for row in np.flatnonzero(~np.isnan(parts[:, part])).tolist():
        series.setdefault(points[row].called, []).append(row)
    repeated = [
        ([points[row].speed for row in rows], parts[rows, part].tolist(), stated_sd[rows].tolist())
        for rows in series.values()
    ]
    scatters = [(rows, repeats(*one)) for rows, one in zip(series.values(), repeated, strict=True)]
    freedom = sum(scatter.freedom for _, scatter in scatters)
    if freedom < FEWEST_REPEATS:
        if given:
            return np.where(stated_sd > 0, stated_sd, default)
        reason = (
            f"too few repeats ({freedom} of {FEWEST_REPEATS} degrees of freedom)" if freedom else "there are no repeats"
        )
        notes.append(f"{name} is missing and {reason}: {DEFAULT_SD:.0%} of |eigenvalue| is assumed")
        return default
    if given:  # refuted if repeats of all modes scatter more than chance (1 %) allows with the stated sd
        surprises = [surprise(*one, same=0.01) for one in repeated]
        total, free = sum(squares for squares, _ in surprises), max(sum(degrees for _, degrees in surprises), 1)
        if not chdtrc(free, total) < 0.01:
            return np.where(stated_sd > 0, stated_sd, default)
    sd = stated_sd.copy()
    for rows, scatter in scatters:
        if given or scatter.freedom:
            sd[rows] = scatter.sd
    lone = sd == 0  # a mode without repeats among others with
    sd[lone] = default[lone]
    if lone.all():  # a real mode has no frequency that could scatter
        notes.append(f"{name} is missing and repeats do not differ: {DEFAULT_SD:.0%} of |eigenvalue| is assumed")
    elif not given:
        notes.append(
            f"{name} is missing: the scatter of repeats ({freedom} degrees of freedom) is used, {_range(sd[~lone])}"
        )
        if lone.any():
            notes.append(f"{name}: {lone.sum()} rows of modes without repeats; {DEFAULT_SD:.0%} is assumed there")
    elif (wider := sd > 1.001 * stated_sd).any():
        notes.append(
            f"repeats scatter more than {name} says: {wider.sum()} of {len(points)} rows are widened, to "
            f"{_range(sd[wider])}"
        )
    for rows, scatter in scatters:
        for place in scatter.aside:
            point = points[rows[place]]
            notes.append(
                f"{name}: the {point.called} at {point.speed:g} m/s lies far outside the scatter of its repeats; it "
                f"alone is widened, to {sd[rows[place]]:.3g}"
            )
    return sd


def _range(values: Array) -> str:
    return " to ".join(dict.fromkeys((f"{values.min():.3g}", f"{values.max():.3g}")))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # two roots that meet, a mode without lean: not finite
def predict(family: Family, wanted: Wanted, theta: Array, *, slopes: bool = True) -> tuple[Complex, Complex]:
    """Eigenvalue and both ratios of each wanted mode, (m, 3), and their derivatives (m, 3, p), or (m, 3, 0)."""
    speeds = np.unique(wanted.speed)
    bicycle = MatrixSlopes(family, theta, speeds, slopes)
    system, names = bicycle.system, family.symbolic.outputs
    values, right, left = eigensystem(system.dynamics[0], mass=system.mass[0])
    chosen, at = root_of(wanted, speeds, values), np.searchsorted(speeds, wanted.speed)
    rows = [names.index(name) for name in ("lean_rate", *RATIOS.values())]
    root, x = values[at, chosen], right[at, :, chosen]
    c = system.output[0, at][:, rows]
    signals = np.einsum("mri,mi->mr", c, x)
    ratio = signals[:, 1:] / signals[:, :1]
    number = np.concatenate([root[:, None], ratio], axis=1)
    slope = np.zeros((*number.shape, len(bicycle.steps)), complex)
    if slope.size:
        force = bicycle.force(at, x[..., None], root)[..., 0].swapaxes(1, 2)
        turned = left[at] @ force  # u_i (dF - lambda dE) x / (u_i E x_i)
        gap = root[:, None] - values[at]
        point = np.arange(len(at))
        gap[point, chosen] = np.inf
        dx = right[at] @ (turned / gap[:, :, None])
        dsignals = c @ dx + bicycle.applied("output", at, x[..., None], rows)[..., 0].swapaxes(1, 2)
        slope[:, 0] = turned[point, chosen]
        slope[:, 1:] = (dsignals[:, 1:] - ratio[:, :, None] * dsignals[:, :1]) / signals[:, :1, None]
    errors = family.coordinates(theta)
    turn_ratios(number[:, 1:], slope[:, 1:], errors)
    for r, name in enumerate(RATIOS, 1):
        for signal, power in ((name, 1), (LEAN, -1)):
            sensor_errors = errors_of(errors, signal)
            apply_sensor(
                number[:, r], slope[:, r], number[:, 0].copy(), sensor_errors, s_slope=slope[:, 0], power=power
            )
    bias_identified(number[:, 0], slope[:, 0], errors)
    return number, slope


PAIRING = (
    "each measured mode is compared with the nearest root of the model, whatever it is called: a real root counts as "
    "three times as far from one that oscillates, and no two modes at one speed have the same root"
)
LEAN = "lean_of_ratios"  # the signal that all ratios are divided by


# ---- the kind ----


@dataclass(frozen=True, kw_only=True)
class Modal(BicycleKind, kind="modal"):
    """Eigenvalues and shape ratios of modes at several speeds."""

    keys: ClassVar[Any] = table(path_key("table", "FILE.csv"))
    columns: ClassVar[tuple[str, ...]] = ("mode", "group", *NUMBERS)
    points: tuple[ModalPoint, ...]  # one a row of the table; :meth:`ready` sorts them by mode, settings and speed

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Modal":
        uncertainty = dict(common["uncertainty"])
        points, notes = _read_points(read(cls.keys, content, section="modal"), folder, common["model"], uncertainty)
        uncertainty |= {key: 0.0 for key, _ in points[0].settings}
        notes += misnamed(points, common["model"])
        return cls(**{**common, "uncertainty": uncertainty}, points=points, notes=tuple(notes))

    def prepare(self, **how: Any) -> Self:
        points = tuple(sorted(self.points, key=lambda p: (p.mode, p.settings, p.speed)))
        return super(Modal, replace(self, points=points)).prepare(**how)

    def mistakes(self) -> tuple[Candidate, ...]:
        """Speed, identification, the clock; gain, delay and low-pass of the sensors of the ratios, a turned box."""
        errors = [*speed_errors(self.speeds.tolist()), *identification_errors()]
        ratios = dict.fromkeys(name for p in self.points for name in p.ratios)
        for ratio in ratios:
            sensor = f"{ratio.partition('_')[0]}_sensor"
            errors += [gain_error(sensor, ratio, beside="lean_sensor"), delay_error(sensor, ratio)]
            errors.append(lowpass_error(sensor, ratio))
        if len(ratios) > 1:
            errors += [gain_error("lean_sensor", LEAN), rotation_error()]
        if ratios:
            errors += [delay_error("lean_sensor", LEAN), lowpass_error("lean_sensor", LEAN)]
        return tuple(errors)

    # ---- physics ----

    @cached_property
    def _wanted(self) -> list[tuple[Settings, NDArray[np.intp], Wanted]]:
        """Measured modes, those of one setting together: settings, indices of the points, and the modes."""
        groups = []
        for settings in dict.fromkeys(p.settings for p in self.points):
            indices = [i for i, p in enumerate(self.points) if p.settings == settings]
            points = [self.points[i] for i in indices]
            roots = self._near[indices]
            wanted = Wanted(np.array([p.speed for p in points]), tuple(p.mode for p in points), roots)
            groups.append((settings, np.array(indices), wanted))
        return groups

    @cached_property
    def _near(self) -> Complex:
        """Measured eigenvalues (n,); a part that was not measured is that of the base model's mode of the name."""
        parts = np.array([[p.eigenvalue.real, p.eigenvalue.imag] for p in self.points])
        for k in np.flatnonzero(np.isnan(parts).any(1)).tolist():
            p, lacking = self.points[k], np.isnan(parts[k])
            mode = modes(self.model.linear_model(), [p.speed]).branches.get(p.mode, np.zeros((1, 1), complex))[0, 0]
            parts[k, lacking] = np.nan_to_num([mode.real, abs(mode.imag)])[lacking]
        return np.asarray(parts[:, 0] + 1j * parts[:, 1])

    def _modes(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> tuple[Complex, Complex]:
        """:func:`predict` of all points, in their order."""
        parts = [
            predict(self.family(candidates, settings), wanted, theta, slopes=slopes)
            for settings, _, wanted in self._wanted
        ]
        order = np.argsort(np.concatenate([here for _, here, _ in self._wanted]))
        number, slope = (np.concatenate(part)[order] for part in zip(*parts, strict=True))
        return number, slope

    @cached_property
    def data(self) -> tuple[Array, Array]:
        parts, sd = self._parts[..., 0], self._parts[..., 1]
        return parts[self._kept], sd[self._kept]

    @cached_property
    def _parts(self) -> Array:
        """Real and imaginary parts of eigenvalue and ratios, and their sd (m, 3, 2, 2); NaN if not measured."""
        parts = np.full((len(self.points), 1 + len(RATIOS), 2, 2), np.nan)
        for row, p in zip(parts, self.points, strict=True):
            frequency = p.eigenvalue.imag if p.sd[1] else np.nan
            row[0] = [(p.eigenvalue.real, p.sd[0]), (frequency, p.sd[1])]
            for place, name in enumerate(RATIOS, 1):
                if name in p.ratios:
                    value, sd = p.ratios[name]
                    row[place] = [(value.real, sd), (value.imag, sd)]
        return parts

    @cached_property
    def _kept(self) -> NDArray[np.bool_]:
        """True for the parts of eigenvalue and ratios (m, 3, 2) that are measured."""
        return np.isfinite(self._parts[..., 0])

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        number, _ = self._modes(candidates, theta, slopes=False)
        return np.stack([number.real, number.imag], -1)[self._kept]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> base.Prediction:
        number, slope = self._modes(candidates, theta)
        parts, slopes = flat_parts(number.ravel(), slope.reshape(number.size, -1))
        return parts[self._kept.ravel()], slopes[self._kept.ravel()]

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        labels, series, speed, group, repeat = [], [], [], [], []
        shown: dict[str, Series] = {}
        for k, p in enumerate(self.points):
            for place, name in enumerate(("", *RATIOS)):
                channel = f"{p.called} {name.replace('_', ' ')}".strip()
                for column, (part, unit) in enumerate((("real", "1/s"), ("imaginary", "rad/s"))):
                    if not self._kept[k, place, column]:
                        continue
                    quantity = f"{part} part" if name else f"{part} part, {unit}"
                    shown[f"{channel}, {part}"] = Series(channel, quantity)
                    labels.append(f"{channel}, {p.speed:g} m/s, {part}")
                    series.append(f"{channel}, {part}")
                    speed.append(p.speed)
                    group.append(p.group or f"{p.speed:.6g}")
                    repeat.append(f"{k:06d}")
        fold = folds(group, speed, repeat)
        return Rows(tuple(labels), np.array(speed), tuple(series), fold, displays=shown, axis=SPEED_AXIS)

    @property
    def speeds(self) -> Array:
        return np.array([p.speed for p in self.points])

    @property
    def varied(self) -> bool:
        return len(about_one_speed(self.speeds.tolist())) > 1

    # ---- how measured modes are paired with roots ----

    def assumptions(self) -> tuple[str, ...]:
        return (PAIRING,)

    def find_mispairings(self, judgement: Judgement) -> tuple[str, ...]:
        """Rows that the base model, or the final one, is compared with at a root of another name."""
        base_roots = self._modes((), self.nominal, slopes=False)[0][:, 0]
        chi2 = float(judgement.nominal @ judgement.nominal)
        final = self._rows_elsewhere(judgement.final)
        sentences = []
        for other in compared_with_another(self.points, base_roots, self.model):
            lies = " and ".join(other.lies_on) or "a root without a name"
            if other.more_chi2 is None:
                by_name = f"it has no {other.mode} there"
            else:
                by_name = (
                    f"with the roots called {other.mode} its chi^2 is {chi2 + other.more_chi2:.5g}, not {chi2:.5g}"
                )
            sentences.append(
                f"{other} are compared with another root of the base model, which is nearer ({lies}); {by_name}; "
                f"of the final model {final.get(other.mode, 'none is')}"
            )
        return tuple(sentences)

    def _rows_elsewhere(self, final: Fit) -> dict[str, str]:
        """By mode, how many rows a ``final`` model is compared with at another root, in words."""
        if any(c.effect is None for c in final.candidates):  # an error moves what is measured away from the root
            return dict.fromkeys(
                (p.mode for p in self.points), "it is not known, for an error of the measurement is in it"
            )
        try:
            model = with_values(self.corrected_model(final), self.model, final)
        except InputError:
            return dict.fromkeys((p.mode for p in self.points), "it is not known, for its values make no bicycle")
        roots = self._modes(final.candidates, final.theta, slopes=False)[0][:, 0]
        return {one.mode: f"{one.rows} are" for one in compared_with_another(self.points, roots, model)}

    # ---- what to measure next ----

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Missing ratios, the mode at other speeds (six runs each), a forced response."""
        sd = float(np.median([s for p in self.points for s in p.sd if s]))
        slowest, fastest, last = float(self.speeds.min()), float(self.speeds.max()), self.points[-1]
        have = {name for p in self.points for name in p.ratios}
        proposals: list[Proposal] = []
        for place, ratio in enumerate(RATIOS, 1):
            if ratio not in have:
                title = f"{ratio.replace('_', ' ')} ratio at the measured speeds"
                sds = np.full(2 * len(self.points), DEFAULT_RATIO_SD)
                proposals.append(Proposal(title, sds, partial(self._ratio, place)))
        for factor in (0.8, 1.25, 1.5, 2.0):
            speed = factor * (fastest if factor > 1 else slowest)
            title, sds_of_mean = f"{last.called} at {speed:.3g} m/s, 6 runs", np.full(2, sd / np.sqrt(6))
            proposals.append(Proposal(title, sds_of_mean, partial(self._mode_at, last, speed)))
        return (*proposals, *self.forced(fastest))

    def _ratio(self, place: int, candidates: Candidates, theta: Array) -> base.Prediction:
        """A ratio at all points, by its place after the eigenvalue."""
        number, slope = _undamped(*self._modes(candidates, theta))
        return flat_parts(number[:, place], slope[:, place])

    def _mode_at(self, like: ModalPoint, speed: float, candidates: Candidates, theta: Array) -> base.Prediction:
        """The mode of a point at another speed, followed from its nearest measured speed in small steps."""
        family = self.family(candidates, like.settings)
        measured = (p for p in self.points if (p.mode, p.settings) == (like.mode, like.settings))
        nearest = min(measured, key=lambda p: abs(p.speed - speed))
        root = self._near[self.points.index(nearest)]
        for v in np.linspace(nearest.speed, speed, 12):
            system = family(theta[None], np.array([v]))
            values = eigensystem(system.dynamics[0], mass=system.mass[0]).values[0]
            cost = np.where(values.imag >= 0, np.abs(values - root), np.inf)
            root = values[int(cost.argmin())]
        wanted = Wanted(np.array([speed]), (like.mode,), np.array([root]))
        number, slope = _undamped(*predict(family, wanted, theta))
        return flat_parts(number[:, 0], slope[:, 0])

    # ---- other readings ----

    def misreadings(self) -> Iterator[tuple[str, "Modal"]]:
        """Speeds, frequencies, signs of the real parts; signs and units of the ratios, and which is which."""

        def read(change: Callable[[ModalPoint], ModalPoint]) -> Modal:
            return replace(self, points=tuple(map(change, self.points)))

        for reading, factor in SPEEDS.items():
            yield reading, read(partial(ModalPoint.times, speed=factor))
        for reading, factor in FREQUENCIES.items():
            yield f"imag_rad_s {reading}", read(partial(ModalPoint.times, imag=factor))
        yield "real_1_s of the opposite sign", read(partial(ModalPoint.times, real=-1.0))
        names = list(dict.fromkeys(name for p in self.points for name in p.ratios))
        for name in names:
            for reading, factor in ANGLES.items():
                yield f"{name} {reading}", read(partial(ModalPoint.with_ratios, names={name: name}, factor=factor))
        if len(names) == 2:
            swap = dict(zip(names, names[::-1], strict=True))
            yield f"{' and '.join(names)} swapped", read(partial(ModalPoint.with_ratios, names=swap, factor=1.0))


def _undamped(number: Complex, slope: Complex) -> tuple[Complex, Complex]:
    """Nothing but NaN if one of the modes is too damped (ratio above 0.7) to be seen in a free decay."""
    if (np.abs(number[:, 0].real) > 0.7 * np.abs(number[:, 0])).any():
        number[:] = np.nan
    return number, slope
