"""One event of a rig's recording: its signs, which use it is, which samples the fit takes, by the fits' own checks."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from studies.look.roles import PULL, ROLLING, Roles
from studies.look.use import Event
from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.campaigns.recording import fit_read
from tyre.campaigns.summary import FitSettings
from tyre.channels.record import Record
from tyre.channels.windows import Window
from tyre.fits.slip_step import complete_samples, is_slip_step
from tyre.fits.sweep_branches import block_means, samples_used
from tyre.recordings.axes import CONVENTIONS
from tyre.recordings.preflight import preflight
from tyre.recordings.read import rig_recording
from tyre.recordings.recording import Condition, PullTest, RigRun
from tyre.recordings.sidecar import Sidecar

SWEEP, PULLED, STEP = "slip sweep", "pull test", "step (relaxation)"
OTHERWISE = {
    SWEEP: "a slip sweep goes up and down between slip angles, without rest, with kind = slip_sweep or none",
    PULLED: "a pull test needs side_force, plate_displacement and rim_displacement (or rigid_rim = true)",
    STEP: 'a step rests, goes to another slip angle and rests there; write kind = "slip_step" into its sidecar',
}
"""What makes a recording the other use."""

KINDS = {"slip_sweep": SWEEP, "pull_test": PULLED, "slip_step": STEP}
ALL_ROLLING = (*ROLLING, "aligning_moment", "inclination", "speed", "temperature")
ALL_PULL = (*PULL, "rim_displacement")
SUPPOSED_LOAD, SUPPOSED_PRESSURE, SUPPOSED_SPEED = 400.0, 5e5, 2.5  # N, Pa, m/s: no check of a fit hinges on them


class Found(NamedTuple):
    """An event: its window, its median load in N, and whether it is a step."""

    window: Window
    load: float
    step: bool


@dataclass(frozen=True)
class Supposed:
    """What the drafts suppose of a recording without a sidecar.

    Attributes
    ----------
    axes : str
        Under which the signs are right; empty where none was found.
    windows : tuple of Found
    load : float, optional
        Median of the whole, N.
    rigid_rim : bool
        A pull test without rim displacement.
    pull : bool
    step : bool
        The whole recording is a step.
    speed_missing : bool
        A step needs the speed, which is not recorded.
    """

    axes: str = ""
    windows: tuple[Found, ...] = ()
    load: float | None = None
    rigid_rim: bool = False
    pull: bool = False
    step: bool = False
    speed_missing: bool = False


def oriented(whole: Record, given: Supposed, path: Path, load: float | None) -> tuple[str, RigRun | PullTest]:
    """The axes under which the recording has the right signs, else the first ones that can be read.

    ``whole`` is the recording, ``given`` what is supposed of it, ``path`` its file, ``load`` its median load, N.

    Raises
    ------
    InputError
        It cannot be read in any axes.
    """
    first: tuple[str, RigRun | PullTest] | None = None
    error: InputError | None = None
    for axes in _likely(load):
        try:
            found = as_rig(whole, given, axes, path)
        except InputError as reason:
            error = error or reason
            continue
        if not any(problem.startswith("wrong sign") for problem in preflight(found).problems):
            return axes, found
        first = first or (axes, found)
    if first is None:
        assert error is not None
        raise error
    return first


def _likely(load: float | None) -> Iterator[str]:
    yield from CONVENTIONS if load is None or load > 0 else ("SAE", *[name for name in CONVENTIONS if name != "SAE"])


def as_rig(record: Record, given: Supposed, axes: str, path: Path) -> RigRun | PullTest:
    """A ``record`` of the file at ``path`` as rig data, as ``tyre fit`` has it once the draft (``given``) is filled in.

    ``axes`` are those of the draft; a step is declared as one.

    Raises
    ------
    InputError
        A channel that is lacking, or beyond what a rig can measure.
    """
    load = record.values.get("vertical_load")
    middle = SUPPOSED_LOAD if load is None or given.pull else float(np.nanmedian(np.abs(load)))
    condition = Condition("?", load=middle, pressure=SUPPOSED_PRESSURE, surface="flat")
    sidecar = Sidecar(condition, axes, None, synthetic=False, notes=(), rigid_rim=given.rigid_rim)
    found = rig_recording(record, sidecar, path)
    if isinstance(found, RigRun) and is_slip_step(found):
        return rig_recording(record, replace(sidecar, kind="slip_step"), path)
    return found


def judge(name: str, recording: RigRun | PullTest, roles: Roles, path: Path) -> tuple[str, Event, str]:
    """Use, samples, and why they cannot be fitted (empty where they can).

    ``name`` is that of the event, ``recording`` the event itself, ``path`` the file.
    """
    if isinstance(recording, PullTest):
        kind, used, lacks = PULLED, recording.complete, "lack a reading"
    elif is_slip_step(recording):
        kind, used, lacks = STEP, complete_samples(recording), "lack a channel"
    else:
        kind, used, lacks = SWEEP, np.isfinite(recording.side_force), "lack the side force"
    problem = ""
    notes: tuple[str, ...] = ()
    if (
        kind == STEP
        and isinstance(recording, RigRun)
        and recording.speed is None
        and roles.sidecar is None
        and recording.condition.speed is None
    ):
        condition = replace(recording.condition, speed=SUPPOSED_SPEED)
        recording = replace(recording, condition=condition)
    try:
        with np.errstate(all="ignore"):  # a wheel that stands still: the fit says so
            summary, _ = fit_read(recording, path, name=name, settings=FitSettings())
        notes = tuple(note for note in summary.notes if note not in roles.opened.signals.notes)
    except InputError as error:
        problem = short(error, path)
    except (ArithmeticError, ValueError) as error:  # also of linear algebra
        problem = f"cannot be fitted ({type(error).__name__}: {error})"
    left_out = {f"that {lacks}": int(np.count_nonzero(~used))}
    if kind == SWEEP and isinstance(recording, RigRun) and not problem:
        settled = samples_used(recording, block_means(recording))
        left_out["within half a metre after a reversal or in a poor block"] = int(np.count_nonzero(used & ~settled))
        used = settled
    first, start = _place(recording.time, roles)
    end = start + (float(recording.time[-1] - recording.time[0]) if recording.time is not None else 0.0)
    left_out = {why: count for why, count in left_out.items() if count}
    event = Event(name, first + 1, first + used.size, int(np.count_nonzero(used)), left_out, notes, start, end)
    return kind, event, problem


def _place(time: Array | None, roles: Roles) -> tuple[int, float]:
    """Number of the first sample in the file, from 0, and its time, s."""
    if time is None:
        return 0, 0.0
    name = next(iter(roles.names((*ALL_ROLLING, *ALL_PULL)).values()), next(iter(roles.opened.signals.signals)))
    whole = roles.opened.time_of(roles.opened.signals.find(name))
    origin = whole[0] if abs(whole[0]) > 1e6 else 0.0
    return int(np.searchsorted(whole - origin, time[0] - 1e-9)), float(time[0])


def short(error: Exception, path: Path) -> str:
    """An ``error`` without the file at ``path``, which is known, and without a draft of a map."""
    text = str(error).partition("\n\n")[0].partition("A first draft of a map")[0].strip(" ;")
    for start in (f"{path}: not usable: ", f"{path}: ", f"{path}, "):
        text = text.removeprefix(start)
    return text or type(error).__name__
