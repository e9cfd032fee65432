"""Identification of recorded motion: modes of free decays, frequency responses, canonical coefficients.

Every name is imported when it is first used: a recording is read without what fits it.
"""

from importlib import import_module
from typing import Any

HOME = {
    "canonical": ("Canonical",),
    "decay_noise": ("AMPLITUDE", "DRIFTS", "KINDS", "REAL", "Evidence", "basis", "noise_floor", "window"),
    "decay_posterior": ("POINTS", "WIDER", "interval", "log_odds_of_any", "log_odds_of_each", "proposal"),
    "free_decay": (
        "MOST_DOUBT", "MOST_MODES", "PARTS", "POOREST", "REACH", "TOO_FAR", "Break", "Decay", "Movement", "identify",
        "identify_modes", "probability_of_noise", "unforeseen",
    ),
    "frequency_response": ("SpectralResponse", "line_response", "lines_of", "spectral_response", "weights"),
    "recording": (
        "CHANNELS", "INPUTS", "STEER", "STEER_TORQUE", "Run", "read_events", "read_forced", "read_run", "read_runs",
    ),
    "scatter": ("OWN_LINE", "Repeats", "about_one_speed", "repeats", "surprise"),
}  # fmt: skip
"""Module -> the names that it gives to other rooms."""


def __getattr__(name: str) -> Any:
    for home, names in HOME.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
