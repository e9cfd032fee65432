"""Rig recordings in TYDEX, read and written.

TYDEX W-axes are ISO axes, so signs are turned on the way. W-channels are read first; if a file has only H-axes
(wheel-parallel to the road), these serve for lateral force, load and aligning moment, as the recording's notes state.
Names of our own, all allowed by the format: ``RIMDISPW`` (lateral displacement of the rim in a lateral stiffness test;
``LATDISPW`` is that of the plate), ``DRUMRAD`` (radius of the drum), ``TESTKIND``, ``RIMIDENT``, ``DATAORIG``.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from tyre.fits.sidecar import Sidecar
from tyre.formats.tydex import ChannelEntry, Entry, TydexDocument, document_text, read_document
from tyre.ground.errors import InputError, read_number
from tyre.ground.files import write_text
from tyre.ground.units import PASCAL_PER_BAR, find_unit
from tyre.recordings.recording import CHANNELS, Channel, Condition, LateralStiffnessTest, RigRun, check_condition, signs
from tyre.recordings.run_checks import TOLERANCES

# channel -> TYDEX names in order of preference, description, unit as written
_TYDEX = {
    "time": (("RUNTIME",), "Running time", "s"),
    "slip_angle": (("SLIPANGL",), "Slip angle", "deg"),
    "lateral_force": (("FYW", "FYH"), "Lateral force, W-axes", "N"),
    "vertical_load": (("FZW", "FZH"), "Vertical force, W-axes", "N"),
    "aligning_moment": (("MZW", "MZH"), "Aligning moment, W-axes", "Nm"),
    "inclination": (("INCLANGL",), "Inclination angle", "deg"),
    "pressure": (("INFLPRES",), "Inflation pressure", "bar"),
    "speed": (("TRAJVELW", "TRAJVELH", "LONGVEL"), "Trajectory velocity", "km/h"),
    "temperature": (("TYRETEMP",), "Tyre temperature", "degC"),
    "plate_displacement": (("LATDISPW",), "Lateral displacement, plate", "mm"),
    "rim_displacement": (("RIMDISPW",), "Lateral displacement, rim", "mm"),
}
_PULL_CHANNELS = ("time", "lateral_force", "plate_displacement", "rim_displacement")


def read_tydex(path: Path) -> tuple[dict[str, Channel], Sidecar, list[str]]:
    """Read TYDEX: channels (n,) in SI units, in the ISO axes of the format; what its constants say; notes."""
    document = read_document(path)
    notes: list[str] = []
    measured = _tydex_channels(document, notes)
    slip = measured.get("slip_angle")
    sweeps = slip is not None and np.isfinite(slip).any() and np.nanmax(slip) - np.nanmin(slip) > np.deg2rad(0.5)
    pull = "plate_displacement" in measured and not sweeps
    used = _PULL_CHANNELS if pull else [name for name in _TYDEX if name not in _PULL_CHANNELS[2:]]
    for name in used[1:3] if pull else used[:4]:
        if name not in measured:
            names = " or ".join(_TYDEX[name][0])
            raise InputError(f"{path}: channel {names} is missing (found: {', '.join(document.channels)})")
    sidecar = _tydex_sidecar(document, measured, notes)
    unused = [name for name in document.channels if not any(name in _TYDEX[key][0] for key in used)]
    if unused:
        notes.append(f"channels not used: {', '.join(unused)}")
    channels = {name: measured[name] for name in used if name in measured}
    if pull and "rim_displacement" not in channels:
        sidecar = replace(sidecar, rigid_rim=True)
        notes.append("no channel RIMDISPW: the rim is taken as rigid, its displacement as zero")
    return channels, sidecar, notes


def write_tydex(recording: RigRun | LateralStiffnessTest, path: str | Path) -> None:
    """Write a recording as a ``.tdx`` file of TYDEX 1.3 in ISO W-axes, whatever axes it was recorded in."""
    path = Path(path)
    if path.suffix.casefold() != ".tdx":
        raise InputError(f"{path}: a TYDEX file must end in .tdx")
    turn = signs("ISO")
    entries, columns = [], []
    for name, ((tydex_name, *_), description, unit) in _TYDEX.items():
        channel: Channel | None = getattr(recording, name, None)
        if channel is not None:
            entries.append(ChannelEntry(tydex_name, description, unit))
            columns.append(channel * (turn[name] * CHANNELS[name].factor) + 0.0)
    header = [
        Entry("RELEASE", "Release of TYDEX-Format", "", "1.3"),
        Entry("MEASID", "Measurement ID", "", path.stem),
        Entry("SUPPLIER", "Data supplier", "", "velotyre"),
    ]
    comments = "SYNTHETIC: computed by a simulation, not measured" if recording.synthetic else "Written by velotyre"
    content = document_text(
        header=header,
        comments=comments,
        constants=_constants(recording),
        channels=entries,
        measured=np.column_stack(columns),
        source=str(path),
    )
    write_text(path, content)


def tydex_sidecar(path: str | Path) -> Sidecar | None:
    """Make a sidecar of the constants of a TYDEX file; None if they do not make one."""
    try:
        document = read_document(path)
        return _tydex_sidecar(document, _tydex_channels(document, []), [])
    except InputError:
        return None


def _tydex_channels(document: TydexDocument, notes: list[str]) -> dict[str, Channel]:
    """Channels in SI units, in the ISO axes of the file."""
    channels: dict[str, Channel] = {}
    for name, (candidates, *_) in _TYDEX.items():
        tydex_name = next((candidate for candidate in candidates if candidate in document.channels), None)
        if tydex_name is None:
            continue
        entry = document.channels[tydex_name]
        unit = find_unit(entry.unit, CHANNELS[name].quantity, where=f"{document.source}, channel {tydex_name}")
        channels[name] = unit.factor * document.physical(tydex_name) + unit.offset
        if tydex_name in ("FYH", "FZH", "MZH"):
            notes.append(f"{tydex_name} (H-axes) replaces {candidates[0]} (W-axes)")
        if entry.measured_offset:
            notes.append(f"{tydex_name}: offset of the measured value added before the conversion factor")
    return channels


def _constant(document: TydexDocument, *names: str) -> str | None:
    """Text of the first constant that is there."""
    return next((entry.value for name in names if (entry := document.constants.get(name)) and entry.value), None)


def _constant_number(document: TydexDocument, name: str, quantity: str) -> float | None:
    value, where = _constant(document, name), f"{document.source}, constant {name}"
    if value is None:
        return None
    try:
        number = read_number(value)
    except ValueError:
        raise InputError(f"{where}: {value[:40]!r} is not a number with a decimal point") from None
    unit = find_unit(document.constants[name].unit, quantity, where=where)
    return unit.factor * number + unit.offset


def _tydex_sidecar(document: TydexDocument, channels: dict[str, Channel], notes: list[str]) -> Sidecar:
    """Condition and kind by the constants, else by the medians of channels, which ``notes`` report."""
    tyre = _constant(document, "IDENTITY", "TYREDES", "MANUFACT")
    if tyre is None:
        identity = document.header.get("MEASID")
        tyre = identity.value if identity and identity.value else Path(document.source).stem
        notes.append(f"no constant IDENTITY: the tyre is called {tyre!r} after the measurement")

    load = _condition_value(document, channels, "vertical_load", ("FZW", "FZH"), notes, nominal="FNOMIN")
    pressure = _condition_value(document, channels, "pressure", ("INFLPRES",), notes, nominal="NOMPRES")
    if load is None or pressure is None:
        missing = "load (constant FZW or FNOMIN)" if load is None else "pressure (constant INFLPRES or NOMPRES)"
        raise InputError(f"{document.source}: no {missing} and no such channel; add the constant")
    camber = None
    if "INCLANGL" in document.constants:
        camber = _condition_value(document, channels, "inclination", ("INCLANGL",), notes)
    radius = _constant_number(document, "DRUMRAD", "length")
    if radius is None:
        _check_flat(document, notes)
    condition = Condition(
        tyre=tyre,
        load=load,
        pressure=pressure,
        surface="flat" if radius is None else "drum",
        drum_radius=radius,
        rim=_constant(document, "RIMIDENT"),
        speed=_condition_value(document, channels, "speed", ("LONGVEL", "TRAJVELW", "TRAJVELH"), notes),
        temperature=_condition_value(document, channels, "temperature", ("AMBITEMP", "TYRETEMP"), []),
        camber=np.nan if camber is None else camber,
    )
    check_condition(condition, where=document.source)
    kind = "slip_step" if _constant(document, "TESTKIND") == "slip_step" else None
    return Sidecar(condition, "ISO", kind, _constant(document, "DATAORIG") == "SYNTHETIC", notes=())


def _condition_value(
    document: TydexDocument,
    channels: dict[str, Channel],
    name: str,
    exact: tuple[str, ...],
    notes: list[str],
    *,
    nominal: str = "",
) -> float | None:
    """One value of the condition in the SI unit of the channel ``name``; None if the file holds none, NaN if it varies.

    It is the first constant of ``exact``, else the ``nominal`` constant if it is near the measured median, else that
    median, which ``notes`` report.
    """
    quantity = CHANNELS[name].quantity
    constants = (_constant_number(document, constant, quantity) for constant in exact)
    exactly = next((value for value in constants if value is not None), None)
    channel = channels.get(name)
    if channel is None or not np.isfinite(channel).any():
        return _constant_number(document, nominal, quantity) if exactly is None else exactly
    tolerance = next((candidate for candidate in TOLERANCES.values() if candidate.channel == name), None)
    label = name.replace("_", " ")
    if tolerance is not None and tolerance.outside(channel) > tolerance.beyond:  # several levels
        if exactly is not None:
            notes.append(f"{label}: its channel varies, so the constant is not taken")
        return np.nan
    if exactly is not None:
        return exactly
    median = float(np.nanmedian(channel))
    value = _constant_number(document, nominal, quantity)
    if value is not None and abs(median - value) <= 0.25 * abs(value):
        return value
    notes.append(f"{label} of the condition is the median of its channel, {median:.6g} in SI units")
    return median


def _check_flat(document: TydexDocument, notes: list[str]) -> None:
    """Refuse a drum without a radius; note a surface that nothing names."""
    words = " ".join(
        _constant(document, name) or "" for name in ("TRCKSURF", "SURFACE", "TESTRIG", "LOCATION")
    ).casefold()
    if "drum" in words or "trommel" in words:
        raise InputError(f"{document.source}: was measured on a drum, but constant DRUMRAD (its radius) is missing")
    if "flat" not in words and "belt" not in words:
        notes.append("no constant names the surface (TRCKSURF, DRUMRAD): taken as flat")


def _constants(recording: RigRun | LateralStiffnessTest) -> list[Entry]:
    condition = recording.condition
    bar, speed = condition.pressure / PASCAL_PER_BAR, condition.speed
    camber = None if getattr(recording, "inclination", None) is not None else np.rad2deg(condition.camber)
    entries: list[tuple[str, str, str, float | str | None]] = [
        ("IDENTITY", "Identity of the tyre", "", condition.tyre),
        ("FNOMIN", "Nominal vertical load", "N", condition.load),
        ("NOMPRES", "Nominal inflation pressure", "bar", bar),
        ("TRCKSURF", "Surface of track", "", condition.surface),
        ("TESTKIND", "Kind of test", "", recording.kind if isinstance(recording, RigRun) else "lateral_stiffness"),
        ("DRUMRAD", "Radius of the drum", "m", condition.drum_radius),
        ("RIMIDENT", "Identity of the rim", "", condition.rim),
        ("LONGVEL", "Longitudinal velocity", "km/h", None if speed is None else speed * 3.6),
        ("AMBITEMP", "Ambient temperature", "degC", condition.temperature),
        ("INCLANGL", "Inclination angle", "deg", camber),
        ("DATAORIG", "Origin of the data", "", "SYNTHETIC" if recording.synthetic else None),
    ]
    return [
        Entry(name, description, unit, value if isinstance(value, str) else f"{value:.10g}")
        for name, description, unit, value in entries
        if value is not None
    ]
