"""Several measurements as one: of a bicycle, of its tyre on a rig, of several bicycles with one tyre.

Parameters and effects of one bicycle are common to its parts, sensors are each part's own. What is common to several
bicycles is their tyre: effects of :func:`tyre_effects`, unless the file says otherwise. A stiffness in N/rad is then
one number in proportion to the static load, and where the base models hold a tyre, the bicycles share how far it is off
what is stated of it, in shares of that.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Self

from bicycle.effect import registry
from bicycle.model import Model
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.joint import OF, JointForward, Part
from studies.inference.parameter import Candidate, UncertainParameter
from studies.missing_effect.interface import Figure
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from studies.missing_effect.motion.measurements import BicycleMeasurement, TyreMeasurement
from studies.missing_effect.motion.tyre_part import ALIGNING, CONTACT, TRAIL, own_trails
from studies.missing_effect.part_figures import figures_of_parts
from tyre.base.errors import InputError, refuse_unknown

LOAD_UNIT = "N/rad"  # what has it is in proportion to the static load


def tyre_effects() -> tuple[str, ...]:
    """Effects that are the tyre's: contact laws, aligning moments, and what takes a value from a tyre."""
    slots = (CONTACT, ALIGNING)
    return tuple(
        name for name, e in registry().items() if e.slot in slots or any(p.tyre for p in e.parameters)
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class JointMeasurement(BicycleMeasurement):
    """Several ``parts``.

    Attributes
    ----------
    parts : tuple of (str, BicycleMeasurement)
        By name, each with the model and the uncertainty of its bicycle.
    bicycles : mapping of str to str
        By part, what its bicycle is called, where that is not the one of the whole.
    common : tuple of str
        Effects that all bicycles share; those of :func:`tyre_effects` where none are given.
    """

    parts: tuple[tuple[str, BicycleMeasurement], ...]
    bicycles: Mapping[str, str] = field(default_factory=dict)
    common: tuple[str, ...] = ()

    @property
    def shared(self) -> tuple[str, ...]:
        """Effects that all bicycles share."""
        return self.common or tyre_effects()

    def sensors(self) -> tuple[Candidate, ...]:
        """Those of all parts, each under the name of its part where it is a mistake of that part."""
        return tuple(
            replace(c, identifier=f"{name}{OF}{c.identifier}") if c.mistake else c
            for name, part in self.parts
            for c in part.sensors()
        )

    def impossible(self) -> dict[str, str]:
        """What no part can show."""
        every = [part.impossible() for _, part in self.parts]
        return {name: why for name, why in every[0].items() if all(name in other for other in every)}

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> JointForward:
        """All parts at once; what is one part's, or one bicycle's, is left out as ``PART/NAME`` or ``BICYCLE/NAME``.

        ``without`` and ``also`` as of :meth:`BicycleMeasurement.forward`.
        """
        known = {name: part.names() for name, part in self.parts}
        every = {n for names in known.values() for n in names}
        every |= {f"{own}{OF}{n}" for name, names in known.items() for own in self._owners(name) for n in names}
        for option, given in (("--without", without), ("--with", also)):
            refuse_unknown("effect", given, every, where=option)
        if any(isinstance(p, TyreMeasurement) and any(q == TRAIL for q, _ in p.numbers.names) for _, p in self.parts):
            without = tuple(dict.fromkeys((*without, *own_trails())))  # none of its numbers
        parts: list[Part] = []
        for name, part in self.parts:
            left, tried = (_concerning(self._owners(name), known[name], given) for given in (without, also))
            own = frozenset(c.identifier for c in part.sensors() if c.mistake)
            thing, forward = self.bicycles.get(name, ""), part.forward(without=left, also=tried)
            if not thing:
                parts.append(Part(name, forward, own))
                continue
            common = {u.name for u in forward.nuisances if u.name.split(".")[0] in self.shared}
            alike = _as_of(self._first(without, also), forward, self.shared)
            parts.append(Part(name, alike, own, thing, frozenset({*self.shared, *common})))
        try:
            return JointForward(tuple(parts), said=self._said())
        except ValueError as error:
            raise InputError(f"[[part]]: {error}") from error

    def _owners(self, part: str) -> tuple[str, ...]:
        return (part, *([self.bicycles[part]] if part in self.bicycles else []))

    def _first(self, without: tuple[str, ...], also: tuple[str, ...]) -> BicycleForward:
        """The forward model of a part of the first bicycle, by which the others' tyres are measured."""
        name, part = next((name, part) for name, part in self.parts if name not in self.bicycles)
        known = part.names()
        forward = part.forward(**{
            key: _concerning((name,), known, given) for key, given in (("without", without), ("also", also))
        })  # fmt: skip
        assert isinstance(forward, BicycleForward)
        return forward

    def _said(self) -> tuple[str, ...]:
        others = list(dict.fromkeys(self.bicycles.values()))
        if not others:
            return ()
        return (
            f"several bicycles: {self.model.bicycle.name} and {', '.join(others)}; common to all of them: "
            f"{', '.join(self.shared)}; everything else of another bicycle is its own and called BICYCLE/NAME",
        )

    def unfitted(self, forward: Forward) -> Forward | None:
        """The held-out data of all parts, as models like those of the parts of ``forward``."""
        if not isinstance(forward, JointForward):
            return None
        measured = dict(self.parts)
        kept = [(part, measured[part.name].unfitted(part.forward)) for part in forward.parts]
        parts = tuple(replace(part, forward=unseen) for part, unseen in kept if unseen is not None)
        return JointForward(parts) if parts else None

    def figures(self) -> dict[str, Figure]:
        """Those of each part."""
        return figures_of_parts({name: part.figures() for name, part in self.parts})

    def on(self, model: Model) -> Self:
        """All parts of the first bicycle with another base ``model``."""
        parts = tuple((name, part if name in self.bicycles else part.on(model)) for name, part in self.parts)
        return replace(self, model=model, parts=parts)

    def model_with(self, final: Fit) -> Model | None:
        """The base model of the first bicycle with what ``final`` adds to it."""
        return super().model_with(of_first(final))

    def of_others(self, forward: Forward, final: Fit) -> dict[str, tuple[BicycleMeasurement, Fit]]:
        """What a ``final`` fit of ``forward`` says of each further bicycle: a part of it, and a fit in its own names.

        Parameters
        ----------
        forward : Forward
            What was fitted.
        final : Fit
        """
        assert isinstance(forward, JointForward)
        measured: dict[str, BicycleMeasurement] = {}
        nuisances: dict[str, dict[str, tuple[UncertainParameter, int]]] = {}
        candidates: dict[str, dict[str, tuple[Candidate, list[int]]]] = {}
        for number, (name, part) in enumerate(self.parts):
            called = self.bicycles.get(name)
            if called is None:
                continue
            measured.setdefault(called, part)
            kept, places = forward.of_part(number, final.candidates)
            where, own = iter(places.tolist()), forward.parts[number].forward.nuisances
            for u in own:
                nuisances.setdefault(called, {})[u.name] = u, next(where)
            for c in kept:
                candidates.setdefault(called, {})[c.identifier] = c, [next(where) for _ in c.unknowns]
        return {
            called: (part, _restricted(final, nuisances.get(called, {}).values(), candidates.get(called, {}).values()))
            for called, part in measured.items()
        }


def of_first(final: Fit) -> Fit:
    """What a ``final`` fit says of the first bicycle: without effects that are another's own."""
    kept = [c for c in final.candidates if c.effect is None or OF not in c.identifier]
    common = [(u, k) for k, u in enumerate(final.unknowns[: final.effect_columns.start])]
    return _restricted(final, common, [(c, list(range(*final.columns(c).indices(len(final.theta))))) for c in kept])


def _restricted(
    final: Fit,
    nuisances: Iterable[tuple[UncertainParameter, int]],
    candidates: Iterable[tuple[Candidate, list[int]]],
) -> Fit:
    """Of a ``final`` fit only these, each with its places among the coordinates."""
    floating, kept = list(nuisances), list(candidates)
    places = [*(k for _, k in floating), *(k for _, where in kept for k in where)]
    return replace(
        final, candidates=tuple(c for c, _ in kept), theta=final.theta[places],
        unknowns=(*(u for u, _ in floating), *(u for c, _ in kept for u in c.unknowns)),
        covariance=final.covariance[places][:, places], jacobian=final.jacobian[:, places],
    )  # fmt: skip


def _concerning(owners: Iterable[str], known: Iterable[str], given: tuple[str, ...]) -> tuple[str, ...]:
    """What of the names ``given`` is meant for a part: its own after ``PART/``, and those that it knows."""
    own = [name.removeprefix(owner + OF) for owner in owners for name in given if name.startswith(owner + OF)]
    return (*own, *(name for name in given if name in known))


def _as_of(first: BicycleForward, other: Forward, shared: tuple[str, ...]) -> Forward:
    """Another bicycle's model whose shared effects have the coordinates and priors of those of the ``first`` one."""
    assert isinstance(other, BicycleForward)
    heavier = sum(other.base.bicycle.static_loads) / sum(first.base.bicycle.static_loads)
    known = {c.identifier: c for c in first.candidates}

    def alike(c: Candidate) -> Candidate:
        if c.identifier not in shared or c.identifier not in known:
            return c
        pairs = zip(known[c.identifier].unknowns, c.unknowns, strict=True)
        return replace(c, unknowns=tuple(_scaled(u, v, heavier) for u, v in pairs))

    stated = {u.name: u for u in first.nuisances}
    nuisances = tuple(
        _relative(stated[u.name], u) if u.name.split(".")[0] in shared and u.name in stated else u
        for u in other.nuisances
    )
    changed: dict[str, Any] = {"candidates": tuple(map(alike, other.candidates)), "nuisances": nuisances}
    found: Any = replace(other, **changed)
    return found


def _scaled(first: UncertainParameter, other: UncertainParameter, heavier: float) -> UncertainParameter:
    """The unknown of the ``first`` bicycle, with the wheels of the other, whose loads are so many times larger."""
    factor = heavier if first.unit == LOAD_UNIT else 1.0
    return replace(first, sets={key: factor * share for key, share in other.sets.items()})


def _relative(first: UncertainParameter, other: UncertainParameter) -> UncertainParameter:
    """The unknown of the ``first`` bicycle, which sets the ``other``'s number to the same share of its stated one."""
    factor = other.centre / first.centre if first.centre else 1.0
    return replace(first, sets={key: factor * share for key, share in other.sets.items()})
