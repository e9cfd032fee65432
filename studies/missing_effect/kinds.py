"""The kinds of measurement of a bicycle: the table that each is read from, and how."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bicycle.identification.histories_table import read_runs
from bicycle.identification.recording import INPUTS, MOTOR_IN_TORQUE, STEER_TORQUE
from bicycle.model import Model
from studies.missing_effect.bench.measurement import read_bench_measurement
from studies.missing_effect.forced.measurement import read_frequency_response
from studies.missing_effect.motion.canonical_table import read_canonical
from studies.missing_effect.motion.measurements import (
    BicycleMeasurement,
    CanonicalMeasurement,
    HistoryMeasurement,
    ModalMeasurement,
    TyreMeasurement,
)
from studies.missing_effect.motion.modal_table import read_modal
from studies.missing_effect.motion.mode_labels import misnamed
from studies.missing_effect.motion.tyre_part import read_tyre_part, refuse_own_trail

Content = Mapping[str, Any]
Reader = Callable[[Content, Path, Content], BicycleMeasurement]
"""From the table of a kind, the folder of the file, and what all kinds share, to the measurement."""


def _modal(content: Content, folder: Path, common: Content) -> ModalMeasurement:
    uncertainty = dict(common["uncertainty"])
    points, notes = read_modal(content, folder, common["model"], uncertainty)
    uncertainty |= {key: 0.0 for key, _ in points[0].settings}
    notes += misnamed(points, common["model"])
    return ModalMeasurement(**{**common, "uncertainty": uncertainty}, points=points, notes=notes)


def _canonical(content: Content, folder: Path, common: Content) -> CanonicalMeasurement:
    coefficients, notes = read_canonical(content, folder)
    return CanonicalMeasurement(**common, coefficients=coefficients, notes=notes)


def _histories(content: Content, folder: Path, common: Content) -> HistoryMeasurement:
    runs, noise, notes = read_runs(content, folder)
    if any(STEER_TORQUE in {**run.inputs, **run.channels} for run in runs):
        common, said = _without_motors(content, common)
        notes += said
    return HistoryMeasurement(**common, runs=runs, noise_sd=noise, notes=notes)


def _replay(content: Content, folder: Path, common: Content) -> HistoryMeasurement:
    return _histories({"input": STEER_TORQUE, **content}, folder, common)


def _frequency_response(content: Content, folder: Path, common: Content) -> BicycleMeasurement:
    found = read_frequency_response(content, folder, common)
    if all(point.input != INPUTS[STEER_TORQUE] for point in found.points):
        return found
    kept, said = _without_motors(content, common)
    return replace(found, model=kept["model"], uncertainty=kept["uncertainty"], notes=(*found.notes, *said))


def _rig(content: Content, folder: Path, common: Content) -> TyreMeasurement:
    numbers, notes = read_tyre_part(content, folder, common["model"].bicycle)
    refuse_own_trail(common["model"], numbers)
    return TyreMeasurement(**common, numbers=numbers, notes=notes)


READERS: Mapping[str, Reader] = {
    "modal": _modal, "histories": _histories, "replay": _replay, "canonical": _canonical,
    "frequency_response": _frequency_response, "bench": read_bench_measurement, "rig": _rig,
}  # fmt: skip
"""How each kind is read, of a bicycle or, as a part, of its tyre."""

TABLES = {kind: "histories" if kind == "replay" else kind for kind in READERS}
"""The table that each kind is read from."""

KINDS = tuple(kind for kind in READERS if kind != "rig")
"""Those of a bicycle; ``rig`` is a kind of a part only."""


def _without_motors(content: Content, common: Content) -> tuple[Content, tuple[str, ...]]:
    """The base model without motors, whose torque is in the record unless the table says otherwise; a note of it."""
    model = common["model"]
    given = {thing for effect in model.effects if effect.powered for thing in effect.provides}
    motors = [e.identifier for e in model.effects if e.powered or given.intersection(e.requires)]
    if not motors:
        return common, ()
    if not content.get(MOTOR_IN_TORQUE, True):
        said = f"{', '.join(motors)}: acts beside the recorded steer torque ({MOTOR_IN_TORQUE} = false)"
        return common, (said,)
    kept = Model(model.bicycle, tuple(effect for effect in model.effects if effect.identifier not in motors))
    uncertainty = {key: sd for key, sd in common["uncertainty"].items() if key.split(".")[0] not in motors}
    note = (
        f"{', '.join(motors)}: left out of the base model, for the recorded steer torque is taken to hold what it "
        f"gives; write {MOTOR_IN_TORQUE} = false where it does not, as in what `velotyre simulate` writes"
    )
    return {**common, "model": kept, "uncertainty": uncertainty}, (note,)
