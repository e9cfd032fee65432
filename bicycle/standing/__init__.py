"""A bicycle that stands still: what is read on its front frame, and the joints that explain it.

Every name is imported when it is first used.
"""

from tyre.ground.door import room

HOME = {  # module -> the names that it gives to other rooms
    "front_fit": (
        "ASSUMED_HEIGHT", "FORK", "FORK_LENGTH", "FRONT", "HEIGHT", "NOT_HELD", "ONE_HINGE", "RIDER_YAWS", "SADDLE",
        "SADDLE_RATIO", "SADDLE_STIFFNESS", "STIFFNESS", "TIME", "TWO_JOINTS", "FrontFit", "fit_front",
    ),
    "front_result": ("CERTAIN_MOTION", "FrontResult", "Outcome", "frame_motion", "measure_front", "require_rider"),
    "hands": (
        "DRY", "HANDS", "HANDS_TABLE", "SPRING_SD", "Hands", "RingDown", "measure_hands", "predict_ring_downs",
        "read_ring_downs", "select_grip", "spring_error",
    ),
    "prediction": ("SERIES", "SUPPORT", "TYRE", "TYRE_DAMPING", "Prediction", "at_rim"),
    "readings": ("Deflection", "Errors", "Place", "Ratio", "Readings", "Tap"),
    "standing_table": ("HOLDS", "SEATED", "TABLE", "Standing", "read_standing"),
    "tap_recordings": ("TapRecording", "identify_taps", "read_tap"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, HOME)
