"""Identification of recorded motion: modes of free decays, frequency responses.

Every name is imported when it is first used: a recording is read without what fits it.
"""

from tyre.ground.door import room

HOME = {  # module -> the names that it gives to other rooms
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
    "ride_recording": ("LeftOut", "Ride", "read_ride", "segment_rows"),
    "ride_wobble": ("Wobble", "identify_wobble"),
    "scatter": ("OWN_LINE", "Repeats", "about_one_speed", "repeats", "surprise"),
    "tapered_spectra": ("RideSpectrum", "bands_between", "narrowest_band", "ride_spectrum"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, HOME)
