"""Sweeps: many bicycles, tyres and speeds at once, on this machine or a cluster, and figures of the results."""

from tyre.ground.door import room

FILES = {  # names of the room by the file that holds them; each is imported when it is first used
    "draw": ("draw_result", "figures_folder"),
    "engines": (
        "Engine", "Piece", "in_loop", "in_processes", "in_threads", "on_cluster", "on_this_machine", "usual_items",
    ),
    "file": ("build_sweep", "read_sweep"),
    "parts": ("Parts", "open_parts", "pieces"),
    "result": ("impossible_draws",),
    "run": ("run_sweep",),
    "sampler": ("TYRE_DRAWS", "Points", "Sampler", "stiffness_warnings"),
    "specification": ("ImpossibleItem", "Normal", "Sweep"),
    "stored": ("Stored", "read_result"),
    "variance_shares": ("find_correlated", "shares", "stated_correlations"),
    "varied": ("Varied", "sampled_parameters"),
    "worker": ("Worker", "compute"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, FILES)
