"""The main study of ``velotyre run``: how tyre and pressure change the wobble of a bicycle."""

from tyre.ground.door import room

PLACES = {
    "settings": (
        "ASSUMED", "LIMITS", "Arms", "Front", "Ranges", "Settings", "Setup", "assumed_front", "plain_name",
        "read_pressures", "settings_of",
    ),
    "cases": ("CONTACT", "Cases", "TyreCase", "given_case", "tyre_cases"),
    "result": (
        "Band", "LeastDamped", "Result", "Span", "UncertainCriticalSpeed", "effect_tables", "draws", "follow",
        "least_damped_wobble", "model", "nearest_root", "solve", "uncertainty", "unstable_bands",
        "wobble_edges", "wobble_span",
    ),
    "compare": (
        "CRITICAL", "DAMPING", "Amplitude", "Change", "Check", "End", "Hinge", "contact_models",
        "decompose", "hinges", "named_speeds",

    ),
    "samples": ("Samples", "front_draws", "front_values", "sample_bicycles"),
    "study": ("Study", "pressure_ends", "run_study", "spread"),
    "published": ("Comparison", "Finding", "compare_findings", "findings"),
    "grades": ("GRADE_RULES", "Grade", "GradedAnswer", "Split", "grade_samples"),
    "screen": ("CaseComparison", "answer", "grade", "record", "rule_record", "unmeasured", "wobble_length"),
    "report": (
        "first_screen", "like", "never_stable", "on_a_terminal", "round_change", "rule_of_grades", "run_and_write",
        "span_of", "with_sign", "write_report",
    ),
    "tidy_tables": ("tables", "write_tables"),
    "figures": ("draw_amplitude", "draw_causes", "draw_critical_speeds", "draw_damping", "draw_headline"),
}  # fmt: skip

__getattr__, __dir__ = room(__name__, PLACES)
