"""Serve the page on which parameters are moved and modes watched: ``velotyre explore``."""

from tyre.ground.door import room

HOME = {  # module -> the names that it gives to other rooms; each is imported when it is first used
    "chart": ("BAND_NAME", "bands", "note_hidden_bands"),
    "exports": ("as_command", "as_python", "eigenvalues_csv", "model_toml", "saved_page"),
    "figures": (
        "DARK", "LIGHT", "amplitude_figure", "colour_on", "damping_figure", "figure_or_words", "halving",
        "modes_figure", "sensitivity_figure", "slow_hertz",
    ),
    "forms": ("controls", "controls_html", "law_options", "starts"),
    "models": (
        "AtSpeed", "amplitudes", "at_speed", "bicycle_or_none", "build", "compute_modes", "model_content", "ranking",
        "words_beside",
    ),
    "geometry": ("SLIDERS", "Misfit", "move_bicycle", "side_view", "slider_fields"),
    "motion": ("FRAMES", "mode_motion"),
    "server": ("CLOSE", "HOST", "build_server", "open_socket", "serve"),
    "state": ("State", "parse_state"),
    "tyre_files": ("MOST_TYRES", "TYRES", "kept_here", "shown_name"),
    "uploads": ("start_state", "with_file", "with_files"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, HOME)
