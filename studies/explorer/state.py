"""What the page shows, as one line of text: the address after ``#``, strict in both directions.

``key=value&key=value``: the keys of a model file with dots (``bicycle=benchmark``, ``effects.steer_damper.damping=1``,
``effects.relaxation_length.pressure_bar.front=5``) and those of the view (speeds, chosen mode, pinned curves).
"""

from dataclasses import dataclass, fields, replace
from typing import Any
from urllib.parse import quote, unquote

from studies.explorer.flat_keys import MODEL_KEYS, Value, each_wheel, finite, model_value, nested, written
from tyre.base import schema
from tyre.base.checks import number, remarked, text
from tyre.base.errors import InputError, shown, unknown

LONGEST = 60_000  # letters of an address
MOST_PINS = 4
FASTEST = 60.0  # m/s, of the speed range
PIN = "pin"


@dataclass(frozen=True)
class State:
    """A model and a view of it.

    Attributes
    ----------
    model : tuple of (str, float, bool or str)
        Dotted key of a model file -> value, sorted by key.
    name : str
        What an own bicycle is called.
    rider, posture : str
        A packaged body put on the bicycle, and how it sits; an empty rider: none.
    slow, fast, at : float
        Speed range and chosen speed, m/s.
    mode : str
        Whose sensitivities and shape are shown; empty: the first.
    pins : tuple of str
        Addresses of what is shown for comparison.
    x, y : str
        What stands along the axes of the stability chart, as ``velotyre chart`` takes it; empty: no chart.
    """

    model: tuple[tuple[str, Value], ...] = (("bicycle", "benchmark"),)
    name: str = ""
    rider: str = ""
    posture: str = "upright"
    slow: float = 1.0
    fast: float = 10.0
    at: float = 5.0
    mode: str = ""
    pins: tuple[str, ...] = ()
    x: str = ""
    y: str = ""

    @property
    def content(self) -> dict[str, Any]:
        """The content of its model file, without the rider."""
        return nested(dict(self.model))

    @property
    def address(self) -> str:
        """Its text, which :func:`parse_state` reads back exactly."""
        start = State()
        view = [
            (field.name, getattr(self, field.name))
            for field in fields(self)
            if field.name not in ("model", "pins") and getattr(self, field.name) != getattr(start, field.name)
        ]
        pairs = [*self.model, *view, *((PIN, pin) for pin in self.pins)]
        return "&".join(f"{quote(key)}={quote(written(value), safe='/:,')}" for key, value in pairs)

    def alone(self) -> "State":
        """Without what is pinned."""
        return replace(self, pins=())


def _short(value: Any) -> str:
    if len(text("")(value)) > 80 or any(ord(letter) < 32 for letter in value):
        raise remarked("must be one line of at most 80 letters")
    return str(value)


_speed = number(above=0.0, most=FASTEST, says=f"must be a speed above 0 and up to {FASTEST:g} m/s")
VIEW = schema.table(
    {schema.maybe(key): _short for key in ("name", "rider", "mode", "x", "y")}
    | {schema.maybe("posture"): text("must be upright, hoods or drops", allowed=("upright", "hoods", "drops"))}
    | {schema.maybe(key): _speed for key in ("slow", "fast", "at")}
)


def parse_state(address: Any) -> State:
    """Read an address.

    Parameters
    ----------
    address : str
        With or without the ``#``; empty: the state that the page begins with.

    Raises
    ------
    InputError
        Too long, no ``key=value``, an unknown or repeated key, a value that is not allowed. Whether the model file that
        it holds makes a model is found when it is built.
    """
    if not isinstance(address, str) or len(address) > LONGEST:
        raise InputError(f"address: must be text of at most {LONGEST} letters; begin again with an empty one")
    pins: list[str] = []
    model: dict[str, Value] = {}
    view: dict[str, Any] = {}
    for pair in filter(None, address.removeprefix("#").split("&")):
        raw, equals, end = pair.partition("=")
        key, value = unquote(raw), unquote(end)
        if not equals or "\0" in value:
            raise InputError(f"address: {shown(pair)} is not key=value; correct it or begin with an empty address")
        if key == PIN:
            pins.append(value)
            continue
        if key in model or key in view:
            raise InputError(f"address: {key} is given twice; keep one")
        if key.split(".")[0] in MODEL_KEYS:
            model[key] = model_value(key, value)
        elif key in ("slow", "fast", "at"):
            view[key] = finite(key, value)
        else:
            view[key] = value
    try:
        checked = schema.read(VIEW, view, where="address")
    except InputError as error:
        strange = [key for key in view if key not in VIEW.keys]
        if not strange:
            raise
        raise InputError(f"address: {unknown('key', strange[0], [*MODEL_KEYS, *VIEW.keys, PIN])}") from error
    if not any(key.startswith("bicycle.") for key in model):
        model.setdefault("bicycle", "benchmark")
    state = State(model=tuple(sorted(each_wheel(model).items())), pins=_pins(pins), **checked)
    if not state.slow < state.fast or not state.slow <= state.at <= state.fast:
        raise InputError(
            f"address: speeds from {state.slow:g} to {state.fast:g} m/s with {state.at:g} m/s chosen; the first must "
            "be below the second and the chosen one between them"
        )
    nested(model)
    return state


def _pins(texts: list[str]) -> tuple[str, ...]:
    if len(texts) > MOST_PINS:
        raise InputError(f"address: {len(texts)} curves are pinned; at most {MOST_PINS}, unpin some")
    for one in texts:
        if parse_state(one).pins:
            raise InputError("address: what is pinned cannot pin others; unpin it")
    return tuple(texts)
