"""Read a rig measurement: recordings of a tyre, and what was known of that tyre before.

kind = "rig"
[rig]
recordings = "drum"                 # a folder, or a list of files (CSV with sidecar, TYDEX)
includes = ["sweep_lag"]            # rig effects that the base model contains
pull_displacement = "tyre"          # plate minus rim; "plate" ignores what the rim gauge reads
wheel_radius_m = 0.34
load_tolerance = 0.05               # of the declared load, see tyre.recordings.preflight
[rig.calibration]                   # relative, 1 sd: force, slip, displacement, repeatability
[rig.reference]                     # one of: recordings, campaign, table, [[rig.reference.conditions]]
recordings = "flat"
"""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from studies.missing_effect.gap_figures import GAP
from studies.missing_effect.interface import Figure
from studies.missing_effect.rig.figures import CAPTION, draw_recordings
from studies.missing_effect.rig.recordings import WHEEL_RADIUS, RigRecordings
from studies.missing_effect.rig.recordings_forward import RigRecordingsForward
from studies.missing_effect.rig.reference_file import read_reference
from studies.missing_effect.rig.setup import rig_forward_model
from tyre.base.checks import anything, list_of, number, text
from tyre.base.errors import InputError
from tyre.base.schema import by_name, maybe, needed, read, table
from tyre.campaigns.campaign import recordings_in
from tyre.campaigns.summary import FitSettings
from tyre.estimate import Calibration
from tyre.fits.slip_step import is_slip_step
from tyre.fits.slip_sweep import fit_slip_sweep
from tyre.recordings.preflight import LOAD_TOLERANCE, preflight
from tyre.recordings.read import read_recording
from tyre.recordings.recording import SYNTHETIC_NOTES, PullTest, RigRun

PULL_DISPLACEMENTS = ("tyre", "plate")
EXAMPLE = 'write [rig] with recordings = "FOLDER" and a table [rig.reference]'
NO_RIG = f'kind is "rig" but the table [rig] is missing; {EXAMPLE}'
RELATIVE = number(says="must be a number: a relative standard deviation")
RIG = table(
    {
        needed("recordings", f"recordings is missing; {EXAMPLE}"): anything,
        needed("reference", f"reference is missing; {EXAMPLE}"): anything,
        maybe("includes", []): list_of(text(), 'must be a list of rig effects such as ["sweep_lag"]'),
        maybe("pull_displacement", "tyre"): text(
            'is not allowed; write "tyre" (plate minus rim) or "plate" (rim ignored)', allowed=PULL_DISPLACEMENTS
        ),
        maybe("wheel_radius_m", WHEEL_RADIUS): number(
            least=0.1, most=0.6, says="must be a radius of wheel and tyre from 0.1 to 0.6 m"
        ),
        maybe("load_tolerance", LOAD_TOLERANCE): number(
            above=0, most=1, says="must be a number above 0, at most 1: a share of the declared load"
        ),
        maybe("calibration", {}): by_name(RELATIVE, [f.name for f in fields(Calibration)], kind="key"),
    }
)
KEYS = RIG.keys


@dataclass(frozen=True, eq=False)
class RigMeasurement(RigRecordings):
    """Recordings of one tyre and the reference they are compared with, as a measurement."""

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> RigRecordingsForward:
        """The forward model; effects in ``without`` are not tried, those in ``also`` are tried anyway.

        Raises
        ------
        InputError
            An effect that does not exist, recordings that cannot be used, a reference that lacks what they need.
        """
        return rig_forward_model(self, without=without, also=also)

    def figures(self) -> dict[str, Figure]:
        """The gap, and what the effects say of it in newtons."""
        return {"gap": GAP, "before_after": (draw_recordings, CAPTION)}


def read_rig(content: Any, folder: Path, **words: Any) -> RigMeasurement:
    """The measurement of a file with kind = "rig".

    Parameters
    ----------
    content : object
        Its table ``[rig]``.
    folder : Path
        Where the files that it names are.
    **words
        ``name``, ``description`` and ``source``.

    Raises
    ------
    InputError
        A key, file or condition that is missing, unknown or out of range, with what to do.
    """
    rig = read(RIG, content, section="rig")
    tolerance = rig["load_tolerance"]
    settings = FitSettings(Calibration(**rig["calibration"]), load_tolerance=tolerance)
    files = _files(rig["recordings"], folder)
    sweeps, pulls, notes = _recordings(files, tolerance, skip_bad=isinstance(rig["recordings"], str))
    return RigMeasurement(
        reference=read_reference(rig["reference"], folder, settings), sweeps=sweeps, pulls=pulls,
        includes=tuple(dict.fromkeys(rig["includes"])), pull_displacement=rig["pull_displacement"],
        wheel_radius=rig["wheel_radius_m"], calibration=settings.calibration, notes=notes, **words,
    )  # fmt: skip


def _files(given: Any, folder: Path) -> list[tuple[str, Path]]:
    """Recordings with their names: a folder's all, or those of a list."""
    if isinstance(given, str):
        root = folder / given
        return [(str(path.relative_to(root).with_suffix("")), path) for path in recordings_in(root)]
    if not isinstance(given, list) or not given or not all(isinstance(name, str) for name in given):
        raise InputError(f"[rig]: recordings = {given!r} must be a folder in quotes or a list of files")
    stems = [Path(name).stem for name in given]
    for stem, name in zip(stems, given, strict=True):
        if stems.count(stem) > 1:
            raise InputError(f"[rig]: recordings names {name} twice, or two files of that name; keep one")
    return [(stem, folder / name) for stem, name in zip(stems, given, strict=True)]


def _recordings(
    files: list[tuple[str, Path]], load_tolerance: float, *, skip_bad: bool
) -> tuple[tuple[tuple[str, RigRun], ...], tuple[tuple[str, PullTest], ...], tuple[str, ...]]:
    sweeps: list[tuple[str, RigRun]] = []
    pulls: list[tuple[str, PullTest]] = []
    notes: list[str] = []
    left_out: list[str] = []
    for name, path in files:
        try:
            recording = read_recording(path)
            check = preflight(recording, load_tolerance=load_tolerance)
            if not check.usable:
                raise InputError(f"{path}: not usable: {'; '.join(check.problems)}")
        except InputError as error:
            if not skip_bad or len(files) == 1:
                raise
            left_out.append(f"{name}: left out: {error}")
            continue
        problems = dict.fromkeys((*recording.notes, *check.problems))
        notes += [f"{name}: {problem}" for problem in problems if problem not in SYNTHETIC_NOTES]
        if isinstance(recording, PullTest):
            pulls.append((name, recording))
        elif is_slip_step(recording):
            notes.append(f"{name}: a slip step, not used; only slip sweeps and pull tests are")
        else:
            sweeps.append((name, recording))
            notes += [f"{name}: {fault}" for fault in fit_slip_sweep(recording).sensor_faults]
    if left_out and not sweeps and not pulls:
        raise InputError(f"none of {len(files)} recordings can be used; {'; '.join(left_out)}")
    return tuple(sweeps), tuple(pulls), (*left_out, *notes)
