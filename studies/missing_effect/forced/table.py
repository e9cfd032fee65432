"""Measured frequency responses: gain and phase from an input to an output at frequencies and speeds, with their noise.

A row is one complex number; for its noise see :mod:`studies.missing_effect.forced.noise`.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.identification.recording import MOTOR_IN_TORQUE
from studies.missing_effect.forced.noise import NOISE, noise
from studies.missing_effect.forced.simulated import WIDE, is_wide, read_wide
from tyre.base.arrays import Array, Complex
from tyre.base.checks import flag, number
from tyre.base.csv_table import Columns, read_cells, read_columns
from tyre.base.errors import InputError, unknown
from tyre.base.schema import maybe, needed, path_key, read, table
from tyre.channels.units import find_unit

OUTPUTS = {
    "lean": ("lean", "angle"), "roll_rate": ("lean_rate", "angular rate"), "lean_rate": ("lean_rate", "angular rate"),
    "steer": ("steer", "angle"), "steer_rate": ("steer_rate", "angular rate"), "yaw_rate": ("yaw_rate", "angular rate"),
    "lateral_acceleration": ("lateral_acceleration", "acceleration"),
}  # fmt: skip
"""Name in a table -> output of the model, and what it measures."""

INPUTS = {"steer_torque": "moment", "lean_torque": "moment", "lateral_force": "force"}
SI = {"angle": "rad", "angular rate": "rad/s", "acceleration": "m/s^2", "moment": "N m", "force": "N"}
SPOKEN = {"lean_rate": "roll rate"}
FORMS = {
    ("re", "im"): "re and im",
    ("gain", "phase"): "gain and phase_deg",
    ("gain_db", "phase"): "gain_db and phase_deg",
}
PHASES = {"phase_deg": math.pi / 180, "phase_rad": 1.0}
FREQUENCIES = {"frequency_Hz": 1.0, "frequency_hz": 1.0, "frequency_rad_s": 1 / (2 * math.pi)}
SPEEDS = {"speed_m_s": 1.0, "speed_km_h": 1 / 3.6}
NUMBERS = ("re", "im", "gain", "gain_db", *PHASES, *FREQUENCIES, *SPEEDS, *NOISE)
TEXTS = ("input", "output", "input_unit", "output_unit", "group")
FASTEST, HIGHEST = 60.0, 100.0  # m/s, Hz
FEWEST = 3
SMALLEST_SHARE = 1e-6  # of a gain: a smaller sd is none

SPEED = number(above=0, most=FASTEST, says=f"is outside 0 .. {FASTEST:g} m/s; is it in km/h?")
PLACE = table(
    {
        needed("x_m", "no x_m; give the place of the sensor ahead of the rear contact"): number(),
        needed("z_m", "no z_m; give the place of the sensor, z down, so above the ground it is negative"): number(
            most=0, says="must be a finite number in m, z down: above the ground it is negative"
        ),
    }
)
TABLE = table(
    {
        **path_key("table", "FILE.csv"),
        maybe("speed_m_s"): SPEED,
        maybe("relative_sd"): number(above=0, most=1, says="must be a share above 0, at most 1, of each gain"),
        maybe("accelerometer"): PLACE,
        maybe(MOTOR_IN_TORQUE): flag,
    }
)


@dataclass(frozen=True)
class ResponsePoint:
    """Gain ``value`` (SI) from ``input`` to the model's ``output`` at a frequency, with the sd of both its parts.

    ``speed`` is in m/s, ``frequency`` in Hz.
    """

    input: str
    output: str
    frequency: float
    speed: float
    value: complex
    sd: float
    group: str = ""


@dataclass(frozen=True)
class Accelerometer:
    """Place of a lateral accelerometer that is fixed to the rear frame, m: ahead of the rear contact, z down."""

    x: float
    z: float


def spoken(name: str) -> str:
    """An input or output called ``name`` in words."""
    return SPOKEN.get(name, name.replace("_", " "))


def unit_of(point: ResponsePoint) -> str:
    """SI unit of the gain of a ``point``."""
    quantity = next(quantity for output, quantity in OUTPUTS.values() if output == point.output)
    return f"{SI[quantity]} per {SI[INPUTS[point.input]]}"


def read_responses(
    content: Mapping[str, Any], folder: Path
) -> tuple[tuple[ResponsePoint, ...], Accelerometer | None, tuple[str, ...]]:
    """Points of the table ``[frequency_response]``, the place of the accelerometer, and notes on what was assumed.

    Parameters
    ----------
    content : mapping
        The table.
    folder : Path
        Where the file that it names is.

    Raises
    ------
    InputError
        See :func:`read_columns`; also an input or output that is not known, gain or noise in no form or in two, a
        speed, frequency, coherence or number of averages out of range, an sd that is not positive, another unit, a row
        twice, fewer than three rows, an acceleration without the place of its sensor.
    """
    given = read(TABLE, content, section="frequency_response")
    path = folder / given["table"]
    cells = read_cells(path, kind="table; paths are relative to the file that names it", example="input, output")
    if is_wide(cells.header):
        points, notes = _of_simulation(path, given)
    else:
        points, notes = _of_columns(path, given)
    if len(points) < FEWEST:
        raise InputError(f"{path}: {len(points)} row(s) cannot be diagnosed; give at least {FEWEST}, at two speeds")
    place = given.get("accelerometer")
    accelerates = any(p.output == "lateral_acceleration" for p in points)
    if accelerates and place is None:
        raise InputError(
            f"{path}: lateral_acceleration needs the place of its sensor; write "
            "[frequency_response.accelerometer] with x_m and z_m"
        )
    if place is not None and not accelerates:
        raise InputError(
            f"[frequency_response.accelerometer]: there is no lateral_acceleration in {path}; take the table out"
        )
    if place is not None:
        notes = (*notes, "lateral_acceleration: of a sensor fixed to the rear frame, which leans with it and so reads "
                         "a share of gravity, - g lean")  # fmt: skip
    return points, None if place is None else Accelerometer(place["x_m"], place["z_m"]), notes


def _of_simulation(path: Path, given: Mapping[str, Any]) -> tuple[tuple[ResponsePoint, ...], tuple[str, ...]]:
    for key in ("speed_m_s", "relative_sd"):
        if key not in given:
            raise InputError(f"[frequency_response]: {path} is {WIDE}, which does not hold it: write {key} = ...")
    share, speed = given["relative_sd"], given["speed_m_s"]
    found, left = read_wide(path, INPUTS, {output: SI[quantity] for output, quantity in OUTPUTS.values()}, SI)
    points = tuple(
        ResponsePoint(source, output, hertz, speed, gain, share * abs(gain)) for source, output, hertz, gain in found
    )
    notes = [f"{path.name} is {WIDE}: {share:.2g} of each gain is taken as its standard deviation"]
    if left:
        notes.append(f"{path.name}: not compared: {', '.join(left)}")
    return points, tuple(notes)


def _of_columns(path: Path, given: Mapping[str, Any]) -> tuple[tuple[ResponsePoint, ...], tuple[str, ...]]:
    columns = read_columns(path, numbers=NUMBERS, texts=TEXTS, needed=("input", "output"))
    there = columns.numbers
    hertz = _one_of(path, there, FREQUENCIES)
    speed = _speeds(path, columns, given)
    gain = _gains(path, there)
    factor = np.array([_factor(path, columns, row) for row in range(len(columns.lines))])
    sd, notes = noise(path, columns, gain, given.get("relative_sd"))
    points: list[ResponsePoint] = []
    lines: dict[tuple[Any, ...], int] = {}
    for row, line in enumerate(columns.lines):
        where = f"{path}, line {line}"
        if not 0 < speed[row] <= FASTEST:
            raise InputError(f"{where}: a speed of {speed[row]:g} m/s is outside 0 .. {FASTEST:g}; is it in km/h?")
        if not 0 < hertz[row] <= HIGHEST:
            raise InputError(
                f"{where}: a frequency of {hertz[row]:g} Hz is outside 0 .. {HIGHEST:g} Hz; is it in rad/s?"
            )
        if not sd[row] > SMALLEST_SHARE * abs(gain[row]):
            raise InputError(
                f"{where}: the sd is {sd[row]:g}; it must be above 0 (and {SMALLEST_SHARE:g} of the gain): no "
                "measurement is free of noise"
            )
        source, output = columns.texts["input"][row], OUTPUTS[columns.texts["output"][row]][0]
        group = columns.texts["group"][row] if "group" in columns.texts else ""
        point = ResponsePoint(
            source, output, float(hertz[row]), float(speed[row]), complex(gain[row] * factor[row]),
            float(sd[row] * factor[row]), group,
        )  # fmt: skip
        same = (source, output, point.frequency, point.speed, point.value)
        if same in lines:
            raise InputError(f"{where}: the same response as line {lines[same]}; keep one, or it counts twice")
        lines[same] = line
        points.append(point)
    return tuple(points), notes


def _one_of(path: Path, there: Mapping[str, Array], forms: Mapping[str, float]) -> Array:
    """The column that is there, of several in which one thing may be given, in the unit of the first."""
    given = [name for name in forms if name in there]
    if len(given) != 1:
        fault = (
            f"{' and '.join(given)} say the same; keep one" if given else f"the column {next(iter(forms))} is missing"
        )
        raise InputError(f"{path}: {fault}")
    return there[given[0]] * forms[given[0]]


def _speeds(path: Path, columns: Columns, given: Mapping[str, Any]) -> Array:
    if not any(name in columns.numbers for name in SPEEDS) and "speed_m_s" in given:
        return np.full(len(columns.lines), given["speed_m_s"])
    if "speed_m_s" in given:
        raise InputError(f"[frequency_response]: speed_m_s is a column of {path}; take the key out")
    return _one_of(path, columns.numbers, SPEEDS)


def _gains(path: Path, there: Mapping[str, Array]) -> Complex:
    forms = [form for form in FORMS if form[0] in there or (form[1] in there and form[1] != "phase")]
    if len(forms) != 1:
        what = " and ".join(FORMS[form] for form in forms)
        fault = f"{what} say the same; keep one" if forms else f"no gain; give {', or '.join(FORMS.values())}"
        raise InputError(f"{path}: {fault}")
    first, second = forms[0]
    phases = [name for name in PHASES if name in there]
    if second == "phase":
        if first not in there or len(phases) != 1:
            raise InputError(f"{path}: {first} needs one column phase_deg or phase_rad")
        size = there[first] if first == "gain" else 10 ** (there[first] / 20)
        if (size < 0).any():
            raise InputError(f"{path}: gain = {size.min():g} must not be negative; put the sign into the phase")
        return np.asarray(size * np.exp(1j * there[phases[0]] * PHASES[phases[0]]))
    if first not in there or second not in there or phases:
        raise InputError(f"{path}: give both re and im, and no phase beside them")
    return np.asarray(there[first] + 1j * there[second])


def _factor(path: Path, columns: Columns, row: int) -> float:
    """What the gain of a row is multiplied by to be SI."""
    where = f"{path}, line {columns.lines[row]}"
    source, output = columns.texts["input"][row], columns.texts["output"][row]
    if source not in INPUTS:
        raise InputError(f"{where}: {unknown('input', source, INPUTS)}")
    if output not in OUTPUTS:
        raise InputError(f"{where}: {unknown('output', output, OUTPUTS)}")
    factors = []
    for name, quantity in (("output_unit", OUTPUTS[output][1]), ("input_unit", INPUTS[source])):
        text = columns.texts[name][row] if name in columns.texts else ""
        factors.append(find_unit(text, quantity, where=f"{where}: {name}").factor if text else 1.0)
    return factors[0] / factors[1]
