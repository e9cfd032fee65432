"""Public names that changed before 1.0: an old one is refused with the new one, and never read as it was."""

import re
from collections.abc import Collection

RENAMED = {
    # (a name can have two successors: which one is meant is what is allowed where it was written)
    "side_force": ("lateral_force",),
    "lateral_force": ("lateral_push",),
    "pull_test": ("lateral_stiffness",),
    "fit_pull_test": ("fit_lateral_stiffness",),
    "PullTest": ("LateralStiffnessTest",),
    "PullTestFit": ("LateralStiffnessFit",),
    "residual_torque": ("unmodelled_torque",),
    "ResidualTorque": ("UnmodelledTorque",),
    "bar_bag": ("handlebar_bag",),
    "BarBag": ("HandlebarBag",),
    "least_damping_ratio": ("min_damping_ratio",),
    "smallest_damping_ratio": ("min_damping_ratio",),
    "largest_growth_rate": ("max_growth_rate",),
    "ride": ("closed-loop",),
    "--kick": ("--impulse",),
    "--friction": ("--peak-factor",),
}
"""Old name, or part of one between underscores or dots -> the names that took its place."""

_OLD = "|".join(map(re.escape, sorted(RENAMED, key=len, reverse=True)))
_PARTS = re.compile(rf"(?<![A-Za-z])({_OLD})(?![A-Za-z])")


def new_name(name: object, allowed: Collection[str]) -> str:
    """Find the ``allowed`` name that took the place of an old ``name``, with its wheel, unit or parameter; else ''."""
    match = _PARTS.search(str(name))
    if match is None:
        return ""
    candidates = [str(name).replace(match[0], successor) for successor in RENAMED[match[0]]]
    return next((candidate for candidate in candidates if candidate in allowed), "")


def now_called(name: str, allowed: Collection[str]) -> str:
    """End a message about an old ``name`` with its new one; empty for any other name."""
    current = new_name(name, allowed)
    return f"; it is now called {current!r}" if current else ""
