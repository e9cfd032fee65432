"""The riders of a study: a person put on a frame, and the same person in other postures."""

from pathlib import Path

from bicycle.files.bicycle_file import available_bicycles, load_bicycle
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError

DEFAULT_POSTURE = "drops"


def with_rider(frame: str, rider: str, posture: str | None) -> tuple[Bicycle, tuple[Bicycle, ...]]:
    """A bicycle with a rider, and the same rider in every posture that can be reached.

    Parameters
    ----------
    frame, rider : str
        Packaged names, or files.
    posture : str or None
        Of the first; None for ``DEFAULT_POSTURE``.

    Raises
    ------
    InputError
        The frame carries a rider already, the rider does not reach, or ``yeadon`` is not installed.
    """
    from bicycle.rider.geometry_file import packaged_geometry, read_geometry
    from bicycle.rider.measurements import read_rider
    from bicycle.rider.posture import POSTURES
    from bicycle.rider.rider_frame import rider_on_bicycle
    from bicycle.rider.seat_geometry import SeatGeometry
    from studies.riders.rider_words import with_provenance

    person, bare, known = read_rider(rider), load_bicycle(frame), packaged_geometry(frame)
    name = f"{bare.name}_{Path(rider).stem}"

    def seated(how: str) -> Bicycle:
        geometry = read_geometry(known, how) if known else SeatGeometry()
        return with_provenance(rider_on_bicycle(bare, person, posture=how, geometry=geometry), f"{name}_{how}")

    chosen = seated(posture or DEFAULT_POSTURE)
    others = []
    for how in POSTURES:
        try:
            others.append(chosen if chosen.name.endswith(f"_{how}") else seated(how))
        except InputError:  # out of reach in this posture
            continue
    return chosen, tuple(others)


def packaged_postures(bicycle: Bicycle) -> tuple[Bicycle, ...]:
    """The packaged bicycles that differ from a packaged one by the rider's posture; none without such a family."""
    from bicycle.rider.posture import POSTURES

    stem, _, how = bicycle.name.rpartition("_")
    family = [f"{stem}_{one}" for one in POSTURES]
    if how not in POSTURES or not set(family) <= set(available_bicycles()):
        return ()
    if load_bicycle(bicycle.name).values != bicycle.values:
        return ()  # a file of the user with the same name
    return tuple(load_bicycle(one) for one in family)
