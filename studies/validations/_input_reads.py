"""Every reader as its command calls it, with one cheap computation of what it read."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from studies.validations import _input_recordings as recordings
from studies.validations._input_examples import Example

SPEED = 5.0  # m/s, of what is computed


Read = Callable[[Path, Example], Any]


def _dynamics(model: Any) -> Any:
    return model.linear_model().eigenvalues([SPEED])


def bicycle(path: Path, example: Example) -> Any:
    """Read a bicycle at ``path``, of an ``example``."""
    from bicycle.files.bicycle_file import load_bicycle
    from bicycle.model import Model

    found = load_bicycle(path)
    return found, _dynamics(Model(found))


def bicycles(path: Path, example: Example) -> Any:
    """Read a table of bicycles at ``path``, of an ``example``."""
    from bicycle.files.bicycle_table import read_bicycles
    from bicycle.model import Model

    found = read_bicycles(path)
    return found, _dynamics(Model(found[0]))


def model(path: Path, example: Example) -> Any:
    """Read a model file at ``path``, of an ``example``."""
    from studies.model_argument import choose

    found = choose(str(path)).model
    return found, _dynamics(found)


def measurement(path: Path, example: Example) -> Any:
    """Read a measurement at ``path``, of an ``example``."""
    from studies.missing_effect import read_measurement

    found = read_measurement(path)
    forward: Any = found.forward()
    return found, [nuisance.centre for nuisance in forward.nuisances]


def tyre(path: Path, example: Example) -> Any:
    """Read a tyre at ``path``, of an ``example``."""
    from tyre import read_tyre

    found = read_tyre(path)
    pressure = float(found.pressures[0]) if found.pressures.size else 5e5
    return found, found.at(load=float(np.mean(found.load_range)) if math.isfinite(sum(found.load_range)) else 400.0,
                           pressure=pressure)  # fmt: skip


def sweep(path: Path, example: Example) -> Any:
    """Read a sweep file at ``path``, of an ``example``."""
    from studies.sweeps.sweep_file import read_sweep

    return read_sweep(path)


def costs(path: Path, example: Example) -> Any:
    """Read a file of costs at ``path``, of an ``example``."""
    from studies.missing_effect.plan.costs import read_costs

    return read_costs(path)


def sensors(path: Path, example: Example) -> Any:
    """Read a file of sensors at ``path``, of an ``example``."""
    from studies.synthetic_sensors.sensor_file import read_sensors

    return read_sensors(path)


def rider(path: Path, example: Example) -> Any:
    """Read a rider at ``path``, of an ``example``."""
    from bicycle.rider.measurements import read_rider

    return read_rider(path)


def seat(path: Path, example: Example) -> Any:
    """Read the geometry of a seat at ``path``, of an ``example``."""
    from bicycle.rider.geometry_file import read_geometry

    return [read_geometry(path, posture) for posture in ("upright", "drops")]


def rig(path: Path, example: Example) -> Any:
    """Read a recording of a rig at ``path``, of an ``example``."""
    from tyre.recordings.preflight import preflight
    from tyre.recordings.read import read_recording

    found = read_recording(path)
    return found, preflight(found).problems


def fitted(path: Path, example: Example) -> Any:
    """Read a recording of a rig, and fit it at ``path``, of an ``example``."""
    from tyre.campaigns.recording import fit_recording
    from tyre.campaigns.summary import FitSettings

    return fit_recording(path, name=path.name, settings=FitSettings())


def history(path: Path, example: Example) -> Any:
    """Read a ride at ``path``, of an ``example``."""
    from bicycle.identification.recording import read_events

    return read_events(path, SPEED)


def input_of(path: Path, example: Example) -> Any:
    """Read the history of an input at ``path``, of an ``example``."""
    from studies.animation.simulation_options import read_history

    return read_history(path, "steer_torque", "N m")


def record(path: Path, example: Example) -> Any:
    """Read a recording by a channel map at ``path``, of an ``example``."""
    from tyre.channels.channel_map import ChannelMap
    from tyre.channels.record import read_records

    names = recordings.mapped_names(example.name)
    channels: dict[str, Any] = {
        "slip_angle": {"column": names["slip"], "unit": "deg"}, "side_force": {"column": names["force"], "unit": "N"}
    }  # fmt: skip
    if "timed" not in example.name:
        channels["time"] = {"column": names["t"], "unit": "s"}
    channel_map = ChannelMap.from_table({"channels": channels}, Path(), where="map")
    return [record.time for record in read_records(path, channel_map, {"slip_angle": "angle", "side_force": "force"})]


def look(path: Path, example: Example) -> Any:
    """Read a recording as look does at ``path``, of an ``example``."""
    from studies.look.look import look

    return look(path).as_json()


def address(path: Path, example: Example) -> Any:
    """Read an address of the page at ``path``, of an ``example``."""
    from studies.explorer.models import build
    from studies.explorer.state import parse_state

    state = parse_state(path.read_bytes().decode("utf-8", "replace"))
    model = build(state)
    parse_state(state.address)
    return state, _dynamics(model)


def dropped(path: Path, example: Example) -> Any:
    """Read a file dropped on the page at ``path``, of an ``example``."""
    from studies.explorer.loaded import with_file
    from studies.explorer.models import build
    from studies.explorer.state import State

    state, _ = with_file(State(), path.name, path.read_bytes())
    return state, _dynamics(build(state))


def result(path: Path, example: Example) -> Any:
    """Read the result of a sweep at ``path``, of an ``example``."""
    from studies.sweep_pictures.stored import read_result

    found = read_result(path)
    return found.cell_names, [found.rows(str(name)) for name in found.data]
