"""Modal data: eigenvalues of named modes at speeds, optionally with mode-shape ratios, with standard deviations.

d(lambda) = u (dF - lambda dE) x with left and right eigenvectors, u E x = 1, and dx from the other modes.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from bicycle.identification.scatter import about_one_speed
from bicycle.model.eigen import eigensystem
from bicycle.model.model import Model
from bicycle.model.model_family import ModelFamily
from bicycle.parameters.parameter_covariance import entries_of
from bicycle.stability.named_modes import modes
from bicycle.stability.naming import known_modes
from studies.diagnosis.bicycle_kind import SPEED, SPEED_AXIS, SPEEDS_TO_PROPOSE, BicycleKind, refuse_repeats
from studies.diagnosis.corrected_model import with_values
from studies.diagnosis.doubts import ANGLES, FREQUENCIES, SPEEDS
from studies.diagnosis.family import Family, MatrixSlopes, Settings, flat_parts
from studies.diagnosis.mistakes import (
    apply_identification_errors,
    apply_sensor,
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
from studies.diagnosis.modal_sd import DEFAULT_RATIO_SD, SD, fill_sd
from studies.diagnosis.pairing import Wanted, find_other_roots, match_roots, note_misnamed_modes
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

SHOWN = {"real": ("growth rate, 1/s", 1.0), "imaginary": ("frequency, Hz", 1 / (2 * np.pi))}
"""Quantity and unit in which the parts of an eigenvalue are shown, and the factor from 1/s and rad/s."""
RATIOS = {"steer_over_lean": "steer_rate", "yaw_over_lean": "yaw_rate"}  # and their output over the lean rate
EIGENVALUE = ("real_1_s", "imag_rad_s")
UNUSED = ("speed_min_m_s", "speed_max_m_s")
SPEED_SD = "speed_sd_m_s"
FASTEST_ROOT = 200.0  # 1/s, about 30 Hz
NOISE = number(
    least=1e-5,
    most=LARGEST,
    outside=f"must be 1e-05 or more, {LARGEST:g} or less: no measurement is free of noise; leave an unknown one out",
)
RATIO = number(least=-1e5, most=1e5)  # a ratio of two rates


def _allow_empty(check: Check) -> Check:
    """Check of a cell that returns NaN (not measured) for an empty one, and what ``check`` returns for any other."""
    return lambda cell: np.nan if cell == "" else check(cell)


NUMBERS: dict[str, Check] = {
    "speed_m_s": SPEED,
    "real_1_s": _allow_empty(number(least=-FASTEST_ROOT, most=FASTEST_ROOT)),
    "imag_rad_s": _allow_empty(
        number(
            least=0,
            most=FASTEST_ROOT,
            outside=f"is outside 0 .. {FASTEST_ROOT:g}: give the root with imag_rad_s >= 0, in rad/s and not in Hz",
        )
    ),
    **dict.fromkeys((*SD, SPEED_SD), _allow_empty(NOISE)),
    **{f"{ratio}_{part}": NOISE if part == "sd" else RATIO for ratio in RATIOS for part in ("re", "im", "sd")},
    **dict.fromkeys(UNUSED, number()),
}
MOST_ROWS = 5000  # beyond, a diagnosis takes hours and tells no more than the means


@dataclass(frozen=True)
class ModalPoint:
    """A measured eigenvalue (imaginary part >= 0) of one mode at one speed, and its shape ratios."""

    speed: float  # m/s
    mode: str  # weave, capsize ... of :func:`known_modes`
    eigenvalue: complex  # 1/s and rad/s; a part that was not measured is NaN
    sd: tuple[float, float]  # 1/s and rad/s; 0 of the frequency of a real root, which has none to be measured
    # complex value (no unit) and sd of both its parts, by ratio: steer or yaw rate over lean rate
    ratios: Mapping[str, tuple[complex, float]] = field(default_factory=dict)
    group: str = ""  # rows of one group are held out together; empty: rows of one speed
    settings: Settings = ()  # (EFFECT.PARAMETER, value in SI), set in this row other than in the base model

    def scale(self, real: float = 1.0, imag: float = 1.0, speed: float = 1.0) -> "ModalPoint":
        """Copy with these factors on the parts of the eigenvalue, on the speed, and, without sign, on the parts' sd."""
        root = complex(real * self.eigenvalue.real, imag * self.eigenvalue.imag)
        sd = (abs(real) * self.sd[0], abs(imag) * self.sd[1])
        return replace(self, eigenvalue=root, sd=sd, speed=speed * self.speed)

    def drop_frequency(self) -> "ModalPoint":
        """Copy whose imaginary part is NaN: not measured."""
        return replace(self, eigenvalue=complex(self.eigenvalue.real, np.nan))

    def rename_ratios(self, names: Mapping[str, str], factor: float) -> "ModalPoint":
        """Copy with each ratio that is a key of ``names`` renamed to its value and times ``factor``; others stay."""
        renamed = {names[n]: (factor * x, abs(factor) * sd) for n, (x, sd) in self.ratios.items() if n in names}
        return replace(self, ratios={**self.ratios, **renamed})

    @property
    def label(self) -> str:
        """Name of the mode with its settings: ``weave (steer_assist.gain = 8)``."""
        settings = ", ".join(f"{key} = {value:g}" for key, value in self.settings)
        return f"{self.mode} ({settings})" if settings else self.mode


def _read_points(
    content: Any, folder: Path, model: Model, uncertainty: Mapping[str, float]
) -> tuple[tuple[ModalPoint, ...], list[str]]:
    """Points of the modal table that ``content`` names, one for each row, with sd filled in; and notes."""
    path = folder / content["table"]
    settable: dict[str, str] = {}  # unit of each parameter of the model's effects, which may have a column
    for effect in model.effects:
        for p in effect.parameters:
            settable |= {f"{effect.identifier}.{entry}": p.unit for entry in (p.name, *p.entries())}
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
    points = tuple(_read_point(path, row, columns, row_settings) for row, row_settings in enumerate(settings))
    refuse_repeats(path, columns.lines, [(p.speed, p.label, repr(p.eigenvalue)) for p in points], "run")
    points, sd_notes = fill_sd(points, [name in columns.numbers for name in SD])
    notes += sd_notes
    if SPEED_SD in columns.numbers:
        points = tuple(map(partial(_add_speed_sd, model), points, columns.numbers[SPEED_SD].tolist()))
    if unused := [name for name in UNUSED if name in columns.numbers]:
        notes.append(f"{', '.join(unused)}: read, but not used")
    if settings[0]:
        notes.append(f"{', '.join(dict(settings[0]))}: known in each row of the table, without uncertainty")
    return points, notes


def _read_settings(
    path: Path, columns: Columns, model: Model, settable: Sequence[str], uncertainty: Mapping[str, float]
) -> list[Settings]:
    """Settings (EFFECT.PARAMETER, SI) of each row, from columns of parameters such as a controller's gain.

    InputError if a value is out of range, or if such a parameter has an sd (SI) in ``uncertainty`` as well.
    """
    entries_by_column = {name: entries_of(name, model.parameters) for name in settable if name in columns.numbers}
    keys = list(chain.from_iterable(entries_by_column.values()))
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
    family = ModelFamily(model)
    settings: list[Settings] = []
    for row, line in enumerate(columns.lines):
        values: dict[str, float] = {}
        for name, entries in entries_by_column.items():
            values |= dict.fromkeys(entries, float(columns.numbers[name][row]))
        try:
            if values:
                family.with_values(values)
        except InputError as error:
            raise InputError(f"{path}, line {line}: {error}") from error
        settings.append(tuple(values.items()))
    return settings


def _read_point(path: Path, row: int, columns: Columns, settings: Settings) -> ModalPoint:
    """Point of one ``row`` of the table, sd 0 where none is stated; InputError for an unknown mode or half a ratio."""
    place = f"{path}, line {columns.lines[row]}"
    texts = columns.texts
    cell = {name: float(column[row]) for name, column in columns.numbers.items()}
    mode = texts["mode"][row]
    if mode not in known_modes():
        raise InputError(f"{place}: {unknown('mode', mode, known_modes())}")
    ratios = {}
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


def _add_speed_sd(model: Model, point: ModalPoint, speed_sd: float) -> ModalPoint:
    """Copy of ``point`` with the sd of its eigenvalue enlarged by that of its speed, ``speed_sd`` (m/s, NaN: none).

    A critical speed is a row with real_1_s = 0 and a speed sd.
    """
    if np.isnan(speed_sd):
        return point
    speeds = point.speed + np.array([-0.02, 0.02])  # m/s
    root = modes(model.linear_model(), speeds).branches.get(point.mode, np.full((2, 1), np.nan))[:, 0]
    slope = (root[1] - root[0]) / 0.04
    if not np.isfinite(slope):
        raise InputError(f"{SPEED_SD}: the base model has no {point.mode} near {point.speed:g} m/s, so leave it out")
    real_sd = float(np.hypot(point.sd[0], slope.real * speed_sd))
    imag_sd = float(np.hypot(point.sd[1], slope.imag * speed_sd)) if point.sd[1] else 0.0
    return replace(point, sd=(real_sd, imag_sd))


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # two roots that meet, a mode without lean: not finite
def predict(family: Family, wanted: Wanted, theta: Array, *, slopes: bool = True) -> tuple[Complex, Complex]:
    """Eigenvalue (1/s) and both shape ratios of each ``wanted`` mode, (m, 3), and their derivatives (m, 3, p).

    Computed at coordinates ``theta`` (p,); derivatives are (m, 3, 0) without ``slopes``. Errors of sensors, clock and
    identification that are among the coordinates act on both.
    """
    matrices = MatrixSlopes(family, theta, wanted.speeds, slopes)
    system = matrices.system
    names = family.symbolic.outputs
    try:
        values, right, left = eigensystem(system.dynamics[0], mass=matrices.mass)
    except np.linalg.LinAlgError:  # no equations: an effect of the user may divide by what a trial makes zero
        shape, missing = (len(wanted.at), 1 + len(RATIOS)), complex(np.nan, np.nan)
        return np.full(shape, missing), np.full((*shape, len(matrices.steps)), missing)
    chosen = match_roots(wanted, values)
    speed_index = wanted.at

    # Eigenvalue, and steer and yaw rate over lean rate of its right eigenvector.
    output_rows = [names.index(name) for name in ("lean_rate", *RATIOS.values())]
    root, x = values[speed_index, chosen], right[speed_index, :, chosen]
    c = system.output[0, speed_index][:, output_rows]
    signals = np.einsum("mri,mi->mr", c, x)
    ratio = signals[:, 1:] / signals[:, :1]
    computed = np.concatenate([root[:, None], ratio], axis=1)

    # Their derivatives: by d(lambda) = u (dF - lambda dE) x, and dx from the other modes by their distance.
    derivatives = np.zeros((*computed.shape, len(matrices.steps)), complex)
    if derivatives.size:
        force = matrices.force(speed_index, x[..., None], root)[..., 0].swapaxes(1, 2)
        projected = left[speed_index] @ force  # u_i (dF - lambda dE) x / (u_i E x_i)
        gap = root[:, None] - values[speed_index]
        point = np.arange(len(speed_index))
        gap[point, chosen] = np.inf
        to_signals = (
            c @ right[speed_index] / gap[:, None]
        )  # C dx: dx is the sum of x_i (u_i (dF - lambda dE) x) / gap_i
        dsignals = to_signals @ projected
        dsignals += matrices.apply("output", speed_index, x[..., None], output_rows)[..., 0].swapaxes(1, 2)
        derivatives[:, 0] = projected[point, chosen]
        derivatives[:, 1:] = (dsignals[:, 1:] - ratio[:, :, None] * dsignals[:, :1]) / signals[:, :1, None]

    errors = family.measurement_errors(theta)
    if errors:
        _apply_errors(computed, derivatives, errors)
    return computed, derivatives


def _apply_errors(computed: Complex, derivatives: Complex, errors: Mapping[str, tuple[int, float]]) -> None:
    """Apply ``errors`` of mounting, sensors and identification in place, in the order in which they arise.

    To eigenvalue and ratios ``computed`` (m, 3) and to their ``derivatives`` (m, 3, p).
    """
    turn_ratios(computed[:, 1:], derivatives[:, 1:], errors)
    for r, name in enumerate(RATIOS, 1):
        for signal, power in ((name, 1), (LEAN, -1)):
            sensor_errors = errors_of(errors, signal)
            apply_sensor(
                computed[:, r],
                derivatives[:, r],
                computed[:, 0].copy(),
                sensor_errors,
                s_slope=derivatives[:, 0],
                power=power,
            )
    apply_identification_errors(computed[:, 0], derivatives[:, 0], errors)


PAIRING = (
    "each measured mode is compared with the nearest root of the model, whatever it is called: the distance of a real "
    "root from an oscillatory one is tripled, and no two modes at one speed have the same root"
)
LEAN = "lean_of_ratios"  # the signal that all ratios are divided by


# ---- the kind ----


@dataclass(frozen=True, kw_only=True)
class Modal(BicycleKind, kind="modal"):
    """Eigenvalues and shape ratios of modes at several speeds."""

    keys: ClassVar[Any] = table(path_key("table", "FILE.csv"))
    columns: ClassVar[tuple[str, ...]] = ("mode", "group", *NUMBERS)
    points: tuple[ModalPoint, ...]  # one a row of the table; :meth:`prepare` sorts them by mode, settings and speed

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "Modal":
        """Points of the table that ``content`` names; parameters that are columns there get no uncertainty."""
        uncertainty = dict(common["uncertainty"])
        points, notes = _read_points(read(cls.keys, content, section="modal"), folder, common["model"], uncertainty)
        uncertainty |= {key: 0.0 for key, _ in points[0].settings}
        return cls(**{**common, "uncertainty": uncertainty}, points=points, notes=tuple(notes))

    def prepare(self, **how: Any) -> Self:
        """Copy with nuisances, candidates, points sorted by mode, settings and speed, and notes on misnamed modes."""
        points = tuple(sorted(self.points, key=lambda p: (p.mode, p.settings, p.speed)))
        prepared = super(Modal, replace(self, points=points)).prepare(**how)
        return replace(prepared, notes=(*prepared.notes, *note_misnamed_modes(points, self.model)))

    def mistakes(self) -> tuple[Candidate, ...]:
        """Candidates for errors of speed, identification, clock, sensors of the ratios and a turned box of gyros."""
        errors = [*speed_errors(self.speeds.tolist()), *identification_errors()]
        for ratio in self._ratio_names:
            sensor = f"{ratio.partition('_')[0]}_sensor"
            errors += [gain_error(sensor, ratio, reference="lean_sensor"), delay_error(sensor, ratio)]
            errors.append(lowpass_error(sensor, ratio))
        if len(self._ratio_names) > 1:
            errors += [gain_error("lean_sensor", LEAN), rotation_error()]
        if self._ratio_names:
            errors += [delay_error("lean_sensor", LEAN), lowpass_error("lean_sensor", LEAN)]
        return tuple(errors)

    # ---- physics ----

    @property
    def _ratio_names(self) -> list[str]:
        """Names of the shape ratios that any point has, each once."""
        return list(dict.fromkeys(chain.from_iterable(p.ratios for p in self.points)))

    @cached_property
    def _settings_groups(self) -> list[tuple[Settings, NDArray[np.intp], Wanted]]:
        """Groups of points with the same settings: the settings, indices of the points, and modes to predict."""
        groups = []
        for settings in dict.fromkeys(p.settings for p in self.points):
            indices = [i for i, p in enumerate(self.points) if p.settings == settings]
            points = [self.points[i] for i in indices]
            roots = self._measured_roots[indices]
            wanted = Wanted(np.array([p.speed for p in points]), tuple(p.mode for p in points), roots)
            groups.append((settings, np.array(indices), wanted))
        return groups

    @cached_property
    def _measured_roots(self) -> Complex:
        """Measured eigenvalues (m,), 1/s; a part not measured is the base model's for this mode, 0 if it has none."""
        parts = np.array([[p.eigenvalue.real, p.eigenvalue.imag] for p in self.points])
        for k in np.flatnonzero(np.isnan(parts).any(1)).tolist():
            p = self.points[k]
            missing = np.isnan(parts[k])
            mode = modes(self.model.linear_model(), [p.speed]).branches.get(p.mode, np.zeros((1, 1), complex))[0, 0]
            parts[k, missing] = np.nan_to_num([mode.real, abs(mode.imag)])[missing]
        return np.asarray(parts[:, 0] + 1j * parts[:, 1])

    def _predict_points(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> tuple[Complex, Complex]:
        """Computed eigenvalue (1/s) and both ratios (m, 3) of all m points, and derivatives (m, 3, p)."""
        parts = [
            predict(self.family(candidates, settings), wanted, theta, slopes=slopes)
            for settings, _, wanted in self._settings_groups
        ]
        order = np.argsort(np.concatenate([indices for _, indices, _ in self._settings_groups]))
        computed, derivatives = (np.concatenate(part)[order] for part in zip(*parts, strict=True))
        return computed, derivatives

    @cached_property
    def data(self) -> tuple[Array, Array]:
        """Measured real and imaginary parts (n,), 1/s and rad/s (ratios without unit), and their sd (n,)."""
        return self._measured_parts[..., 0][self._is_measured], self._measured_parts[..., 1][self._is_measured]

    @cached_property
    def _measured_parts(self) -> Array:
        """Measured numbers (m, 3, 2, 2): point; eigenvalue or ratio; real or imaginary part; value or sd. NaN: none."""
        parts = np.full((len(self.points), 1 + len(RATIOS), 2, 2), np.nan)
        for row, p in zip(parts, self.points, strict=True):
            frequency = p.eigenvalue.imag if p.sd[1] else np.nan
            row[0] = [(p.eigenvalue.real, p.sd[0]), (frequency, p.sd[1])]
            for column, name in enumerate(RATIOS, 1):
                if name in p.ratios:
                    value, sd = p.ratios[name]
                    row[column] = [(value.real, sd), (value.imag, sd)]
        return parts

    @cached_property
    def _is_measured(self) -> NDArray[np.bool_]:
        """True (m, 3, 2) for each real or imaginary part of eigenvalue and ratios that was measured."""
        return np.isfinite(self._measured_parts[..., 0])

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        """Computed parts (n,) of the model with ``candidates`` at ``theta`` (p,), as :attr:`data` has them."""
        computed, _ = self._predict_points(candidates, theta, slopes=False)
        return np.stack([computed.real, computed.imag], -1)[self._is_measured]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> base.Prediction:
        """Computed parts (n,) and their exact derivatives (n, p) at ``theta`` (p,)."""
        computed, derivatives = self._predict_points(candidates, theta)
        parts, slopes = flat_parts(computed.ravel(), derivatives.reshape(computed.size, -1))
        return parts[self._is_measured.ravel()], slopes[self._is_measured.ravel()]

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Place, series, speed (m/s) and fold of each of the n numbers; a fold holds out speeds or groups."""
        labels, series, speed, group, repeat = [], [], [], [], []
        displays: dict[str, Series] = {}
        for k, p in enumerate(self.points):
            for place, name in enumerate(("", *RATIOS)):
                channel = f"{p.label} {name.replace('_', ' ')}".strip()
                for column, (part, unit) in enumerate((("real", "1/s"), ("imaginary", "rad/s"))):
                    if not self._is_measured[k, place, column]:
                        continue
                    if name:
                        displays[f"{channel}, {part}"] = Series(channel, f"{part} part")
                    else:
                        shown, factor = SHOWN[part]
                        quantity = f"{part} part, {unit}"
                        displays[f"{channel}, {part}"] = Series(channel, quantity, shown=shown, factor=factor)
                    labels.append(f"{channel}, {p.speed:g} m/s, {part}")
                    series.append(f"{channel}, {part}")
                    speed.append(p.speed)
                    group.append(p.group or f"{p.speed:.6g}")
                    repeat.append(f"{k:06d}")
        fold = folds(group, speed, repeat)
        return Rows(tuple(labels), np.array(speed), tuple(series), fold, displays=displays, axis=SPEED_AXIS)

    @property
    def speeds(self) -> Array:
        """Measured speeds (m,), m/s, one of each point."""
        return np.array([p.speed for p in self.points])

    @property
    def varied(self) -> bool:
        """True if the points are of two speeds or more."""
        return len(about_one_speed(self.speeds.tolist())) > 1

    # ---- how measured modes are paired with roots ----

    def assumptions(self) -> tuple[str, ...]:
        """Sentence on how measured modes are paired with roots."""
        return (PAIRING,)

    def find_mispairings(self, judgement: Judgement) -> tuple[str, ...]:
        """Sentences, one for each mode with rows compared with a root that the base model calls otherwise."""
        base_roots = self._predict_points((), self.nominal, slopes=False)[0][:, 0]
        chi2 = float(judgement.nominal @ judgement.nominal)
        final_counts = self._count_other_roots(judgement.final)
        sentences = []
        for other in find_other_roots(self.points, base_roots, self.model):
            root_names = " and ".join(other.lies_on) or "a root without a name"
            if other.more_chi2 is None:
                by_name = f"it has no {other.mode} there"
            else:
                by_name = (
                    f"with the roots called {other.mode} its chi^2 is {chi2 + other.more_chi2:.5g}, not {chi2:.5g}"
                )
            sentences.append(
                f"{other} are compared with another root of the base model, which is nearer ({root_names}); {by_name}; "
                f"of the final model {final_counts.get(other.mode, 'none is')}"
            )
        return tuple(sentences)

    def _count_other_roots(self, final: Fit) -> dict[str, str]:
        """End of a sentence, by mode: how many of its rows the ``final`` model compares with a root of another name."""
        if any(c.effect is None for c in final.candidates):  # an error moves what is measured away from the root
            return dict.fromkeys((p.mode for p in self.points), "it is not known, as it contains a measurement error")
        try:
            model = with_values(self.corrected_model(final), self.model, final)
        except InputError:
            return dict.fromkeys(
                (p.mode for p in self.points), "it is not known, as its values are physically impossible"
            )
        roots = self._predict_points(final.candidates, final.theta, slopes=False)[0][:, 0]
        return {other.mode: f"{other.rows} are" for other in find_other_roots(self.points, roots, model)}

    # ---- what to measure next ----

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Further measurements: missing ratios, the last point's mode at other speeds (6 runs), a forced response."""
        stated_sds = chain.from_iterable(p.sd for p in self.points)
        sd = float(np.median([s for s in stated_sds if s]))
        slowest, fastest = float(self.speeds.min()), float(self.speeds.max())
        last = self.points[-1]
        proposals: list[Proposal] = []
        for column, ratio in enumerate(RATIOS, 1):
            if ratio not in self._ratio_names:
                title = f"{ratio.replace('_', ' ')} ratio at the measured speeds"
                sds = np.full(2 * len(self.points), DEFAULT_RATIO_SD)
                proposals.append(Proposal(title, sds, partial(self._predict_ratio, column)))
        lowest, highest = SPEEDS_TO_PROPOSE
        for speed in (lowest * slowest, (lowest + 1) / 2 * slowest, (1 + highest) / 2 * fastest, highest * fastest):
            title = f"{last.label} at {speed:.3g} m/s, 6 runs"
            sds_of_mean = np.full(2, sd / np.sqrt(6))
            proposals.append(Proposal(title, sds_of_mean, partial(self._predict_mode, last, speed)))
        return (*proposals, *self.propose_forced_response(fastest))

    def _predict_ratio(self, column: int, candidates: Candidates, theta: Array) -> base.Prediction:
        """Parts (2 m,), real and imaginary, of ratio 1 or 2 (``column``) at all points, and derivatives (2 m, p).

        All are NaN if a mode is damped too much to be seen.
        """
        computed, derivatives = _discard_if_damped(*self._predict_points(candidates, theta))
        return flat_parts(computed[:, column], derivatives[:, column])

    def _predict_mode(self, point: ModalPoint, speed: float, candidates: Candidates, theta: Array) -> base.Prediction:
        """Real and imaginary part (2,), 1/s and rad/s, of a point's mode at ``speed`` (m/s), and derivatives (2, p).

        The root is followed in small steps from the nearest speed at which it was measured. NaN if damped too much.
        """
        family = self.family(candidates, point.settings)
        points_of_mode = (p for p in self.points if (p.mode, p.settings) == (point.mode, point.settings))
        nearest = min(points_of_mode, key=lambda p: abs(p.speed - speed))
        root = self._measured_roots[self.points.index(nearest)]
        for v in np.linspace(nearest.speed, speed, 12):
            system = family(theta[None], np.array([v]))
            values = eigensystem(system.dynamics[0], mass=system.mass[0]).values[0]
            cost = np.where(values.imag >= 0, np.abs(values - root), np.inf)
            root = values[int(cost.argmin())]
        wanted = Wanted(np.array([speed]), (point.mode,), np.array([root]))
        computed, derivatives = _discard_if_damped(*predict(family, wanted, theta))
        return flat_parts(computed[:, 0], derivatives[:, 0])

    # ---- other readings ----

    def misreadings(self) -> Iterator[tuple[str, "Modal"]]:
        """Pairs of another reading in words and the points read so: units and signs, and two ratios swapped."""

        def reinterpret(change: Callable[[ModalPoint], ModalPoint]) -> Modal:
            """Copy with each point changed by ``change``."""
            return replace(self, points=tuple(map(change, self.points)))

        for reading, factor in SPEEDS.items():
            yield reading, reinterpret(partial(ModalPoint.scale, speed=factor))
        for reading, factor in FREQUENCIES.items():
            yield f"imag_rad_s {reading}", reinterpret(partial(ModalPoint.scale, imag=factor))
        yield "real_1_s of the opposite sign", reinterpret(partial(ModalPoint.scale, real=-1.0))
        names = self._ratio_names
        for name in names:
            for reading, factor in ANGLES.items():
                yield (
                    f"{name} {reading}",
                    reinterpret(partial(ModalPoint.rename_ratios, names={name: name}, factor=factor)),
                )
        if len(names) == 2:
            swap = dict(zip(names, names[::-1], strict=True))
            yield (
                f"{' and '.join(names)} swapped",
                reinterpret(partial(ModalPoint.rename_ratios, names=swap, factor=1.0)),
            )


def _discard_if_damped(computed: Complex, derivatives: Complex) -> tuple[Complex, Complex]:
    """Set all of ``computed`` (m, 3) to NaN if any damping ratio is above 0.7; return it and ``derivatives`` (m, 3, p).

    Such a mode is not seen in a free decay.
    """
    if (np.abs(computed[:, 0].real) > 0.7 * np.abs(computed[:, 0])).any():
        computed[:] = np.nan
    return computed, derivatives
