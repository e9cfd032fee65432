"""Hold what the page shows as one line of text: the address after ``#``, strict in both directions.

``key=value&key=value``: the keys of a model file with dots (``bicycle=benchmark``, ``effects.steer_damper.damping=1``,
``effects.relaxation_length.pressure_bar.front=5``) and those of the view (speeds, chosen mode, pinned curves).
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any
from urllib.parse import quote, unquote

from bicycle.effects.effect import WHEELS
from bicycle.effects.effect_registry import registry
from bicycle.files.bicycle_numbers import COVARIANCE
from bicycle.model.wheel_tyres import FROM_TYRE, TYRE_KEYS
from studies.explorer.geometry import GEOMETRY
from tyre.ground import schema
from tyre.ground.errors import InputError, is_number, refuse_unknown, shown, unknown
from tyre.ground.schema import number, remarked, text

FILE_KEYS = ("bicycle", "effects", "allow_unusual", COVARIANCE, "description")
TEXT_KEYS = ("tyre", "surface")  # of an effect's table; all else is a number, a switch or the word "tyre"
ON = "on"  # value of effects.NAME for an effect that is there without numbers of its own

Value = float | bool | str


def make_tables(flat: Mapping[str, Value]) -> dict[str, Any]:
    """Make tables from dotted keys."""
    content: dict[str, Any] = {}
    for key, value in flat.items():
        *outer, last = key.split(".")
        place = content
        for part in outer:
            place = place.setdefault(part, {})
            if not isinstance(place, dict):
                raise InputError(f"address: {key} is given in addition to {part}; keep one")
        if last in place:
            raise InputError(f"address: {key} is given as a value and as a table; keep one")
        place[last] = {} if outer == ["effects"] else json.loads(str(value)) if last == COVARIANCE else value
    return content


def make_dotted_keys(content: Mapping[str, Any]) -> tuple[tuple[str, Value], ...]:
    """Make dotted keys from the content of a model file, for :class:`State`."""
    flat: dict[str, Value] = {}

    def add(key: str, value: Any) -> None:
        if key in (COVARIANCE, f"bicycle.{COVARIANCE}"):
            flat[key] = json.dumps(value, separators=(",", ":"))
        elif isinstance(value, Mapping) and (value or key == "effects"):
            for name, inner in value.items():
                add(f"{key}.{name}", inner)
        elif isinstance(value, Mapping):
            flat[key] = ON
        elif isinstance(value, bool | str):
            flat[key] = value
        elif is_number(value):
            flat[key] = float(value)
        else:
            raise InputError(f"{key} = {shown(value)} must be a number, a text or true or false")

    refuse_unknown("key", content, FILE_KEYS)
    for name, value in content.items():
        add(name, value)
    return tuple(sorted(flat.items()))


def write_value(value: Value) -> str:
    """Write a value as the address has it, every digit of a number."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return repr(value).removesuffix(".0") if isinstance(value, float) else value


def read_number(key: str, value: str) -> float:
    """Read a finite number from a text of an address."""
    result = _number(value)
    if not math.isfinite(result) or len(value) > 40:
        raise InputError(f"address: {key} = {shown(value)} must be a finite number")
    return result


def _number(value: str) -> float:
    """Read a number; NaN if the text is none."""
    try:
        return float(value)
    except ValueError:
        return math.nan


def model_value(key: str, value: str) -> Value:
    """Read the value of a dotted key of a model file."""
    parts = key.split(".")
    if key in ("bicycle", "description") or (parts[0] == "effects" and len(parts) > 2 and parts[2] in TEXT_KEYS):
        return value
    if key in (COVARIANCE, f"bicycle.{COVARIANCE}"):
        try:
            table = json.loads(value)
        except (ValueError, RecursionError):
            table = None
        if not isinstance(table, dict):
            raise InputError(f"address: {key} = {shown(value)} must be a table as JSON")
        return json.dumps(table, separators=(",", ":"))
    if value in ("true", "false") and parts[-1] in ("allow_unusual", "extrapolate"):
        return value == "true"
    if parts[0] == "effects" and (value, len(parts)) == (ON, 2):
        return ON
    if parts[0] == "effects" and value == "tyre" and len(parts) in (3, 4):
        return value
    if parts[0] == "bicycle" and not math.isfinite(_number(value)):
        return value  # such as 0.3 +/- 0.01, which the reader of bicycles checks
    if len(parts) == 1 or len(parts) > 4 or (parts[0] == "effects" and len(parts) == 2):
        raise InputError(f"address: {key} = {shown(value)} is not a key and value of a model file")
    return read_number(key, value)


def each_wheel(model: Mapping[str, Value]) -> dict[str, Value]:
    """Split a number for both wheels into two, so that each has its own control."""
    by_wheel: dict[str, Value] = {}
    for key, value in model.items():
        parts = key.split(".")
        kind = registry().get(parts[1]) if parts[0] == "effects" and len(parts) == 3 else None
        twice = kind is not None and (
            parts[2] in TYRE_KEYS or any(p.per_wheel for p in kind.parameters if p.name == parts[2])
        )
        if twice and value != FROM_TYRE and not any(f"{key}.{wheel}" in model for wheel in WHEELS):
            by_wheel |= {f"{key}.{wheel}": value for wheel in WHEELS}
        else:
            by_wheel[key] = value
    return by_wheel


LONGEST = 60_000  # letters of an address
MOST_PINS = 4
FASTEST = 60.0  # m/s, of the speed range
PIN = "pin"


@dataclass(frozen=True)
class State:
    """A model and a view of it."""

    # dotted keys of a model file and their values, SI, angles and pressures in the unit of the key
    model: tuple[tuple[str, Value], ...] = (("bicycle", "benchmark"),)
    name: str = ""  # of an own bicycle
    rider: str = ""  # a packaged body put on the bicycle; empty: none
    posture: str = "upright"  # of that body
    slow: float = 1.0  # m/s, lowest speed
    fast: float = 10.0  # m/s, highest speed
    at: float = 5.0  # m/s, chosen speed
    mode: str = ""  # whose sensitivities and shape are shown; empty: the first
    pins: tuple[str, ...] = ()  # addresses of what is shown for comparison
    x: str = ""  # first axis of the stability chart, as ``velotyre chart`` takes it; empty: no chart
    y: str = ""  # second axis, likewise

    @property
    def content(self) -> dict[str, Any]:
        """The content of its model file, without the rider and what is moved."""
        return {key: value for key, value in make_tables(dict(self.model)).items() if key != GEOMETRY}

    @property
    def geometry(self) -> dict[str, Any]:
        """Numbers of the bicycle that are moved, by the keys of their sliders."""
        return dict(make_tables(dict(self.model)).get(GEOMETRY, {}))

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
        return "&".join(f"{quote(key)}={quote(write_value(value), safe='/:,')}" for key, value in pairs)


def _read_line(value: Any) -> str:
    """Read one line of at most 80 letters."""
    if len(text("")(value)) > 80 or any(ord(letter) < 32 for letter in value):
        raise remarked("must be one line of at most 80 letters")
    return str(value)


_speed = number(above=0.0, most=FASTEST, says=f"must be a speed above 0 and up to {FASTEST:g} m/s")
VIEW = schema.table(
    {schema.maybe(key): _read_line for key in ("name", "rider", "mode", "x", "y")}
    | {schema.maybe("posture"): text("must be upright, hoods or drops", allowed=("upright", "hoods", "drops"))}
    | {schema.maybe(key): _speed for key in ("slow", "fast", "at")}
)


def parse_state(address: Any) -> State:
    """Read the state of an address; refuse unknown or repeated keys, and values out of range."""
    if not isinstance(address, str) or len(address) > LONGEST:
        raise InputError(f"address: must be text of at most {LONGEST} letters; start again with an empty one")
    pins: list[str] = []
    model: dict[str, Value] = {}
    view: dict[str, Any] = {}
    for pair in filter(None, address.removeprefix("#").split("&")):
        raw, equals, end = pair.partition("=")
        key, value = unquote(raw), unquote(end)
        if not equals or "\0" in value:
            raise InputError(f"address: {shown(pair)} is not key=value; correct it or start with an empty address")
        if key == PIN:
            pins.append(value)
            continue
        if key in model or key in view:
            raise InputError(f"address: {key} is given twice; keep one")
        if key.split(".")[0] in (*FILE_KEYS, GEOMETRY):
            model[key] = model_value(key, value)
        elif key in ("slow", "fast", "at"):
            view[key] = read_number(key, value)
        else:
            view[key] = value
    try:
        checked = schema.read(VIEW, view, where="address")
    except InputError as error:
        strange = [key for key in view if key not in VIEW.keys]
        if not strange:
            raise
        raise InputError(f"address: {unknown('key', strange[0], [*FILE_KEYS, GEOMETRY, *VIEW.keys, PIN])}") from error
    if not any(key.startswith("bicycle.") for key in model):
        model.setdefault("bicycle", "benchmark")
    state = State(model=tuple(sorted(each_wheel(model).items())), pins=_pins(pins), **checked)
    if not state.slow < state.fast or not state.slow <= state.at <= state.fast:
        raise InputError(
            f"address: speeds from {state.slow:g} to {state.fast:g} m/s with {state.at:g} m/s chosen; the first must "
            "be below the second and the chosen one between them"
        )
    make_tables(model)
    return state


def _pins(texts: list[str]) -> tuple[str, ...]:
    """Check the addresses that are pinned: not too many, and none that pins others."""
    if len(texts) > MOST_PINS:
        raise InputError(f"address: {len(texts)} curves are pinned; at most {MOST_PINS}, unpin some")
    if any(parse_state(pin).pins for pin in texts):
        raise InputError("address: what is pinned cannot pin others; unpin it")
    return tuple(texts)
