"""The file of ``velotyre plan --costs``: what can be measured, and what it costs."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bicycle.identification.recording import FASTEST
from studies.inference.evidence import CLEAR_ODDS
from tyre.base.checks import any_table, list_of, number, refused, remarked, text, whole
from tyre.base.errors import InputError, is_number
from tyre.base.schema import Table, by_name, maybe, needed, read, table
from tyre.base.toml_file import read_toml

RATIOS = ("steer_over_lean", "yaw_over_lean")  # what a sensor adds to modes
SIGNALS = (
    "roll_rate_rad_s", "lean_rad", "steer_rad", "steer_rate_rad_s", "yaw_rate_rad_s",
)  # fmt: skip
ROOTS = ("real_1_s", "imag_rad_s")
MOST_CHANNELS = 4  # that may be bought: every set of them is looked at
MOST_RUNS = 20  # at one speed
MOST_SPEEDS = 20

PRICE = number(least=0, says="must be a price >= 0")
SD = number(above=0, says="must be a standard deviation above 0; leave it out for that of the measurement")
SPEED = number(above=0, most=FASTEST)
SPEEDS = f"must be a list of speeds in m/s, above 0 and up to {FASTEST:g}"
RUNS = "write [[runs]] with speeds_m_s, setup and each"
FILE = table(
    {
        maybe("currency", ""): text("must be words in quotes, such as EUR or hours"),
        maybe("budget"): number(above=0, says="must be a price above 0; leave it out where money is no matter"),
        maybe("most_runs"): whole(least=1),
        maybe("runs", []): list_of(any_table, f"must be tables: {RUNS}"),
        maybe("channels", {}): any_table,
        maybe("bench", {}): any_table,
        maybe("sd", {}): any_table,
        maybe("limits", {}): any_table,
        maybe("goal", {}): any_table,
    }
)
RUN = table(
    {
        needed("speeds_m_s", f"no speeds_m_s; {RUNS}"): list_of(SPEED, SPEEDS, least=1),
        maybe("setup", 0.0): PRICE,
        needed("each", f"no price of each run; {RUNS}"): number(above=0, says="must be a price above 0"),
        maybe("most", 6): whole(least=1, most=MOST_RUNS),
    }
)
PRICED = table({needed("price", "no price; write price = 100"): PRICE})
BENCH = table({needed("price", "no price; write price = 100"): PRICE, maybe("sd"): SD})
GOAL = table(
    {
        maybe("odds", CLEAR_ODDS): number(least=CLEAR_ODDS, most=1e4, says=(
            f"must be odds from {CLEAR_ODDS:g}, below which a diagnosis names nothing, to 10000"
        )),
        maybe("probability", 0.9): number(least=0.5, most=0.99, says="must be a probability from 0.5 to 0.99"),
    }
)  # fmt: skip


def _limit(value: Any) -> Any:
    if isinstance(value, Mapping):
        if not value:
            raise remarked("is an empty table; write the sizes above which it would matter, or take it out")
        return {key: _limit(entry) for key, entry in value.items()}
    if not is_number(value) or not value > 0:
        raise refused(value, "must be the size above which an effect would matter, above 0, in SI")
    return float(value)


@dataclass(frozen=True)
class Stop:
    """A speed (m/s) that can be ridden: price of setting up and of each run, and most runs."""

    speed: float
    setup: float
    each: float
    most: int


@dataclass(frozen=True)
class Bench:
    """A test of one parameter by itself: its price and its sd (SI; 0 for the usual one)."""

    price: float
    sd: float = 0.0


@dataclass(frozen=True)
class Costs:
    """What can be measured, at what price.

    Attributes
    ----------
    stops : tuple of Stop
        One for each speed, rising.
    channels : mapping of str to float
        Price of a channel, once.
    bench : mapping of str to Bench
        By effect (its size), ``effect.parameter`` or key of the bicycle.
    sd : mapping of str to float
        Of one run, by column, SI.
    limits : mapping of str to float
        Size of ``effect`` or ``effect.parameter`` above which it would matter, SI.
    odds, probability : float
        What is to be reached: these odds with this probability.
    budget, most_runs : float, int, optional
    currency : str
    """

    stops: tuple[Stop, ...] = ()
    channels: Mapping[str, float] = field(default_factory=dict)
    bench: Mapping[str, Bench] = field(default_factory=dict)
    sd: Mapping[str, float] = field(default_factory=dict)
    limits: Mapping[str, float] = field(default_factory=dict)
    odds: float = CLEAR_ODDS
    probability: float = 0.9
    budget: float | None = None
    most_runs: int | None = None
    currency: str = ""

    def money(self, price: float) -> str:
        """A ``price``, a number of its currency, in words."""
        return f"{price:,.10g} {self.currency}".strip()


def read_costs(path: Path, channels: Collection[str] = (*RATIOS, *SIGNALS)) -> Costs:
    """Read the file at ``path``.

    Parameters
    ----------
    path : Path
    channels : collection of str
        Those that go with the measurement, for the message where a name is none at all; of another kind of data are
        refused with :func:`studies.missing_effect.plan.offers.check`.

    Raises
    ------
    InputError
        No such file, an unknown key, a value that is not allowed, a speed twice, nothing that can be measured.
    """
    content = read(FILE, read_toml(path, "file of costs"), where=str(path))
    stops: dict[float, Stop] = {}
    for number_, entry in enumerate(content["runs"], 1):
        given = read(RUN, entry, where=f"{path}, [[runs]] number {number_}")
        for speed in given["speeds_m_s"]:
            if speed in stops:
                raise InputError(f"{path}: [[runs]]: {speed:g} m/s is given twice; give each speed once")
            stops[speed] = Stop(speed, given["setup"], given["each"], given["most"])
    if len(stops) > MOST_SPEEDS:
        raise InputError(f"{path}: [[runs]]: {len(stops)} speeds are more than {MOST_SPEEDS}; give fewer")
    names = {*channels, *(name for name in content["channels"] if name in (*RATIOS, *SIGNALS))}
    bought = _section(path, content, "channels", by_name(PRICED, names, kind="channel"))
    if len(bought) > MOST_CHANNELS:
        raise InputError(f"{path}: [channels]: {len(bought)} are more than {MOST_CHANNELS}; give fewer")
    bench = {key: read(BENCH, entry, where=str(path), section=f"bench.{key}")
             for key, entry in _flat(content["bench"], ("price", "sd")).items()}  # fmt: skip
    if bought and not stops:
        raise InputError(f"{path}: [channels] are bought for runs, and there are none; {RUNS}")
    if not stops and not bench:
        raise InputError(f"{path}: nothing can be measured; {RUNS}, or [bench.EFFECT] with price")
    limits = _section(path, content, "limits", Table({}, (str, _limit)))
    return Costs(
        stops=tuple(stops[speed] for speed in sorted(stops)),
        channels={name: entry["price"] for name, entry in bought.items()},
        bench={key: Bench(**entry) for key, entry in bench.items()},
        sd=_section(path, content, "sd", by_name(SD, (*ROOTS, *RATIOS, *SIGNALS), kind="column")),
        limits=_flat(limits), **_section(path, content, "goal", GOAL),
        **{key: content.get(key) for key in ("budget", "most_runs")}, currency=content["currency"],
    )  # fmt: skip


def _section(path: Path, content: Mapping[str, Any], key: str, declared: Table) -> Any:
    return read(declared, content[key], where=str(path), section=key)


def _flat(content: Mapping[str, Any], ends: tuple[str, ...] = (), prefix: str = "") -> dict[str, Any]:
    """Tables within tables as one, their names joined by points; a table with one of the keys ``ends`` is a leaf."""
    found: dict[str, Any] = {}
    for key, value in content.items():
        inner = isinstance(value, Mapping) and not set(value) & set(ends)
        if inner and any(isinstance(entry, Mapping) for entry in value.values()):
            found |= _flat(value, ends, f"{prefix}{key}.")
        elif inner and not ends:
            found |= {f"{prefix}{key}.{name}": entry for name, entry in value.items()}
        else:
            found[prefix + key] = value
    return found
