"""Frequency responses: gain and phase from an input to an output at frequencies and speeds, with their noise.

The response H = C (i omega E - F)^-1 B is that of the bicycle alone, also at speeds at which it is unstable and
something held it (Ljung 1999, System Identification, ch. 13: the direct approach).
"""

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import combinations
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.identification.recording import INPUTS as TORQUES
from bicycle.identification.recording import MOTOR_IN_TORQUE, STEER_TORQUE
from bicycle.identification.scatter import about_one_speed
from bicycle.motion.responses import column
from studies.diagnosis.bicycle_kind import (
    FASTEST,
    FORCED_HZ,
    FORCED_OUTPUTS,
    FORCED_SD,
    SPEED,
    BicycleKind,
    refuse_repeats,
    without_motors,
)
from studies.diagnosis.doubts import ACCELERATIONS, ANGLES
from studies.diagnosis.doubts import SPEEDS as SPEED_READINGS
from studies.diagnosis.doubts import TORQUES as TORQUE_READINGS
from studies.diagnosis.family import flat_parts
from studies.diagnosis.figures import BODE
from studies.diagnosis.harmonic_response import ACCELERATION, Accelerometer, Wanted, responses
from studies.diagnosis.mistakes import apply_sensor, delay_error, errors_of, gain_error, lowpass_error, speed_errors
from studies.inference import kind as base
from studies.inference.evidence import MOST_FOLDS, folds
from studies.inference.kind import Candidates, Figure, Proposal, Rows, Series
from studies.inference.parameter import Candidate
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, unknown
from tyre.ground.schema import Check, flag, maybe, needed, number, path_key, read, table
from tyre.ground.text_table import Columns, read_cells, read_columns
from tyre.ground.units import find_unit
from tyre.measured.plausible import LARGEST

# ---- the table ----

OUTPUTS = {
    "lean": ("lean", "angle"), "roll_rate": ("lean_rate", "angular rate"), "lean_rate": ("lean_rate", "angular rate"),
    "steer": ("steer", "angle"), "steer_rate": ("steer_rate", "angular rate"), "yaw_rate": ("yaw_rate", "angular rate"),
    "lateral_acceleration": ("lateral_acceleration", "acceleration"),
}  # fmt: skip
"""Name in a table -> output of the model, and the quantity."""

INPUTS = {"steer_torque": "moment", "lean_torque": "moment", "lateral_push": "force"}
SI = {"angle": "rad", "angular rate": "rad/s", "acceleration": "m/s^2", "moment": "N m", "force": "N"}
FORMS = {("re", "im"): "re and im"} | {(size, "phase"): f"{size} and phase_deg" for size in ("gain", "gain_db")}
PHASES = {"phase_deg": math.pi / 180, "phase_rad": 1.0}
HIGHEST = 100.0  # Hz
FREQUENCIES = {"frequency_Hz": 1.0, "frequency_hz": 1.0, "frequency_rad_s": 1 / (2 * math.pi)}
SPEEDS = {"speed_m_s": 1.0, "speed_km_h": 1 / 3.6}
NOISE = ("sd", "sd_db", "coherence", "averages")
HERTZ = f"is outside 0 .. {HIGHEST:g} Hz; is it in "
NUMBERS: dict[str, Check] = {
    **dict.fromkeys(("re", "im", "gain_db", *PHASES, "coherence", "averages"), number()),
    "gain": number(least=0, outside="must not be negative; put the sign into the phase"),
    **dict.fromkeys(("frequency_Hz", "frequency_hz"), number(above=0, most=HIGHEST, outside=HERTZ + "rad/s?")),
    "frequency_rad_s": number(above=0, most=2 * math.pi * HIGHEST, outside=HERTZ + "Hz?"),
    "speed_m_s": SPEED,
    "speed_km_h": number(above=0, most=3.6 * FASTEST),
    **dict.fromkeys(
        ("sd", "sd_db"),
        number(above=0, most=LARGEST, outside=f"must be above 0, {LARGEST:g} or less: no measurement is free of noise"),
    ),
}
TEXTS = ("input", "output", "input_unit", "output_unit", "group")
NONE: Mapping[str, str] = MappingProxyType({})
WIDE = "a table of velotyre simulate --frequency-response"


@dataclass(frozen=True)
class ResponsePoint:
    """Gain ``value`` (SI) from ``input`` to the model's ``output`` at a frequency, with the sd of both its parts."""

    input: str
    output: str
    frequency: float  # Hz
    speed: float  # m/s
    value: complex
    sd: float  # in the unit of ``value``, of the real as of the imaginary part
    group: str = ""  # points of one group are held out together; of one speed if ""

    @property
    def channel(self) -> str:
        """Output and input in words."""
        return f"{describe_signal(self.input)} to {describe_signal(self.output)}"

    def read_as(
        self,
        *,
        of: str = "",
        gain: float = 1.0,
        speed: float = 1.0,
        frequency: float = 1.0,
        names: Mapping[str, str] = NONE,
    ) -> "ResponsePoint":
        """The point with factors, that on the gain only if it is ``of`` this signal, and outputs of other ``names``."""
        factor = gain if of in (self.input, self.output) else 1.0
        return replace(
            self,
            value=factor * self.value,
            sd=abs(factor) * self.sd,
            speed=speed * self.speed,
            frequency=frequency * self.frequency,
            output=names.get(self.output, self.output),
        )

    @property
    def unit(self) -> str:
        """SI unit of the gain."""
        quantity = next(quantity for output, quantity in OUTPUTS.values() if output == self.output)
        return f"{SI[quantity]} per {SI[INPUTS[self.input]]}"


def describe_signal(name: str) -> str:
    """An input or output called ``name`` in words."""
    return {"lean_rate": "roll rate"}.get(name, name.replace("_", " "))


Points = tuple[list[ResponsePoint], list[str]]
"""Points and notes on what was assumed."""


def _read_wide(path: Path, settings: Mapping[str, Any]) -> Points:
    """Points of a simulation: a row per frequency, two columns per output."""
    for key in ("speed_m_s", "relative_sd"):
        if key not in settings:
            raise InputError(f"[frequency_response]: {path} is {WIDE}, which does not hold it: write {key} = ...")
    share, speed = settings["relative_sd"], settings["speed_m_s"]
    header = path.read_text(encoding="utf-8-sig").partition("\n")[0].split(",")
    columns = read_columns(path, numbers=[name.strip() for name in header], needed=("frequency_Hz",)).numbers
    sources = {column(name, SI[quantity]): name for name, quantity in INPUTS.items()}
    output_columns = {column(name, SI[quantity]): name for name, quantity in OUTPUTS.values()}
    points: list[ResponsePoint] = []
    unread: list[str] = []
    for name, size in columns.items():
        match = re.fullmatch(r"(\w+?)_per_(\w+)", name)
        if match is None:
            continue
        if match[2] not in sources:
            raise InputError(f"{path}: {name}: a response to {match[2]} is not compared; known: {', '.join(sources)}")
        output = output_columns.get(match[1])
        if output is None or f"{output}_phase_rad" not in columns:
            unread.append(name)
            continue
        gains = size * np.exp(1j * columns[f"{output}_phase_rad"])
        points += [
            ResponsePoint(sources[match[2]], output, float(f), speed, complex(h), share * abs(complex(h)))
            for f, h in zip(columns["frequency_Hz"], gains, strict=True)
        ]
    if not points:
        raise InputError(f"{path}: no output that is compared; known: {', '.join(output_columns)}")
    notes = [f"{path.name} is {WIDE}: {share:.2g} of each gain is taken as its standard deviation"]
    return points, notes + ([f"{path.name}: not compared: {', '.join(unread)}"] if unread else [])


def _read_columns(path: Path, settings: Mapping[str, Any]) -> Points:
    """Points of a table with one response a row, and notes on what was assumed."""
    columns = read_columns(path, numbers=NUMBERS, texts=TEXTS, needed=("input", "output"))
    cells = columns.numbers
    hertz = _one_of(path, cells, FREQUENCIES)
    if "speed_m_s" not in settings:
        speed = _one_of(path, cells, SPEEDS)
    elif any(name in cells for name in SPEEDS):
        raise InputError(f"[frequency_response]: speed_m_s is a column of {path}; take the key out")
    else:
        speed = np.full(len(columns.lines), settings["speed_m_s"])
    gain = _gains(path, cells)
    factor = np.array([_factor(path, columns, row) for row in range(len(columns.lines))])
    sd, notes = _noise(path, columns, gain, settings.get("relative_sd"))
    for row in np.flatnonzero(~(sd > 1e-6 * np.abs(gain))):
        raise InputError(
            f"{path}, line {columns.lines[row]}: the sd is {sd[row]:g}; it must be above a millionth of the gain, "
            f"{np.abs(gain[row]):g}: no measurement is free of noise"
        )
    outputs = [OUTPUTS[name][0] for name in columns.texts["output"]]
    group = columns.texts.get("group", [""] * len(outputs))
    numbers = (hertz.tolist(), speed.tolist(), (gain * factor).tolist(), (sd * factor).tolist())
    points = list(map(ResponsePoint, columns.texts["input"], outputs, *numbers, group))
    keys = [(p.input, p.output, p.frequency, p.speed, p.value) for p in points]
    refuse_repeats(path, columns.lines, keys, "response")
    return points, notes


def _one_of(path: Path, cells: Mapping[str, Array], forms: Mapping[str, float]) -> Array:
    """The column that is there, of several in which one thing may be given, in the unit of the first."""
    present = [name for name in forms if name in cells]
    if len(present) > 1:
        raise InputError(f"{path}: {' and '.join(present)} say the same; keep one")
    if not present:
        raise InputError(f"{path}: the column {next(iter(forms))} is missing")
    return cells[present[0]] * forms[present[0]]


def _gains(path: Path, cells: Mapping[str, Array]) -> Complex:
    """Complex gains (n,) in the units of the table, from whichever form of gain it has."""
    forms = [form for form in FORMS if form[0] in cells or (form[1] in cells and form[1] != "phase")]
    if len(forms) > 1:
        raise InputError(f"{path}: {' and '.join(FORMS[form] for form in forms)} say the same; keep one")
    if not forms:
        raise InputError(f"{path}: no gain; give {', or '.join(FORMS.values())}")
    first, second = forms[0]
    phases = [name for name in PHASES if name in cells]
    if second == "phase":
        if first not in cells or len(phases) != 1:
            raise InputError(f"{path}: {first} needs one column phase_deg or phase_rad")
        size = cells[first] if first == "gain" else 10 ** (cells[first] / 20)
        return np.asarray(size * np.exp(1j * cells[phases[0]] * PHASES[phases[0]]))
    if first not in cells or second not in cells or phases:
        raise InputError(f"{path}: give both re and im, and no phase beside them")
    return np.asarray(cells[first] + 1j * cells[second])


def _factor(path: Path, columns: Columns, row: int) -> float:
    """Factor of the gain of a row to SI."""
    place = f"{path}, line {columns.lines[row]}"
    source, output = columns.texts["input"][row], columns.texts["output"][row]
    if source not in INPUTS:
        raise InputError(f"{place}: {unknown('input', source, INPUTS)}")
    if output not in OUTPUTS:
        raise InputError(f"{place}: {unknown('output', output, OUTPUTS)}")
    factors = []
    for name, quantity in (("output_unit", OUTPUTS[output][1]), ("input_unit", INPUTS[source])):
        text = columns.texts[name][row] if name in columns.texts else ""
        factors.append(find_unit(text, quantity, where=f"{place}: {name}").factor if text else 1.0)
    return factors[0] / factors[1]


def _noise(path: Path, columns: Columns, gain: Complex, relative: float | None) -> tuple[Array, list[str]]:
    """One sd (n,) of both parts of a gain, in its unit, and notes: stated, or from coherence and averages."""
    present = [name for name in NOISE if name in columns.numbers]
    sd_columns = [name for name in ("sd", "sd_db") if name in present]
    if relative is not None:
        if sd_columns or "coherence" in present:
            raise InputError(f"[frequency_response]: relative_sd, but {path} has {', '.join(present)}; keep one")
        return relative * np.abs(gain), [f"{relative:.2g} of each gain is taken as its sd"]
    if len(sd_columns) > 1 or ("sd_db" in sd_columns and "gain_db" not in columns.numbers):
        raise InputError(f"{path}: sd_db belongs to gain_db, and sd to the gain in its own unit; give one of them")
    if sd_columns:
        unused = [name for name in present if name not in sd_columns]
        notes = [f"{', '.join(unused)}: read, but not used, for {sd_columns[0]} is there"] if unused else []
        sd = columns.numbers[sd_columns[0]]
        return (np.abs(gain) * math.log(10) / 20 * sd if sd_columns == ["sd_db"] else sd), notes
    if not {"coherence", "averages"} <= set(present):
        raise InputError(
            f"{path}: no noise; give the column sd (of real and imaginary part), or coherence and averages"
        )
    coherence, averages = columns.numbers["coherence"], columns.numbers["averages"]
    for row in np.flatnonzero(~((coherence > 0) & (coherence < 1) & (averages >= 4))):
        raise InputError(
            f"{path}, line {columns.lines[row]}: coherence = {coherence[row]:g}, averages = {averages[row]:g}; the "
            "coherence must lie between 0 and 1 (gamma^2), of 4 averages or more; else give sd"
        )
    # sd = |H| sqrt((1 - gamma^2) / (2 gamma^2 n)) (Bendat & Piersol, Random Data, ch. 9); its square is widened by
    # n / (n - 2), the variance of Student's t, because the noise itself was estimated from n - 1 differences
    return np.asarray(np.abs(gain) * np.sqrt((1 - coherence) / coherence / (2 * (averages - 2)))), []


# ---- the kind ----

HELD = (
    "unstable at {} m/s: something held the bicycle there. Output over input is the bicycle's own response all the "
    "same, if the recorded input is all that acted; noise that the rider or controller answers biases it, unless a "
    "reference signal was used (see the documentation)"
)


@dataclass(frozen=True, kw_only=True)
class FrequencyResponses(BicycleKind, kind="frequency_response"):
    """Frequency responses at several speeds, with the place of the accelerometer if there is one."""

    keys: ClassVar[Any] = table(
        {
            **path_key("table", "FILE.csv"),
            maybe("speed_m_s"): SPEED,
            maybe("relative_sd"): number(above=0, most=1, says="must be a share above 0, at most 1, of each gain"),
            maybe("accelerometer"): table(
                {
                    needed("x_m", "no x_m; give the place of the sensor ahead of the rear contact"): number(),
                    needed(
                        "z_m", "no z_m; give the place of the sensor, z down, so above the ground it is negative"
                    ): number(most=0, says="must be a finite number in m, z down: above the ground it is negative"),
                }
            ),
            maybe(MOTOR_IN_TORQUE): flag,
        }
    )
    columns: ClassVar[tuple[str, ...]] = (*TEXTS, *NUMBERS)
    points: tuple[ResponsePoint, ...]  # one a measured response
    accelerometer: Accelerometer | None = None  # its place, m; None if none was read

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "FrequencyResponses":
        settings = read(cls.keys, content, section="frequency_response")
        path = folder / settings["table"]
        header = read_cells(
            path, kind="table; a path in a file is relative to that file", example="input, output"
        ).header
        wide = "frequency_Hz" in header and any("_per_" in name for name in header)
        points, notes = (_read_wide if wide else _read_columns)(path, settings)
        if len(points) < 3:
            raise InputError(f"{path}: {len(points)} row(s) cannot be diagnosed; give at least 3, at two speeds")
        place = settings.get("accelerometer")
        if any(p.output == ACCELERATION for p in points) != (place is not None):
            needs = "needs the place of its sensor; write [frequency_response.accelerometer] with x_m and z_m"
            idle = "is not a column; take [frequency_response.accelerometer] out"
            raise InputError(f"{path}: lateral_acceleration {needs if place is None else idle}")
        if place is not None:
            notes.append(
                "lateral_acceleration: of a sensor fixed to the rear frame, which leans with it and so reads a share "
                "of gravity, - g lean"
            )
        if any(point.input == TORQUES[STEER_TORQUE] for point in points):
            common, motor_notes = without_motors(content, common)
            notes += motor_notes
        sensor = None if place is None else Accelerometer(place["x_m"], place["z_m"])
        return cls(**common, points=tuple(points), accelerometer=sensor, notes=tuple(notes))

    def prepare(self, **how: Any) -> Self:
        points = tuple(sorted(self.points, key=lambda p: (p.input, p.output, p.speed, p.frequency)))
        return super(FrequencyResponses, replace(self, points=points)).prepare(**how)

    def mistakes(self) -> tuple[Candidate, ...]:
        """Speed; gain, delay and low-pass of each output; gain and delay of each input that has several outputs."""
        errors = [*speed_errors(self.speeds.tolist())]
        points = sorted(self.points, key=lambda p: (p.input, p.output))
        for name in dict.fromkeys(p.output for p in points):
            sensor = describe_signal(name).replace(" ", "_")
            errors += [gain_error(sensor, name), delay_error(sensor, name), lowpass_error(sensor, name)]
        for name in dict.fromkeys(p.input for p in points):
            if name not in self._alone:
                errors += [gain_error(name, name), delay_error(name, name)]
        return tuple(errors)

    def refusals(self) -> dict[str, str]:
        reasons = super().refusals()
        for name, output in self._alone.items():
            for error in ("scale", "delay"):
                reasons[f"{name}_{error}"] = (
                    f"the only response to it is that of the {describe_signal(output)}, whose {error} looks the "
                    f"same: see {describe_signal(output).replace(' ', '_')}_{error}"
                )
        return reasons

    @property
    def _alone(self) -> dict[str, str]:
        """Inputs with a single output that has no other input either: input -> output."""
        pairs = {(p.input, p.output) for p in self.points}
        inputs, outputs = [a for a, _ in pairs], [b for _, b in pairs]
        return {a: b for a, b in pairs if inputs.count(a) == 1 and outputs.count(b) == 1}

    def assumptions(self) -> tuple[str, ...]:
        linear = self.model.linear_model()
        unstable = [v for v in np.unique(self.speeds).tolist() if linear.eigenvalues(v).real.max() > 0]
        independence = ("the noise of different frequencies, outputs and speeds is treated as independent",)
        return (*independence, HELD.format(", ".join(f"{v:g}" for v in unstable))) if unstable else independence

    # ---- physics ----

    @cached_property
    def wanted(self) -> Wanted:
        """The measured responses."""
        return Wanted(
            np.array([p.frequency for p in self.points]),
            self.speeds,
            tuple(p.input for p in self.points),
            tuple(p.output for p in self.points),
        )

    @property
    def speeds(self) -> Array:
        return np.array([p.speed for p in self.points])

    @property
    def varied(self) -> bool:
        """True if the points are of two speeds, or two inputs."""
        return len(about_one_speed(self.speeds.tolist())) > 1 or len(set(self.wanted.inputs)) > 1

    @cached_property
    def data(self) -> tuple[Array, Array]:
        value = np.array([p.value for p in self.points])
        return np.stack([value.real, value.imag], 1).ravel(), np.repeat([p.sd for p in self.points], 2)

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """A series is a part of one response at one speed, along frequency."""
        places, series, displays = [], [], {}
        for p in self.points:
            for part in ("real", "imaginary"):
                name = f"{p.channel}, {p.speed:g} m/s, {part[:4]}"
                displays[name] = Series(p.channel, f"{part} part, {p.unit}", f"frequency at {p.speed:g} m/s, Hz")
                places.append(f"{p.channel}, {p.speed:g} m/s, {p.frequency:.3g} Hz, {part} part")
                series.append(name)
        group = [p.group or f"{p.speed:.6g}" for p in self.points]
        if len(set(group)) == 1 and len(set(self.wanted.inputs)) > 1:
            group = list(self.wanted.inputs)
        hertz = self.wanted.frequency  # bands are held out at one speed with one input
        edges = np.quantile(hertz, np.arange(1, MOST_FOLDS) / MOST_FOLDS)
        fold = folds(group, self.speeds, [f"{band:02d}" for band in np.searchsorted(edges, hertz)])
        return Rows(
            tuple(places),
            np.repeat(hertz, 2),
            tuple(series),
            np.repeat(fold, 2),
            displays=displays,
            axis="frequency, Hz",
        )

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        return self._parts(self.wanted, candidates, theta, slopes=False)[0]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> base.Prediction:
        return self._parts(self.wanted, candidates, theta)

    def _parts(
        self, requested: Wanted, candidates: Candidates, theta: Array, *, slopes: bool = True
    ) -> base.Prediction:
        """Real and imaginary parts, one after the other, as the sensors show them, and their derivatives."""
        family = self.family(candidates)
        gains, slope = responses(family, requested, theta, self.accelerometer, slopes=slopes)
        errors = family.measurement_errors(theta)
        for names in (requested.inputs, requested.outputs):
            for name in dict.fromkeys(names):
                acting = np.array(names) == name
                sensor_gains, sensor_slope = gains[acting], slope[acting]
                apply_sensor(sensor_gains, sensor_slope, requested.s[acting], errors_of(errors, name))
                gains[acting], slope[acting] = sensor_gains, sensor_slope
        return flat_parts(gains, slope)

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Outputs that were not measured, another input, and higher speeds."""
        source, proposals = self.points[0].input, []
        for output in FORCED_OUTPUTS:
            if output not in self.wanted.outputs:
                pair = f"{describe_signal(output)} to the {describe_signal(source)}"
                title = f"the response of the {pair} at the measured speeds"
                proposals.append(self._propose_responses(title, source, (output,)))
        for further_input in ("steer_torque", "lateral_push"):
            if further_input not in self.wanted.inputs:
                measured_outputs = tuple(dict.fromkeys(self.wanted.outputs))
                proposals.append(
                    self._propose_responses(
                        f"the response to a {describe_signal(further_input)} at the measured speeds",
                        further_input,
                        measured_outputs,
                    )
                )
        return (*proposals, *self.propose_forced_response(float(self.speeds.max())))

    def _propose_responses(self, title: str, source: str, outputs: tuple[str, ...]) -> Proposal:
        """Responses of ``outputs`` to a ``source`` at three of the measured speeds."""
        speeds = np.unique(self.speeds)
        three_speeds = speeds[np.unique(np.linspace(0, len(speeds) - 1, 3).astype(int))]
        grid = [(f, v, output) for output in outputs for v in three_speeds for f in FORCED_HZ]
        hertz, at = np.array([f for f, _, _ in grid]), np.array([v for _, v, _ in grid])
        requested = Wanted(hertz, at, (source,) * len(grid), tuple(output for _, _, output in grid))
        size = np.abs(responses(self.family(()), requested, self.nominal, self.accelerometer, slopes=False)[0])
        peak = np.array([size[[o == output for o in requested.outputs]].max() for output in requested.outputs])
        return Proposal(title, np.repeat(FORCED_SD * (size + 0.1 * peak), 2), partial(self._parts, requested))

    def misreadings(self) -> Iterator[tuple[str, "FrequencyResponses"]]:
        """Signs and units of inputs and outputs, outputs in each other's place, frequencies and speeds."""

        def read(**change: Any) -> FrequencyResponses:
            return replace(self, points=tuple(p.read_as(**change) for p in self.points))

        outputs = list(dict.fromkeys(p.output for p in self.points))
        for name in outputs:
            for reading, factor in (ACCELERATIONS if name == ACCELERATION else ANGLES).items():
                yield f"{describe_signal(name)} {reading}", read(of=name, gain=factor)
        for name in dict.fromkeys(p.input for p in self.points):
            for reading, factor in TORQUE_READINGS.items():
                yield f"{describe_signal(name)} {reading}", read(of=name, gain=1 / factor)
        for first, second in combinations([name for name in outputs if name != ACCELERATION], 2):
            yield (
                f"{describe_signal(first)} and {describe_signal(second)} swapped",
                read(names={first: second, second: first}),
            )
        for reading, factor in SPEED_READINGS.items():
            yield reading, read(speed=factor)
        yield "frequencies in rad/s", read(frequency=1 / (2 * math.pi))

    def figures(self) -> dict[str, Figure]:
        return {"before_after": BODE}
