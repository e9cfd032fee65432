"""Recordings from and to TYDEX 1.3 files; the file itself, byte for byte, is ``tyre.channels.tydex_document``.

TYDEX W-axes are ISO axes, so signs are turned on the way. W-channels are read first; where a file has only H-axes
(wheel-parallel to the road), these serve for side force, load and aligning moment, and the recording's notes say so.
Names of our own, all allowed by the format: ``RIMDISPW`` (lateral displacement of the rim in a pull test, beside
``LATDISPW`` of the plate), ``DRUMRAD`` (radius of the drum), ``TESTKIND``, ``RIMIDENT``, ``DATAORIG``.
"""

from pathlib import Path

import numpy as np

from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.channels.tydex_document import ChannelEntry, Entry, TydexDocument, read_document, write_document
from tyre.recordings.axes import signs
from tyre.recordings.check import check_channels, check_condition
from tyre.recordings.recording import Channel, Condition, PullTest, RigRun
from tyre.recordings.tydex_build import build
from tyre.recordings.units import find_unit

# what a channel is here -> TYDEX names in order of preference, quantity
_CHANNELS = {
    "time": (("RUNTIME",), "time"),
    "slip_angle": (("SLIPANGL",), "angle"),
    "side_force": (("FYW", "FYH"), "force"),
    "vertical_load": (("FZW", "FZH"), "force"),
    "aligning_moment": (("MZW", "MZH"), "moment"),
    "inclination": (("INCLANGL",), "angle"),
    "pressure": (("INFLPRES",), "pressure"),
    "speed": (("TRAJVELW", "TRAJVELH", "LONGVEL"), "speed"),
    "temperature": (("TYRETEMP",), "temperature"),
    "plate_displacement": (("LATDISPW",), "length"),
    "rim_displacement": (("RIMDISPW",), "length"),
}
_SWEEP_NAMES = ("time", "slip_angle", "side_force", "vertical_load", "aligning_moment", "inclination", "speed",
                "temperature")  # fmt: skip
_PULL_NAMES = ("time", "side_force", "plate_displacement", "rim_displacement")
_SMALLEST_SWEEP = np.deg2rad(0.5)
_NEAR = 0.25  # a nominal load or pressure farther from the measured median than this share is not that of the test
_WRITTEN = {
    "time": ("RUNTIME", "Running time", "s", 1.0),
    "slip_angle": ("SLIPANGL", "Slip angle", "deg", np.rad2deg(1.0)),
    "side_force": ("FYW", "Lateral force, W-axes", "N", 1.0),
    "vertical_load": ("FZW", "Vertical force, W-axes", "N", 1.0),
    "aligning_moment": ("MZW", "Aligning moment, W-axes", "Nm", 1.0),
    "inclination": ("INCLANGL", "Inclination angle", "deg", np.rad2deg(1.0)),
    "speed": ("TRAJVELW", "Trajectory velocity", "km/h", 3.6),
    "temperature": ("TYRETEMP", "Tyre temperature", "degC", 1.0),
    "plate_displacement": ("LATDISPW", "Lateral displacement, plate", "mm", 1e3),
    "rim_displacement": ("RIMDISPW", "Lateral displacement, rim", "mm", 1e3),
}


def read_tydex(path: str | Path) -> RigRun | PullTest:
    """Read a recording from a TYDEX file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    RigRun or PullTest
        A pull test when the file has ``LATDISPW`` and no sweep of ``SLIPANGL``. SI units, adapted SAE axes; ``axes``
        is ``ISO``, the convention of TYDEX. ``notes`` says which values had to be taken from the channels or assumed
        and which channels were not used. A nominal load or pressure from which the measured median is farther than a
        quarter is not that of the test: the median is.

    Raises
    ------
    InputError
        When the file is malformed, a needed channel is missing, or a unit or value is impossible.
    """
    document = read_document(path)
    notes: list[str] = []
    found = _channels(document, notes)
    slip = found.get("slip_angle")
    sweeps = slip is not None and np.isfinite(slip).any() and np.nanmax(slip) - np.nanmin(slip) > _SMALLEST_SWEEP
    pull = "plate_displacement" in found and not sweeps
    for name in ("side_force", "plate_displacement") if pull else _SWEEP_NAMES[:4]:
        if name not in found:
            names = " or ".join(_CHANNELS[name][0])
            raise InputError(f"{path}: channel {names} is missing (found: {', '.join(document.channels)})")
    used = _PULL_NAMES if pull else _SWEEP_NAMES
    condition = _condition(document, found, notes)
    if "pressure" in found:
        notes.append("channel INFLPRES serves for the condition only")
    unused = [name for name in document.channels if not any(name in _CHANNELS[key][0] for key in (*used, "pressure"))]
    if unused:
        notes.append(f"channels not used: {', '.join(unused)}")
    channels = {name: found[name] for name in used if name in found}
    synthetic = _text(document, "DATAORIG") == "SYNTHETIC"
    recording: RigRun | PullTest
    if pull:
        if "rim_displacement" not in channels:
            channels["rim_displacement"] = np.zeros_like(channels["plate_displacement"])
            notes.append("no channel RIMDISPW: the rim is taken as rigid, its displacement as zero")
        recording = PullTest(
            condition=condition, axes="ISO", **channels, source=Path(path), synthetic=synthetic, notes=tuple(notes)
        )
    else:
        recording = RigRun(
            condition=condition,
            axes="ISO",
            **channels,
            source=Path(path),
            synthetic=synthetic,
            kind="slip_step" if _text(document, "TESTKIND") == "slip_step" else "slip_sweep",
            notes=tuple(notes),
        )
    check_channels(recording, where=str(path))
    return recording


def write_tydex(recording: RigRun | PullTest, path: str | Path) -> None:
    """Write a recording as a TYDEX 1.3 file in ISO W-axes, whatever axes it was recorded in.

    Parameters
    ----------
    recording : RigRun or PullTest
    path : str or Path
        Ends in ``.tdx``.

    Raises
    ------
    InputError
        When the path does not end in ``.tdx`` or a number does not fit in a TYDEX field.
    """
    path = Path(path)
    if path.suffix.casefold() != ".tdx":
        raise InputError(f"{path}: a TYDEX file must end in .tdx")
    turn = _iso_signs()
    entries, columns = [], []
    for name, (tydex_name, description, unit, factor) in _WRITTEN.items():
        channel: Channel | None = getattr(recording, name, None)
        if channel is not None:
            entries.append(ChannelEntry(tydex_name, description, unit))
            columns.append(channel * (turn.get(name, 1.0) * factor) + 0.0)
    header = [
        Entry("RELEASE", "Release of TYDEX-Format", "", "1.3"),
        Entry("MEASID", "Measurement ID", "", path.stem),
        Entry("SUPPLIER", "Data supplier", "", "velotyre"),
    ]
    comments = "SYNTHETIC: computed by a simulation, not measured" if recording.synthetic else "Written by velotyre"
    document = build(
        header=header,
        comments=comments,
        constants=_constants(recording),
        channels=entries,
        measured=np.column_stack(columns),
        source=str(path),
    )
    write_document(document, path)


def _iso_signs() -> dict[str, float]:
    iso = signs("ISO")
    return {
        "slip_angle": iso.slip_angle,
        "side_force": iso.lateral,
        "aligning_moment": iso.aligning_moment,
        "inclination": iso.inclination,
        "plate_displacement": iso.lateral,
        "rim_displacement": iso.lateral,
    }


def _channels(document: TydexDocument, notes: list[str]) -> dict[str, Channel]:
    turn = _iso_signs()
    found: dict[str, Channel] = {}
    for name, (candidates, quantity) in _CHANNELS.items():
        tydex_name = next((candidate for candidate in candidates if candidate in document.channels), None)
        if tydex_name is None:
            continue
        entry = document.channels[tydex_name]
        unit = find_unit(entry.unit, quantity, where=f"{document.source}, channel {tydex_name}")
        found[name] = turn.get(name, 1.0) * (unit.factor * document.physical(tydex_name) + unit.offset)
        if tydex_name in ("FYH", "FZH", "MZH"):
            notes.append(f"{tydex_name} (H-axes) stands in for {candidates[0]} (W-axes)")
        if entry.measured_offset:
            notes.append(f"{tydex_name}: offset of the measured value added before the conversion factor")
    return found


def _text(document: TydexDocument, name: str) -> str | None:
    entry = document.constants.get(name)
    return entry.value if entry else None


def _constant(document: TydexDocument, name: str, quantity: str) -> float | None:
    entry = document.constants.get(name)
    if entry is None or entry.value is None:
        return None
    where = f"{document.source}, constant {name}"
    try:
        value = float(entry.value)
    except ValueError:
        raise InputError(f"{where}: {entry.value[:40]!r} is not a number with a decimal point") from None
    unit = find_unit(entry.unit, quantity, where=where)
    return unit.factor * value + unit.offset


def _set_value(
    document: TydexDocument,
    found: dict[str, Channel],
    notes: list[str],
    *,
    name: str,
    exact: tuple[str, ...],
    nominal: tuple[str, ...] = (),
) -> float | None:
    """One number of the condition: a constant, else a nominal value near the measured median, else that median."""
    quantity = _CHANNELS[name][1]
    for constant in exact:
        value = _constant(document, constant, quantity)
        if value is not None:
            return value
    channel = found.get(name)
    median = float(np.nanmedian(channel)) if channel is not None and np.isfinite(channel).any() else None
    for constant in nominal:
        value = _constant(document, constant, quantity)
        if value is not None and (median is None or abs(median - value) <= _NEAR * abs(value)):
            return value
    if median is not None:
        notes.append(
            f"{name.replace('_', ' ')} of the condition is the median of its channel, {median:.6g} in SI units"
        )
    return median


def _condition(document: TydexDocument, found: dict[str, Channel], notes: list[str]) -> Condition:
    where = document.source
    tyre = _text(document, "IDENTITY") or _text(document, "MANUFACT")
    if tyre is None:
        identity = document.header.get("MEASID")
        tyre = identity.value if identity and identity.value else Path(document.source).stem
        notes.append(f"no constant IDENTITY: the tyre is called {tyre!r} after the measurement")
    load = _set_value(document, found, notes, name="vertical_load", exact=("FZW", "FZH"), nominal=("FNOMIN",))
    pressure = _set_value(document, found, notes, name="pressure", exact=("INFLPRES",), nominal=("NOMPRES",))
    if load is None or pressure is None:
        missing = "load (constant FZW or FNOMIN)" if load is None else "pressure (constant INFLPRES or NOMPRES)"
        raise InputError(f"{where}: no {missing} and no such channel; add the constant")
    radius = _constant(document, "DRUMRAD", "length")
    surface = "drum" if radius is not None else _surface(document, notes)
    condition = Condition(
        tyre=tyre,
        load=load,
        pressure=pressure,
        surface=surface,
        drum_radius=radius,
        rim=_text(document, "RIMIDENT"),
        speed=_set_value(document, found, notes, name="speed", exact=("LONGVEL", "TRAJVELW", "TRAJVELH")),
        temperature=_set_value(document, found, [], name="temperature", exact=("AMBITEMP", "TYRETEMP")),
        camber=_set_value(document, found, notes, name="inclination", exact=("INCLANGL",)) or 0.0,
    )
    check_condition(condition, where=where)
    return condition


def _surface(document: TydexDocument, notes: list[str]) -> str:
    words = " ".join(filter(None, (_text(document, name) for name in ("TRCKSURF", "TESTRIG", "LOCATION")))).casefold()
    if "drum" in words or "trommel" in words:
        raise InputError(f"{document.source}: was measured on a drum, but constant DRUMRAD (its radius) is missing")
    if "flat" not in words and "belt" not in words:
        notes.append("no constant names the surface (TRCKSURF, DRUMRAD): taken as flat")
    return "flat"


def _constants(recording: RigRun | PullTest) -> list[Entry]:
    condition = recording.condition
    kind = recording.kind if isinstance(recording, RigRun) else "pull_test"
    camber = f"{np.rad2deg(condition.camber):.10g}"
    entries = [
        Entry("IDENTITY", "Identity of the tyre", "", condition.tyre),
        Entry("FNOMIN", "Nominal vertical load", "N", f"{condition.load:.10g}"),
        Entry("NOMPRES", "Nominal inflation pressure", "bar", f"{condition.pressure / PASCAL_PER_BAR:.10g}"),
        Entry("TRCKSURF", "Surface of track", "", condition.surface),
        Entry("TESTKIND", "Kind of test", "", kind),
    ]
    if condition.drum_radius is not None:
        entries.append(Entry("DRUMRAD", "Radius of the drum", "m", f"{condition.drum_radius:.10g}"))
    if condition.rim is not None:
        entries.append(Entry("RIMIDENT", "Identity of the rim", "", condition.rim))
    if condition.speed is not None:
        entries.append(Entry("LONGVEL", "Longitudinal velocity", "km/h", f"{condition.speed * 3.6:.10g}"))
    if condition.temperature is not None:
        entries.append(Entry("AMBITEMP", "Ambient temperature", "degC", f"{condition.temperature:.10g}"))
    if getattr(recording, "inclination", None) is None:
        entries.append(Entry("INCLANGL", "Inclination angle", "deg", camber))
    if recording.synthetic:
        entries.append(Entry("DATAORIG", "Origin of the data", "", "SYNTHETIC"))
    return entries
