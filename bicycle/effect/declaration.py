"""Whether an effect from outside the package declares what the house needs, said in one line where it does not."""

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from bicycle.derivation.declarations import BASE_MODES, Mode
from bicycle.effect.files import GUIDE, Origin
from bicycle.effect.parameter import Parameter
from bicycle.parameters import UNITS
from tyre.base.errors import InputError, is_number, shown
from tyre.base.unit_words import is_si

NAME = re.compile("[a-z][a-z0-9_]*")


def check_declaration(effect: Any, known: Mapping[str, Any], where: str) -> None:
    """Refuse an effect whose declaration is wrong or incomplete, or that takes the place of another.

    Parameters
    ----------
    effect : subclass of bicycle.effect.Effect
    known : mapping of str to type
        The effects that there are, by identifier.
    where : str
        What the message calls the place of the effect, such as its file.

    Raises
    ------
    InputError
        Naming the place, the effect, what is wrong and what is allowed.
    """
    name = effect.identifier
    if name in known:
        there = Origin.of(known[name])
        raise InputError(
            f"{where}: the effect {name!r} exists already ({there.file or there.module}); give the class another "
            "identifier, or its file another name"
        )
    wrong = next(_mistakes(effect, known), None)
    if wrong:
        raise InputError(f"{where}: effect {name!r}: {wrong}; {GUIDE}")


def _mistakes(effect: Any, known: Mapping[str, Any]) -> Iterator[str]:
    if not NAME.fullmatch(effect.identifier):
        yield 'its identifier has other than small letters, digits and underscores; write identifier = "a_name"'
    if effect.apply.__qualname__ == "Effect.apply":
        yield "it has no method apply(self, model), which adds it to the equations"
    said = {
        "a docstring": effect.description, "source (where its equation is from)": effect.source,
        "signature (what one sees)": effect.signature,
    }  # fmt: skip
    for what, text in said.items():
        if not isinstance(text, str) or not text.strip():
            yield f"it lacks {what}; a phrase will do"
    provided = {thing for other in (*known.values(), effect) for thing in other.provides}
    for need in sorted(set(effect.requires) - provided):
        yield f"it requires {need!r}, which no effect provides; there are {', '.join(sorted(provided))}"
    if effect.requires and not effect.why:
        yield "it requires something and does not say why = ..."
    for parameter in effect.parameters:
        yield from _wrong_parameter(parameter)
    others = {mode.name: mode for kind in known.values() for mode in kind.modes}
    for mode in effect.modes:
        yield from _wrong_mode(mode, others)


def _wrong_parameter(p: Parameter) -> Iterator[str]:
    if not all(isinstance(text, str) and text.strip() for text in (p.unit, p.description)):
        yield f"{p.name} has no unit or no meaning; write Parameter('N m/rad', 'of the hinge', ...)"
    elif not is_si(p.unit):  # files, sliders and priors take its numbers for SI
        yield (
            f"{p.name}: unit = {shown(p.unit)} is not one of kg, m, s, rad, N, Pa and what they make without a prefix; "
            "write for example N m s/rad, kg m^2 or 1/s, and 1 where there is none"
        )
    low, high = p.bounds
    if not low <= p.typical[0] < p.typical[1] <= high:
        yield f"{p.name}: typical {p.typical[0]:g} .. {p.typical[1]:g} is not within the bounds {low:g} .. {high:g}"
    if isinstance(p.default, str) and p.default not in UNITS:
        yield f"{p.name}: default = {p.default!r} must be a number or a parameter of the bicycle"
    for what, value in (("default", p.default), ("neutral", p.neutral)):
        if value is not None and not isinstance(value, str) and not (is_number(value) and low <= value <= high):
            yield f"{p.name}: {what} = {shown(value)} is outside the bounds {low:g} .. {high:g}"
    yield from _wrong_least(p)


def _wrong_least(p: Parameter) -> Iterator[str]:
    """A least size must leave something of the typical range to be named."""
    if not is_number(p.least) or not 0 <= p.least < math.inf:
        yield f"{p.name}: least = {shown(p.least)} must be a size in {p.unit}, 0 or more"
    elif p.least and p.neutral == math.inf:
        if p.least <= p.typical[0]:
            yield (
                f"{p.name}: least = {p.least:g} {p.unit} is the stiffness above which it does not matter, so it must "
                f"be above the softest typical one, {p.typical[0]:g}"
            )
    elif p.least >= max(abs(end - (p.neutral or 0.0)) for end in p.typical) and p.neutral is not None:
        yield f"{p.name}: least = {p.least:g} {p.unit} is as large as anything typical; nothing would be named"


def _wrong_mode(mode: Any, others: Mapping[str, Mode]) -> Iterator[str]:
    if not isinstance(mode, Mode):
        yield f"modes holds {shown(mode)}; write modes = (Mode('a_name'),)"
        return
    base = [other.name for other in BASE_MODES]
    if mode.name in base or mode.name.startswith("other") or not NAME.fullmatch(mode.name):
        yield (
            f"a mode is called {mode.name!r}: the names {', '.join(base)} and other_1 ... are taken, and a name has "
            "small letters, digits and underscores only"
        )
    if others.get(mode.name, mode) != mode:
        yield f"the mode {mode.name!r} is declared differently by another effect; give it another name"
    looks = {other.look: other.name for other in (*BASE_MODES, *others.values()) if other.name != mode.name}
    if mode.look is not None and mode.look in looks:
        yield f"look = {mode.look} is that of {looks[mode.look]}; leave it out and the mode gets one of its own"
