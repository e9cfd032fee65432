"""The smallest change of a model that keeps named modes stable over a range of speed."""

from tyre.ground.door import room

FILES = {
    "design": ("Certainty", "Design", "Wishes", "find_design", "with_effects"),
    "problem": ("BY_SD", "RELATIVE", "Demand", "Problem", "base_of", "cost_of", "demands", "expand_all_modes", "grid",
                "limits_of", "search_cheapest"),
    "report": ("HEADERS", "lines", "model_text", "record", "remarks", "rows"),
}  # fmt: skip
__getattr__, __dir__ = room(__name__, FILES)
