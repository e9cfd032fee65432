"""Made-up tyres for tests: a .tir file of MF-Tyre 6.1 with camber and moments, and Pacejka-89 coefficients."""

from collections.abc import Mapping

UNITS = "[UNITS]\nLENGTH = 'meter'\nFORCE = 'newton'\nANGLE = 'radians'\n"


def tir_text(values: Mapping[str, object], *, head: str = "") -> str:
    """Text of a .tir file in SI units."""
    return head + UNITS + "[MODEL]\n" + "".join(f"{name} = {value!r}\n" for name, value in values.items())


TIR = tir_text({
    "FITTYP": 61, "UNLOADED_RADIUS": 0.336, "WIDTH": 0.028, "NOMPRES": 500000, "FNOMIN": 450, "FZMIN": 200,
    "FZMAX": 800, "PRESMIN": 300000, "PRESMAX": 700000, "LATERAL_STIFFNESS": 60000, "PCFY1": 0.2, "PCFY3": 0.5,
    "LKYC": 0.9, "LTR": 1.1, "LMX": 0.95, "QSX2": 0.04, "PPMX1": 0.1, "PKY1": -17, "PKY2": 1.8, "PKY6": -0.8,
    "PKY7": 0.1, "PPY1": 0.2, "PPY2": 0.5, "PPY5": -0.3, "QDZ1": 0.05, "QDZ2": 0.01, "QDZ8": -0.045, "QDZ9": -0.004,
    "PPZ1": 0.2, "PPZ2": -0.1,
}, head="! : TYRE : Made-up 28\n! : SURFACE : flat\n! synthetic: for tests, no rig measured it\n")  # fmt: skip

PACEJKA89 = """kind = "pacejka89"
tyre = "Made-up 89"
surface = "flat"
load_max_N = 1000
source = "made up for tests"
licence = "none"
note = "synthetic: no rig measured it"
[[set]]
label = "soft"
pressure_kPa = 300
lateral_stiffness_N_per_mm = 45
lateral_force = [1.3, -50.0, 1050.0, 120.0, 0.6, 0.0, 0.0, -1.0, 0.04, 0.1, -0.05, 3.0, 10.0, 2.0]
aligning_moment = [2.2, 0.5, 9.0, 0.4, -4.2, 0.1, 0.0, 0.0, 0.0, -1.0, 0.0, 0.06, 0.1, -0.08, 0.1, 0.2, 0.1, 0.0]
[[set]]
label = "hard"
pressure_kPa = 500
lateral_stiffness_N_per_mm = 70
lateral_force = [1.3, -50.0, 1000.0, 110.0, 0.7, 0.0, 0.0, -1.0, 0.05, 0.0, 0.0, 2.0, 0.0, 0.0]
aligning_moment = [2.2, 0.0, 10.0, 0.0, -4.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.05, 0.0, 0.0, 0.0, 0.3, 0.0, 0.0]
"""

MODEL = """bicycle = "benchmark"
[effects.relaxation_length]
tyre = "{tyre}"
pressure_bar = {pressure}
[effects.camber_thrust]
camber_stiffness = "tyre"
[effects.pneumatic_trail]
trail = "tyre"
[effects.twisting_torque]
twisting_stiffness = "tyre"
"""
"""A model file that takes all it can from its tyre."""
