"""The hinge of published figures on a bicycle: tables of a model file, and what the screen shows."""

from collections.abc import Mapping
from typing import Any

from bicycle.effects.effect_registry import effect_class
from bicycle.files.bicycle_numbers import covariance_table
from bicycle.parameters.bicycle import Bicycle
from bicycle.parameters.front_hinge import critical_damping, front_inertia
from studies.front_frame.published import EFFECT, UNCERTAIN, FrontHinge, PublishedFigures, read_map
from studies.main_study.settings import ASSUMED
from studies.reporting.markdown_text import render_file


def hinge_record(hinge: FrontHinge, figures: PublishedFigures, bicycle: Bicycle | None) -> dict[str, Any]:
    """What the command writes as JSON: SI, units in the names of the figures."""
    record: dict[str, Any] = {
        "figures": {name: value for name, value in vars(figures).items() if value is not None},
        "stiffness": hinge.stiffness,
        "stiffness_interval": list(hinge.stiffness_interval),
        "stiffness_sd": hinge.stiffness * hinge.relative_sd,
        "height_above_hub": hinge.height,
        "height_interval": list(hinge.height_interval),
        "height_sd": hinge.height_sd,
        "correlation": hinge.correlation,
        "damping": None,
        "sway": None,
        "notes": list(hinge.notes),
    }
    if bicycle is None:
        return record
    tables = {"effects": {EFFECT: hinge.effect_numbers(bicycle)}}
    return record | {"bicycle": bicycle.name} | tables | covariance_table(hinge.effect_covariance(bicycle))


def hinge_text(hinge: FrontHinge, figures: PublishedFigures, bicycle: Bicycle | None) -> str:
    """Sentences about a ``hinge`` for the screen."""
    content: dict[str, Any] = {
        "hinge": hinge,
        "figures": figures,
        "bicycle": bicycle,
        "map": read_map(),
        "ratio": ASSUMED["damping_ratio"],
    }
    if bicycle is not None:
        content["numbers"] = hinge.effect_numbers(bicycle)
        low, high = content["map"].wheel_radius_m
        content["wheel_outside"] = not low <= bicycle["rF"] <= high
    return render_file("studies.front_frame", "front_frame.txt.j2", content, escaped=False).strip()


def default_damping(bicycle: Bicycle, hinge: Mapping[str, float]) -> dict[str, float]:
    """Damping (N m s/rad) that a model takes where its file states none, and its share of critical damping.

    ``hinge`` holds the other numbers (SI) of the effect, such as ``joint_x``.
    """
    values = effect_class(EFFECT)(**hinge).values(bicycle.values)
    number = {key.removeprefix(f"{EFFECT}."): value for key, value in values.items()}
    place = {name: number[name] for name in ("joint_x", "joint_z", "axis_tilt")}
    critical = critical_damping(number["stiffness"], front_inertia(bicycle.values, **place))
    return {"damping": number["damping"], "share": float(number["damping"] / critical)}


def hinge_tables(hinge: FrontHinge, figures: PublishedFigures, bicycle: Bicycle) -> str:
    """Tables of a model file for a ``hinge``: the effect with its comments, and its covariance."""
    content: dict[str, Any] = {
        "hinge": hinge,
        "figures": figures,
        "numbers": hinge.effect_numbers(bicycle),
        "ratio": ASSUMED["damping_ratio"],
        "default": default_damping(bicycle, hinge.effect_numbers(bicycle)),
        "names": UNCERTAIN,
        "rows": hinge.effect_factor(bicycle).tolist(),
    }
    return render_file("studies.front_frame", "tables.toml.j2", content, escaped=False).strip()


def model_text(hinge: FrontHinge, figures: PublishedFigures, bicycle: Bicycle, place: Mapping[str, str]) -> str:
    """Text of a model file: a bicycle whose wheels roll without slip, with the hinge.

    ``place`` holds how the file names its ``bicycle``, and its own name, ``file``.
    """
    content = {**place, "name": bicycle.name, "tables": hinge_tables(hinge, figures, bicycle)}
    return render_file("studies.front_frame", "model.toml.j2", content, escaped=False).rstrip() + "\n"
