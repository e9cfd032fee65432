"""The commented model file that ``velotyre new`` writes; what it says of an effect comes from the effect."""

from textwrap import wrap

from bicycle.effect import Effect, Parameter, effect_class, registry
from bicycle.effect.signature import sentence
from bicycle.files.wheel_tyres import TYRE_KEYS
from bicycle.model import Model
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.tyre_source import TyreSource, out_of_reach

HEAD = """\
# A model for velotyre: a bicycle, and what acts on it beyond rigid bodies. Units are SI unless a key names another.
#   velotyre modes {file} --speeds 2:20:2
#   velotyre critical {file}
# Lines that begin with # are comments: take the # away to use what stands behind it.

# What this is, in your words (may be left out).
description = "Example written by velotyre new"

# The bicycle: a packaged one (velotyre bicycles lists them), a file of yours, relative to this one ("mine.toml",
# "mine.txt", "mine.yml"; velotyre convert {bicycle} --to mine.toml writes one to start from), or a table [bicycle]
# with every parameter of Meijaard et al. (2007).
bicycle = "{bicycle}"

# Values more than 30 times beyond what is typical are refused as a slip of units, unless this is true.
allow_unusual = false

# ---- The contact of the tyres with the ground: at most one law. Without one the wheels roll without slip. ----

{tyre_says}
[effects.relaxation_length]
# A tyre, taken at the bicycle's own wheel loads ({rear:.0f} N rear, {front:.0f} N front).
# Each of these keys is one value, or {{rear = .., front = ..}}.
# tyre: packaged (velotyre tyres lists them), a table of tyre fit ("fit/maps/NAME_flat.csv"), a tyre property file
# ("mine.tir") or Pacejka-89 coefficients ("mine.toml").
tyre = "{tyre}"
surface = "{surface}"  # or "drum"; may be left out
pressure_bar = {pressure:g}  # measured at {pressures} bar
extrapolate = {beyond}
"""
LAW_GIVES = ("cornering_stiffness", "relaxation_length")  # by tyre and pressure_bar, with no more to write
SHARES = (0.5, 0.25, 0.0)  # of the typical range, until the bicycle takes the values
UNFIT = "# (Typical values, but not all at once on this bicycle: velotyre says what does not fit.)\n"
NEAR = "true takes the tyre farther outside the measured loads and pressures than their range is wide"
GUESS = "the wheel loads are farther outside the measured ones than their range is wide: the tyre values are a guess"


def example_model(bicycle: Bicycle, tyre: TyreSource, *, file: str) -> str:
    """Text of a model file that runs as it is, with every key explained and every effect to be switched on.

    Parameters
    ----------
    bicycle : Bicycle
        A packaged one.
    tyre : TyreSource
        A packaged tyre.
    file : str
        Name of the file, for the commands in its first lines.
    """
    rear, front = bicycle.static_loads
    middle = float(tyre.pressures[tyre.pressures.size // 2])
    far = any(out_of_reach(tyre, load=load, pressure=middle) for load in (rear, front))
    effects = registry()
    law = effects["relaxation_length"]
    head = HEAD.format(
        file=file, bicycle=bicycle.name, tyre=tyre.tyre, rear=rear, front=front, pressure=middle / PASCAL_PER_BAR,
        pressures=", ".join(f"{bar / PASCAL_PER_BAR:g}" for bar in tyre.pressures), tyre_says=_said(law),
        surface=tyre.surface, beyond=f"true  # {GUESS}" if far else f"false  # {NEAR}",
    )  # fmt: skip
    own = f"# Numbers of your own instead of {', '.join(TYRE_KEYS)}:\n" + _lines(law, bicycle)
    laws = [e for e in effects.values() if e.slot == law.slot and e is not law and e.parameters]
    others = [e for e in effects.values() if e.slot != law.slot]
    more = "# ---- More effects. velotyre effects NAME explains each in full. ----\n"
    return "\n".join([head + own, *(_table(e, bicycle) for e in laws), more, *(_table(e, bicycle) for e in others)])


def _table(effect: type[Effect], bicycle: Bicycle) -> str:
    needs = f"# Needs: {', '.join(effect.requires)}.\n" if effect.requires else ""
    return f"{_said(effect)}\n{needs}# [effects.{effect.identifier}]\n{_lines(effect, bicycle)}"


def _said(effect: type[Effect]) -> str:
    return "\n".join(f"# {line}" for line in wrap(effect.description.split("\n\n")[0], 116))


def _lines(effect: type[Effect], bicycle: Bicycle) -> str:
    """A commented line per parameter, with the default or a typical value that suits the bicycle."""
    values = typical_values(effect, bicycle)
    if values is not None:
        return "".join(_line(p, values[p.name]) for p in effect.parameters)
    return "".join(_line(p, _value(p, SHARES[0])) for p in effect.parameters) + UNFIT


def typical_values(effect: type[Effect], bicycle: Bicycle) -> dict[str, float] | None:
    """Values to begin with, by the name of the parameter: defaults, else typical ones that the bicycle takes.

    Parameters
    ----------
    effect : subclass of Effect
    bicycle : Bicycle

    Returns
    -------
    dict or None
        In the units of the parameters; None where no share of the typical ranges suits the bicycle.
    """
    for share in SHARES:
        values = {p.name: _value(p, share) for p in effect.parameters}
        try:
            _tyred(bicycle).with_effect(effect(**values))
        except InputError:
            continue
        return values
    return None


def _tyred(bicycle: Bicycle) -> Model:
    law = effect_class("relaxation_length")
    return Model(bicycle, law(**{p.name: _value(p, SHARES[0]) for p in law.parameters}))


def _value(p: Parameter, share: float) -> float:
    low, high = p.typical
    return p.default if isinstance(p.default, float) else float(f"{low + share * (high - low):.4g}")


def _line(p: Parameter, value: float) -> str:
    text = sentence(p).rstrip(".")
    tied = f"; left out, it is {p.default} of the bicycle" if isinstance(p.default, str) else ""
    wheels = "; or {rear = .., front = ..}" if p.per_wheel else ""
    wheels += '; or "tyre", what a .tir or Pacejka-89 file holds' if p.tyre and p.tyre not in LAW_GIVES else ""
    return f"# {p.name} = {value:.4g}  # {p.unit}; {text[0].lower()}{text[1:]}{tied}{wheels}\n"
