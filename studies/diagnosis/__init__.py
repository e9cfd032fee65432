"""Find where simulation and measurement disagree, name the missing effect, add it, show the gap shrink."""

from studies.diagnosis.bench import Bench
from studies.diagnosis.bicycle_kind import BicycleKind
from studies.diagnosis.candidates import find_candidates, nuisances
from studies.diagnosis.canonical import CanonicalCoefficients
from studies.diagnosis.corrected_model import Corrected, corrected, corrected_model, model_text
from studies.diagnosis.diagnose import Diagnosis, diagnose
from studies.diagnosis.doubts import doubts
from studies.diagnosis.family import Family
from studies.diagnosis.figures import draw_before_after, residuals
from studies.diagnosis.findings import (
    Findings,
    Predicted,
    coordinates_of,
    find,
    leading_two,
    predict,
    with_stability,
)
from studies.diagnosis.frequency_response import FrequencyResponses
from studies.diagnosis.histories import Histories
from studies.diagnosis.joint import JointData
from studies.diagnosis.measurement_file import (
    available_measurements,
    example_measurement,
    packaged_measurement,
    read_measurement,
)
from studies.diagnosis.modal import Modal, ModalPoint
from studies.diagnosis.report import draw_all, model_files, page, record, terminal, write_report
from studies.diagnosis.residual import PAIRS, Residual, Selector, SpeedScale, candidate, fit_residual, keys, term_names
from studies.diagnosis.rig_numbers import RigNumbers
from studies.diagnosis.rig_recordings import RigRecordings
from studies.diagnosis.rig_reference import Curve, Reference
from studies.diagnosis.steer_spline import SteerSpline, torque_jumps
from studies.diagnosis.tyre_tables import TyreKind, TyreTables
from studies.diagnosis.whitening import ChannelNoise
from studies.inference import Kind
from tyre.door import door

__all__ = [
    "PAIRS", "Bench", "BicycleKind", "CanonicalCoefficients", "ChannelNoise", "Corrected", "Curve", "Diagnosis",
    "Family", "Findings", "FrequencyResponses", "Histories", "JointData", "Kind", "Modal", "ModalPoint", "Predicted",
    "Reference", "Residual", "RigNumbers", "RigRecordings", "Selector", "SpeedScale", "SteerSpline", "TyreKind",
    "TyreTables", "available_measurements", "candidate", "coordinates_of", "corrected", "corrected_model", "diagnose",
    "doubts", "draw_all", "draw_before_after", "example_measurement", "find", "find_candidates",
    "fit_residual", "keys", "leading_two", "model_files", "model_text", "nuisances", "packaged_measurement", "page",
    "predict", "read_measurement", "record", "residuals", "term_names", "terminal", "torque_jumps",
    "with_stability", "write_report",
]  # fmt: skip

HOMES = {
    "BEFORE_AFTER": "studies.diagnosis.figures",
    "draw_traces": "studies.diagnosis.figures",
    "fate": "studies.diagnosis.labels",
    "listed": "studies.diagnosis.labels",
    "misfit": "studies.diagnosis.labels",
    "number": "studies.diagnosis.labels",
    "probability": "studies.diagnosis.labels",
    "responses_of_runs": "studies.diagnosis.spectra",
    "said": "studies.diagnosis.labels",
    "term_name": "studies.diagnosis.labels",
    "titles": "studies.diagnosis.labels",
}

__getattr__, __dir__ = door(__name__, HOMES)
