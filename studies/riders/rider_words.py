"""What is said of a rider on a bicycle: description, source, notes, and the file with its provenance."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from bicycle.files.bicycle_file import to_toml
from bicycle.parameters import Bicycle
from bicycle.rider.human import yeadon_version
from bicycle.rider.posture import POSTURES
from bicycle.rider.rider_frame import KEYS, RiderOnBicycle
from bicycle.rider.seat_geometry import LEG_SHARE

LEAST_SHARE = 0.05  # of the variance; smaller causes are not named
UNITS = ("m", "m", "kg", "kg m^2", "kg m^2", "kg m^2", "kg m^2")


def with_provenance(found: RiderOnBicycle, name: str) -> Bicycle:
    """The bicycle with rider as a parameter set called ``name`` that says what it is and where it comes from.

    The rear frame is rounded to seven digits and its sd to three, so that a file can be made again to its last digit.
    """
    made = found.bicycle(name, _description(found), _source(found))
    values = {k: _rounded(v, 7) if k in KEYS else v for k, v in made.values.items()}
    sd = {k: _rounded(v, 3) if k in KEYS else v for k, v in made.sd.items()}
    return Bicycle(name, values, sd, made.description, made.source, made.notes)


def file_text(found: RiderOnBicycle, bicycle: Bicycle, command: str) -> str:
    """Text of the bicycle's file, with joint angles and the largest causes of uncertainty as comments.

    ``command`` is the command line that made it.
    """
    said = [f"made by: {command}", *notes(found), "the sds are stated one by one; their correlations are left out"]
    said += [f"{key}: sd mainly from {cause}" for key, cause in main_causes(found)]
    angles = {k: v for k, v in found.seated.configuration.items() if v and k[:2] not in ("CB", "B1", "PK", "K1")}
    said.append("joint angles, deg (left side): " + ", ".join(f"{k} {math.degrees(v):.2f}" for k, v in angles.items()))
    said.append("seat: " + ", ".join(f"{k} {v:.4g}" for k, v in found.geometry.values.items()))
    return "".join(f"# {line}\n" for line in said) + "\n" + to_toml(bicycle)


def notes(found: RiderOnBicycle) -> list[str]:
    """What is assumed or odd, one sentence each."""
    said = [f"rider {found.rider.name} {note}" for note in found.rider.notes]
    assumed = [key.rpartition("_")[0].replace("_", " ") for key in found.geometry.assumed]
    if assumed:
        said.append(f"assumed, not measured on this bicycle: {', '.join(assumed)}")
    if "saddle_distance_m" in found.geometry.assumed:
        said.append(f"saddle height: {LEG_SHARE} of the length from hip to heel, as on three measured bicycles")
    if "reach_m" in found.geometry.assumed:
        said.append(f"bar where the arms end in this posture ({POSTURES[found.posture].told(found.angles.torso_lean)})")
    return said + [f"odd: {remark}" for remark in found.seated.remarks]


def main_causes(found: RiderOnBicycle) -> list[tuple[str, str]]:
    """For every key the two largest independent causes and their share of its variance."""
    rows = []
    for column, key in enumerate(KEYS):
        if key not in found.values:
            continue
        variance = {cause: float(step[column] ** 2) for cause, step in found.causes.items()}
        total = sum(variance.values())
        largest = sorted(variance, key=lambda cause: -variance[cause])[:2]
        named = [cause for cause in largest if variance[cause] >= LEAST_SHARE * total]
        rows.append((key, ", ".join(f"{cause} {100 * variance[cause] / total:.0f} %" for cause in named)))
    return rows


def table(found: RiderOnBicycle) -> list[list[Any]]:
    """Rows of key, unit, frame alone, rider alone, both, sd, main causes."""
    whole, sd, causes = found.values, found.sd, dict(main_causes(found))
    inertia, centre = found.body.inertia, found.body.centre
    rider = dict(zip(KEYS, (centre[0], centre[2], found.body.mass, *inertia[(0, 1, 2), (0, 1, 2)], inertia[0, 2]),
                     strict=True))  # fmt: skip
    return [
        [key, unit, found.frame.values.get(key), float(rider[key]), whole[key], sd[key], causes[key]]
        for key, unit in zip(KEYS, UNITS, strict=True)
        if key in whole
    ]


def loads(found: RiderOnBicycle, bicycle: Bicycle) -> list[tuple[str, float, float]]:
    """Wheel, static load and its sd (N) from the causes of mass and mass centre."""
    mass, x = found.values["mB"], found.values["xB"]
    steps = np.array(list(found.causes.values()))
    moment = mass * steps[:, 0] + x * steps[:, 2]
    front = bicycle["g"] * moment / bicycle["w"]
    rear = bicycle["g"] * steps[:, 2] - front
    values = bicycle.static_loads
    return [("rear", values[0], float(np.hypot.reduce(rear))), ("front", values[1], float(np.hypot.reduce(front)))]


def _description(found: RiderOnBicycle) -> str:
    lean = math.degrees(found.angles.torso_lean)
    return (
        f"DERIVED: {found.frame.name} with rider {found.rider.name} ({found.body.mass:.4g} kg), {found.posture}: torso "
        f"{lean:.0f} deg forward of the vertical; rear frame and rider joined as one rigid body"
    )


def _source(found: RiderOnBicycle) -> str:
    assumed = f"; assumed: {', '.join(found.geometry.assumed)}" if found.geometry.assumed else ""
    more = [f"{n.replace('_', ' ')} {math.degrees(v):g} deg" for n, v in found.angles._asdict().items() if v]
    return (
        f"derived: bicycle {found.frame.name} ({found.frame.source or 'a file'}); rider {found.rider.name}, "
        f"{found.rider.source}; body model yeadon {yeadon_version()} (Yeadon 1990), segments turned and joined by "
        f"velotyre; {', '.join(more)}; seat and bar: {found.geometry.source or 'fit rule'}{assumed}"
    )


def _rounded(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")


def headers() -> Sequence[str]:
    """Of :func:`table`."""
    return ("", "unit", "frame", "rider", "both", "sd", "sd mainly from")
