"""Find where simulation and measurement disagree, name the missing effect, add it, show the gap shrink."""

from studies.missing_effect.diagnose import Diagnosis, diagnose
from studies.missing_effect.measurement import Measurement, read_measurement
from studies.missing_effect.verdict import Verdict

__all__ = ["Diagnosis", "Measurement", "Verdict", "diagnose", "read_measurement"]
