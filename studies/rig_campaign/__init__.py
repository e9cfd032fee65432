"""A fitted campaign as report, figures and files, from recordings in any format."""

from importlib import import_module
from typing import Any

PLACES = {
    "figures": ("save_figures", "stiffness_over_load"),
    "report": ("campaign_table", "report_text", "write_campaign"),
}


def __getattr__(name: str) -> Any:
    for module, names in PLACES.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
