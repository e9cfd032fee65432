"""How the result of a bench test is entered afterwards, and what the diagnosis makes of each entry."""

from bicycle.effect import registry
from studies.inference.forward import Forward
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.reporting.words import listed, unit_of

AT_THE_BAR = ("steer_spring", "steer_damper", "bar_bag", "crown_radius", "luggage")  # what kind = "bench" shows


def how_to_enter(forward: Forward, key: str) -> str:
    """What to write into the measurement file after a bench test, and what that gives.

    A size in ``[candidates.EFFECT]`` is no such entry: it says how large the effect is if it is there, so that the
    verdict may stay as open as it was.

    Parameters
    ----------
    forward : Forward
        Of the measurement that is planned for.
    key : str
        Of the test in the file of costs: an effect, ``effect.parameter`` or a parameter of the base model.

    Returns
    -------
    str
        Empty where nothing in the measurement is called so.
    """
    for c in forward.candidates:
        for u in c.unknowns:
            if u.size and c.effect is not None and key in (c.identifier, f"{c.identifier}.{u.name}"):
                return _of_effect(c, u)
    known = any(key == u.name or key in u.sets for u in forward.nuisances)
    return f"{key}: enter its value where it stands now, with [uncertainty] {key} = SD." if known else ""


def _of_effect(candidate: Candidate, unknown: UncertainParameter) -> str:
    name, size = candidate.identifier, unknown.name
    needed = [p.name for p in registry()[name].parameters if p.default is None and p.name != size]
    beside = f" (and {listed(needed)}, which it needs)" if needed else ""
    told = (
        f"{name}: enter it as [effects.{name}] {size} = VALUE{beside} with [uncertainty] {name}.{size} = SD"
        f"{_in(unknown)}: it belongs to the base model then, and the verdict is about what is missing beside it (none, "
        "where nothing is). "
        f"Where the test finds none of it: --without {name}."
    )
    if name in AT_THE_BAR:
        told += (
            ' Torques at the bar of the standing bicycle can be a [[part]] of kind = "bench" in a joint measurement '
            "instead: there it is fitted and can be named."
        )
    return (
        f"{told} Not as [candidates.{name}]: that is its size if it is there, no proof that it is, and may leave the "
        "question open."
    )


def _in(unknown: UncertainParameter) -> str:
    return f" (both in{unit_of(unknown.unit)})" if unit_of(unknown.unit) else ""
