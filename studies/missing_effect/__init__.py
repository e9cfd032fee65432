"""Find where simulation and measurement disagree, name the missing effect, add it, show the gap shrink."""

from studies.inference.verdict import Verdict
from studies.missing_effect.diagnose import Diagnosis, diagnose
from studies.missing_effect.interface import Measurement
from studies.missing_effect.measurement import read_measurement

__all__ = ["Diagnosis", "Measurement", "Verdict", "diagnose", "read_measurement"]
