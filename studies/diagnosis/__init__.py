"""Find where simulation and measurement disagree, name the missing effect, add it, show the discrepancy shrink."""

from studies.diagnosis.corrected_model import Corrected, corrected, corrected_model, model_text
from studies.diagnosis.diagnose import Diagnosis, diagnose
from studies.diagnosis.doubts import doubts
from studies.diagnosis.joint import JointData  # registers its kind
from studies.diagnosis.measurement_file import read_measurement
from tyre.ground.door import door

FILES = {
    "bench": ("Bench",), "bicycle_kind": ("BicycleKind",), "candidates": ("find_candidates", "nuisances"),
    "family": ("Family",),
    "figures": ("BEFORE_AFTER", "draw_before_after", "draw_traces", "residuals"),
    "findings": ("Findings", "Predicted", "coordinates_of", "find", "leading_two", "predict", "with_stability"),
    "frequency_response": ("FrequencyResponses",), "histories": ("Histories",),
    "labels": ("fate", "listed", "misfit", "number", "probability", "said", "sentence", "term_name", "titles"),
    "measurement_file": ("available_measurements", "example_measurement", "packaged_measurement"),
    "mistakes": ("delay_error", "gain_error", "speed_errors"), "modal": ("Modal", "ModalPoint"),
    "report": ("draw_all", "model_files", "named_rows", "page", "record", "terminal", "write_report"),
    "residual": ("PAIRS", "Residual", "Selector", "SpeedScale", "candidate", "fit_residual", "keys", "term_names"),
    "ride_disturbances": ("Disturbances",), "ride_figures": ("draw_density", "label_density"),
    "ride_likelihood": ("SpectralMisfit",),
    "ride_reading": ("spectra_of_rides",), "ride_spectra": ("RideSpectra",),
    "rig_numbers": ("RigNumbers",), "rig_recordings": ("RigRecordings",), "rig_reference": ("Curve", "Reference"),
    "spectra": ("responses_of_runs",), "steer_spline": ("SteerSpline", "torque_jumps"),
    "tyre_tables": ("TyreKind", "TyreTables"), "whitening": ("ChannelNoise",),
}  # fmt: skip
"""Names of the room by the file that holds them; each is imported when it is first used."""

HOMES = {name: f"{__name__}.{file}" for file, names in FILES.items() for name in names}
HOMES["Kind"] = "studies.inference"
__all__ = ["Corrected", "Diagnosis", "JointData", "corrected", "corrected_model", "diagnose", "doubts", "model_text"]
__all__ += ["read_measurement", *HOMES]
__getattr__, __dir__ = door(__name__, HOMES)
