"""What the prices offer after a measurement: checked, and predicted for every set of channels that can be bought."""

from collections.abc import Sequence
from itertools import combinations

from bicycle.effect import registry
from studies.inference.forward import Forward
from studies.missing_effect.motion.history_forward import HistoryForward
from studies.missing_effect.motion.modal_forward import ModalForward
from studies.missing_effect.plan.costs import RATIOS, SIGNALS, Costs
from studies.missing_effect.plan.entries import how_to_enter
from studies.missing_effect.plan.expected import bench_test, blocks, history_run, modal_run
from studies.missing_effect.plan.offer import Item, Offer
from studies.missing_effect.plan.questions import Open
from tyre.base.errors import InputError, unknown

FEWEST_ROWS = 3  # of a table of modes, which runs with new channels are
OFFERED = "a plan is offered for modes (kind = 'modal') and time histories (kind = 'histories')"


def check(forward: Forward, name: str, costs: Costs) -> ModalForward | HistoryForward:
    """Refuse ``costs`` that do not go with the ``forward`` model of the measurement called ``name``.

    Raises
    ------
    InputError
        Another kind of data; a channel or bench test that does not belong to the measurement.
    """
    if not isinstance(forward, ModalForward | HistoryForward):
        raise InputError(
            f"{name}: {OFFERED}; for other kinds the report of `velotyre diagnose` ranks measurements by gain"
        )
    _check_channels(forward, costs)
    _check_bench(forward, costs)
    return forward


def channels_of(forward: Forward) -> tuple[str, ...]:
    """Channels that go with the ``forward`` model of a measurement; any where no plan is offered."""
    if isinstance(forward, ModalForward):
        return RATIOS
    return SIGNALS if isinstance(forward, HistoryForward) else (*RATIOS, *SIGNALS)


def _check_channels(forward: ModalForward | HistoryForward, costs: Costs) -> None:
    allowed, other = channels_of(forward), "modes" if isinstance(forward, ModalForward) else "time histories"
    for name in costs.channels:
        if name not in allowed:
            raise InputError(f"[channels]: {name} does not belong to {other}; known: {', '.join(allowed)}")
        if name in recorded(forward):
            raise InputError(f"[channels]: {name} is recorded already and costs nothing; take it out")


def recorded(forward: ModalForward | HistoryForward) -> tuple[str, ...]:
    """Channels that the measurement of ``forward`` has."""
    if isinstance(forward, ModalForward):
        return tuple(name for name in RATIOS if any(name in p.ratios for p in forward.points))
    return tuple(forward.noise)


def _check_bench(forward: Forward, costs: Costs) -> None:
    own = {name for u in forward.nuisances for name in (u.name, *u.sets)}
    parameters = {f"{e}.{p.name}" for e, cls in registry().items() for p in cls.parameters}
    for key, bench in costs.bench.items():
        if key not in own and key not in registry() and key not in parameters and "." not in key:
            raise InputError(f"[bench]: {unknown('effect or parameter', key, {*own, *registry()})}")
        if key not in own and key not in registry() and key not in parameters:
            raise InputError(f"[bench]: {unknown('effect or parameter', key, {*own, *parameters})}")
        if key in own and not bench.sd:
            raise InputError(f"[bench.{key}]: no sd; give the standard deviation that the test would have, SI")


def offers_of(forward: ModalForward | HistoryForward, what: Open, costs: Costs) -> tuple[list[Offer], list[str]]:
    """An offer for every set of channels that can be bought, the largest last."""
    notes: list[str] = []
    benches = []
    for number, (key, bench) in enumerate(costs.bench.items()):
        expected = bench_test(what.fits, key, bench)
        if expected is None:
            notes.append(f"bench test of {key}: nothing that is open depends on it")
            continue
        benches.append(
            Item(f"bench test of {key}", 0.0, bench.price, 1, tuple(blocks([expected], 900 + number)),
                 afterwards=how_to_enter(forward, key))
        )  # fmt: skip
    offers = []
    names = tuple(costs.channels)
    for size in range(len(names) + 1):
        for bought in combinations(names, size):
            entry = sum(costs.channels[name] for name in bought)
            items = _runs(forward, what, costs, bought, notes)
            offers.append(
                Offer(
                    forward,
                    what,
                    bought,
                    entry,
                    (*items, *benches),
                    costs.odds,
                    costs.probability,
                    FEWEST_ROWS if bought and isinstance(forward, ModalForward) else 0,
                )
            )
    return offers, list(dict.fromkeys(notes))


def _runs(
    forward: ModalForward | HistoryForward, what: Open, costs: Costs, bought: Sequence[str], notes: list[str]
) -> list[Item]:
    items = []
    for number, stop in enumerate(costs.stops):
        if isinstance(forward, ModalForward):
            ratios = (*recorded(forward), *bought)
            expected = modal_run(forward, what.fits, stop.speed, ratios, costs)
            lacking = "no mode that was measured would be seen there"
        else:
            expected = history_run(forward, what.fits, stop.speed, bought, costs)
            lacking = "the bicycle would fall at once"
        if not expected:
            notes.append(f"{stop.speed:g} m/s: {lacking}; left out")
        items.append(
            Item(f"runs at {stop.speed:g} m/s", stop.setup, stop.each, stop.most if expected else 0,
                 tuple(blocks(expected, number)), stop.speed)
        )  # fmt: skip
    return items
