"""The table ``[standing]`` of a measurement file: what was read on a bicycle that stands still.

[standing]
held = "saddle and bottom bracket"
deflections = "readings.csv"        # force_N or load_kg, force_above_hub_m, read_above_hub_m, deflection_mm, ..._sd_mm
taps = ["tap1.csv", "tap2.csv"]     # time_s, hub_lateral_m_s2, stem_lateral_m_s2 ...
vibrations = "taps.csv"             # frequency_Hz, frequency_sd_Hz, damping_ratio ... instead of recordings
stem_above_hub_m = 0.62             # places of the sensors
[[standing.with_mass]]              # taps with a known mass on the front
taps = ["tap3.csv"]
added_kg = 1.0
added_above_hub_m = 0.6
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bicycle.standing.readings import Deflection, Errors, Place, Ratio, Readings, Tap
from bicycle.standing.tap_recordings import TapRecording, identify_taps, read_tap
from tyre.ground.errors import InputError
from tyre.ground.schema import Check, list_of, maybe, needed, number, read, refusal, table, text
from tyre.ground.text_table import Columns, read_columns

GRAVITY = 9.81  # m/s^2, that turns a weight in kg into a load
HOLDS = {
    "saddle and bottom bracket": "the frame is held at saddle and bottom bracket, as a rider holds it",
    "dropouts": "the frame is held at the rear dropouts: the rear triangle is compliant as well",
    "frame clamped": "the frame is clamped",
    "workstand": "a workstand is compliant: read the frame as well",
    "trainer": "the rear axle is held in a trainer",
    "rider seated": "a rider sits on the saddle, feet on the pedals: the frame yaws and leans with the rider",
}
"""What held the frame, and what that means."""
SEATED = "rider seated"
AXLE = ("dropouts", "trainer")  # holds of the rear axle
BARS = ("strapped", "free")
POSES = ("upright", "on its side")
SENSORS = ("rim", "stem", "frame")  # besides the hub
FARTHEST = 2.0  # m above or below the hub
ON_FORK = 0.35  # m above the hub, from where on a place without a word is on the fork
BODIES = {"wheel": "wheel", "fork": "fork", "stem": "fork", "frame": "frame"}

PERCENT = number(least=0, most=50, says="must be a percentage from 0 to 50")
MILLIMETRES = number(least=0, most=100, says="must be a length from 0 to 100 mm")
PLACE = number(
    least=-FARTHEST, most=FARTHEST, says=f"must be a place in m above the hub, -{FARTHEST:g} to {FARTHEST:g}"
)
MASS = number(above=0, most=20, says="must be a mass in kg, up to 20")
FILES = list_of(text(blank=False), 'must be a list of files, such as ["tap1.csv", "tap2.csv"]', least=1)
WITH_MASS = table({needed("taps"): FILES, needed("added_kg"): MASS, needed("added_above_hub_m"): PLACE})
TABLE = table(
    {
        needed("held", f"held is missing; write what held the frame: {', '.join(HOLDS)}"): text(
            f"must be one of {', '.join(HOLDS)}", allowed=HOLDS
        ),
        maybe("bar", "strapped"): text(f"must be {' or '.join(BARS)}", allowed=BARS),
        maybe("pose", "upright"): text(f"must be {' or '.join(POSES)}", allowed=POSES),
        maybe("deflections"): text(blank=False),
        maybe("taps"): FILES,
        maybe("vibrations"): text(blank=False),
        maybe("with_mass", []): list_of(WITH_MASS, "must be tables: write [[standing.with_mass]]", strict=False),
        **{maybe(f"{sensor}_above_hub_m"): PLACE for sensor in SENSORS},
        maybe("load_sd_percent", 100 * Errors().load): PERCENT,
        maybe("place_sd_mm", 1000 * Errors().place): MILLIMETRES,
        maybe("gain_sd_percent", 100 * Errors().gain): PERCENT,
    }
)


@dataclass(frozen=True)
class Standing:
    """Content of the table: the readings, what held the frame, and what is assumed."""

    readings: Readings
    held: str  # one of :data:`HOLDS`
    notes: tuple[str, ...]


def read_standing(content: Any, folder: Path, p: Mapping[str, float]) -> Standing:
    """Read the table and the files that it names.

    Parameters
    ----------
    content : mapping
        The table ``[standing]``.
    folder : Path
        What file names are relative to.
    p : mapping
        Parameters of the bicycle, SI: the place ``ground`` is the lowest point of its front wheel.

    Raises
    ------
    InputError
        Anything missing, unknown or out of range, with file, line or key.
    """
    given = read(TABLE, content, section="standing")
    words = {"axle": 0.0, "hub": 0.0, "ground": -p["rF"] * math.cos(p["lam"])}
    errors = Errors(given["load_sd_percent"] / 100, given["place_sd_mm"] / 1000, given["gain_sd_percent"] / 100)
    deflections: tuple[Deflection, ...] = ()
    if "deflections" in given:
        deflections = tuple(_read_deflections(folder / given["deflections"], words))
    taps: tuple[Tap, ...] = ()
    if "vibrations" in given:
        taps += tuple(_read_vibrations(folder / given["vibrations"], given, words))
    seated = given["held"] == SEATED
    taps += _read_taps(given, folder, seated=seated)
    if not deflections and not taps:
        raise InputError("[standing]: nothing was read; give deflections, taps or vibrations")
    on_side = given["pose"] == "on its side"
    if seated and on_side:
        raise InputError(f'[standing]: held = "{SEATED}" and pose = "on its side" exclude each other')
    readings = Readings(
        deflections,
        taps,
        given["bar"] == "free",
        on_side,
        errors,
        seated=seated,
        axle_held=given["held"] in AXLE,
    )
    return Standing(readings, given["held"], tuple(_notes(readings)))


def _place(words: Mapping[str, float]) -> Check:
    """Check of a cell that is a number, m above the hub, or a word."""

    def check(value: Any) -> float:
        if isinstance(value, str):
            if value not in words:
                raise refusal(value, f"must be m above the hub, or one of {', '.join(words)}")
            return words[value]
        return float(PLACE(value))

    return check


def point(above: float, on: str = "") -> Place:
    """The place ``above`` the hub (m) on a named part; without a name on the wheel, or on the fork above it."""
    return Place(above, BODIES[on] if on else "fork" if above > ON_FORK else "wheel")


LEAST_SD = number(least=1e-5, says="must be a standard uncertainty, 1e-5 or more; scatter of repeats shows it")
DEFLECTIONS: dict[str, Check] = {
    "force_N": number(least=-2000, most=2000, says="must be a force in N, up to 2000"),
    "load_kg": number(least=-200, most=200, says="must be a weight in kg, up to 200"),
    "deflection_mm": number(least=-300, most=300, says="must be a deflection in mm, up to 300"),
    "deflection_sd_mm": number(above=0, most=50, says="must be a standard uncertainty in mm, above 0 and up to 50"),
}


def _read_deflections(path: Path, words: Mapping[str, float]) -> Iterator[Deflection]:
    """Read the table of deflections."""
    places = {"force_above_hub_m": _place(words), "read_above_hub_m": _place(words)}
    columns = read_columns(
        path, numbers={**DEFLECTIONS, **places}, texts=("read_on",), needed=(*places, *list(DEFLECTIONS)[2:])
    )
    loads = [name for name in ("force_N", "load_kg") if name in columns.numbers]
    if len(loads) != 1:
        raise InputError(f"{path}: give one of the columns force_N and load_kg")
    factor = GRAVITY if loads == ["load_kg"] else 1.0
    for row, line in enumerate(columns.lines):
        cell = {name: float(column[row]) for name, column in columns.numbers.items()}
        on = columns.texts["read_on"][row] if "read_on" in columns.texts else ""
        where = f"{path}, line {line}"
        if on not in ("", *BODIES):
            raise InputError(f"{where}: read_on = {on!r} must be one of {', '.join(BODIES)}")
        force = factor * cell[loads[0]]
        if force == 0:
            raise InputError(f"{where}: {loads[0]} = 0 deflects nothing; take the row out")
        yield Deflection(
            force,
            point(cell["force_above_hub_m"]),
            point(cell["read_above_hub_m"], on),
            cell["deflection_mm"] / 1000,
            cell["deflection_sd_mm"] / 1000,
        )


RATIOS = {f"{sensor}_over_hub": sensor for sensor in SENSORS}
VIBRATIONS: dict[str, Check] = {
    "frequency_Hz": number(above=0, most=200, says="must be a frequency in Hz, above 0 and up to 200"),
    "frequency_sd_Hz": LEAST_SD,
    "damping_ratio": number(least=0, most=1, says="must be a damping ratio from 0 to 1"),
    "damping_ratio_sd": LEAST_SD,
    "added_kg": number(least=0, most=20, says="must be a mass in kg, up to 20"),
    "vibration": number(least=1, most=3, says="must be 1 for the slowest vibration, 2 and 3 for faster ones"),
    **{name: number(least=-50, most=50) for name in RATIOS},
    **{f"{name}_imaginary": number(least=-50, most=50) for name in RATIOS},
    **{f"{name}_sd": LEAST_SD for name in RATIOS},
}


def _read_vibrations(path: Path, given: Mapping[str, Any], words: Mapping[str, float]) -> Iterator[Tap]:
    """Read the table of vibrations that were evaluated elsewhere."""
    columns = read_columns(
        path,
        numbers={**VIBRATIONS, "added_above_hub_m": _place(words)},
        needed=("frequency_Hz", "frequency_sd_Hz"),
    )
    for name in ("damping_ratio", *(name for name in RATIOS)):
        _refuse_half(path, columns, (name, f"{name}_sd"))
    for name in RATIOS:
        if f"{name}_imaginary" in columns.numbers and name not in columns.numbers:
            raise InputError(f"{path}: {name}_imaginary needs the column {name} as well")
    _refuse_half(path, columns, ("added_kg", "added_above_hub_m"))
    for row, line in enumerate(columns.lines):
        cell = {name: float(column[row]) for name, column in columns.numbers.items()}
        ratios = tuple(
            Ratio(
                _sensor(given, sensor, str(path)),
                Place(0.0),
                cell[name],
                cell[f"{name}_sd"],
                cell.get(f"{name}_imaginary", math.nan),
            )
            for name, sensor in RATIOS.items()
            if name in cell
        )
        yield Tap(
            f"{path.name}, line {line}",
            cell["frequency_Hz"],
            cell["frequency_sd_Hz"],
            cell.get("damping_ratio", math.nan),
            cell.get("damping_ratio_sd", math.nan),
            ratios,
            cell.get("added_kg", 0.0),
            point(cell.get("added_above_hub_m", 0.0)) if cell.get("added_kg") else Place(0.0),
            int(cell.get("vibration", 1)),
        )


def _refuse_half(path: Path, columns: Columns, pair: tuple[str, str]) -> None:
    """Refuse one column of a ``pair`` without the other."""
    present = [name for name in pair if name in columns.numbers]
    if len(present) == 1:
        (missing,) = set(pair) - set(present)
        raise InputError(f"{path}: {present[0]} needs the column {missing} as well")


def _read_taps(given: Mapping[str, Any], folder: Path, *, seated: bool) -> tuple[Tap, ...]:
    """Read recordings of taps, without and with an added mass; under a seated rider two vibrations of each."""
    entries = [(name, 0.0, Place(0.0)) for name in given.get("taps", ())]
    for group in given["with_mass"]:
        entries += [(name, group["added_kg"], point(group["added_above_hub_m"])) for name in group["taps"]]
    recordings = []
    places: dict[str, Place] = {}
    for name, added_mass, added in entries:
        time, channels = read_tap(folder / name)
        places |= {channel: _sensor(given, channel.partition("_")[0], str(folder / name)) for channel in channels}
        recordings.append(TapRecording(name, time, channels, added_mass, added))
    _refuse_copies(recordings)
    return identify_taps(recordings, places, seated=seated) if recordings else ()


def _refuse_copies(recordings: Sequence[TapRecording]) -> None:
    """Refuse a recording that occurs twice: it would have the weight of two."""
    seen: dict[bytes, str] = {}
    for recording in recordings:
        samples = b"".join(channel.tobytes() for channel in recording.channels.values())
        if samples in seen:
            raise InputError(f"{recording.name}: the same recording as {seen[samples]}; keep one, or it counts twice")
        seen[samples] = recording.name


def _sensor(given: Mapping[str, Any], sensor: str, where: str) -> Place:
    """Place of a sensor; the hub needs none."""
    if sensor == "hub":
        return Place(0.0)
    key = f"{sensor}_above_hub_m"
    if key not in given:
        raise InputError(f"{where}: the place of the {sensor} sensor is not given; write {key} in [standing]")
    return point(given[key], "frame" if sensor == "frame" else "fork" if sensor == "stem" else "wheel")


def _notes(readings: Readings) -> Iterator[str]:
    """What is assumed of all readings."""
    errors = readings.errors
    if readings.deflections:
        yield f"weights are taken as right within {100 * errors.load:.2g} % (load_sd_percent)"
    if readings.places:
        yield f"places are taken as right within {1000 * errors.place:.2g} mm (place_sd_mm), the hub as exact"
    if (change := readings.change) is not None:
        yield (
            f"the vibration does not decay exponentially: damping ratio {change.early:.2g} until it has halved, "
            f"{change.late:.2g} after; dry friction does so, or a joint that rubs"
        )
        yield "the standard uncertainty of the damping contains half the difference of the two damping ratios"
    if readings.pairs:
        yield f"two sensors are taken to agree within {100 * errors.gain:.2g} % (gain_sd_percent)"
