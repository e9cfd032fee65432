"""Look at a recording: what it holds, what each command would make of it, and what is lacking."""

from importlib import import_module
from typing import Any

HOME = {
    "draft_files": ("Draft", "drafts", "stems", "steps", "write_drafts"),
    "overview": ("Look", "draw", "look", "tell"),
    "rig_uses": ("USES", "Event", "Use"),
}
"""Module -> the names that it gives to other rooms; each is imported when it is first used."""


def __getattr__(name: str) -> Any:
    for home, names in HOME.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{home}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
