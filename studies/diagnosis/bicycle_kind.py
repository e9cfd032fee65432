"""Base model, nuisances, candidates and forced responses, which all measurements of a bicycle share."""

from collections import Counter
from collections.abc import Hashable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.effects.effect_registry import Origin, registry
from bicycle.identification.recording import MOTOR_IN_TORQUE
from bicycle.model.eigen import angular_frequency, eigensystem
from bicycle.model.model import Model, check_compatible
from studies.diagnosis.candidates import LEFT_OUT, feedback_terms, find_candidates, nuisances, physical, reversed_signs
from studies.diagnosis.family import Family, Settings
from studies.diagnosis.figures import BEFORE_AFTER
from studies.diagnosis.mistakes import geometry_errors, one_speed, wrong_geometry
from studies.inference.fit import Fit
from studies.inference.kind import Candidates, Figure, Kind, Prediction, Proposal
from studies.inference.last_answer import RecentAnswers
from studies.inference.parameter import Candidate, UncertainParameter, central_differences
from tyre.ground.arrays import Array, Complex
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.schema import number

SPEED_AXIS = "speed, m/s"
FASTEST = 60.0  # m/s; above it a speed is surely in km/h
SPEED = number(above=0, most=FASTEST, outside=f"is outside 0 .. {FASTEST:g} m/s; is it in km/h?")
FORCED_HZ = np.geomspace(0.5, 4.0, 6)
FORCED_OUTPUTS = ("lean_rate", "steer", "yaw_rate")
FORCED_SD = 0.05  # of the magnitude of a frequency response, and of a tenth of its peak
SPEEDS_TO_PROPOSE = 0.7, 1.3
"""Least of the lowest and most of the highest measured speed: whoever measured these may not reach others."""
DRY = {"steer_friction": "needs time histories: dry friction is not linear in the motion, so no mode has it"}


@dataclass(frozen=True, kw_only=True)
class BicycleKind(Kind):
    """A measurement of a bicycle."""

    of_bicycle: ClassVar[bool] = True
    name: str = field()  # the file's name
    model: Model = field()  # the base model: bicycle and the effects it is known to have
    uncertainty: Mapping[str, float] = field(default_factory=dict)  # 1-sigma by ``key`` or ``effect.parameter``, SI
    # ``effect -> {parameter: value}`` of candidates, SI
    known: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    description: str = ""  # words of the file
    source: str = ""  # words of the file: who measured, and where it was published
    notes: tuple[str, ...] = ()  # assumptions in reading; once prepared, all of them
    nuisances: tuple[UncertainParameter, ...] = ()  # filled by :meth:`prepare`
    candidates: Candidates = ()  # filled by :meth:`prepare`
    refused: Mapping[str, str] = field(default_factory=dict)  # filled by :meth:`prepare`

    def __init_subclass__(cls, *, part: bool = True, **how: Any) -> None:
        super().__init_subclass__(part=part, **how)

    # ---- what a kind adds ----

    def refusals(self) -> dict[str, str]:
        """Candidates that cannot be tried with this measurement though others may show them, and why."""
        return DRY | one_speed(self.speeds.tolist())

    def assumptions(self) -> tuple[str, ...]:
        """Assumptions about this kind of data."""
        return ()

    # ---- library ----

    def _own_lists(
        self,
    ) -> tuple[tuple[Candidate, ...], dict[str, str], tuple[UncertainParameter, ...], tuple[str, ...]]:
        """Measurement errors, names that cannot be tried, nuisances and their notes."""
        floating, nuisance_notes = nuisances(self.model, self.uncertainty)
        geometry, narrow = geometry_errors(self.model, floating)
        return (*self.mistakes(), *geometry), {**self.refusals(), **narrow}, floating, nuisance_notes

    def names(self) -> set[str]:
        mistakes, reasons, _, _ = self._own_lists()
        return {*registry(), *(c.identifier for c in mistakes), *reasons}

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """Prepare nuisances and candidates."""
        mistakes, reasons, floating, nuisance_notes = self._own_lists()
        for option, names in (("--without", without), ("--with", also)):
            refuse_unknown("effect", names, {*registry(), *(c.identifier for c in mistakes), *reasons}, where=option)
        for name in set(without) & set(also):
            raise InputError(f"--without and --with both name {name!r}; give one of them")
        candidates, effect_reasons = find_candidates(self.model, self.known, without, also)
        all_candidates = (*candidates, *(c for c in mistakes if c.identifier not in without))
        count = Counter(c.identifier for c in all_candidates)
        for c in candidates:
            if count[c.identifier] > 1:
                raise InputError(
                    f"the effect {c.identifier!r} of {Origin.from_class(c.effect).file or c.effect.__module__} has "
                    "the name of something that may be wrong with a measurement or its files; give it another"
                )
        return replace(
            self,
            nuisances=floating,
            candidates=all_candidates,
            refused=effect_reasons | reasons,
            notes=(*self.notes, *self.assumptions(), *nuisance_notes),
        )

    def family(self, candidates: Candidates, settings: Settings = ()) -> Family:
        """The base model with ``candidates`` and some settings, made once for the many points at which a fit looks."""
        return self._recent_families.get(
            (settings, *map(id, candidates)), lambda: Family(self.model, self.nuisances, candidates, settings)
        )

    @cached_property
    def _recent_families(self) -> RecentAnswers[Family]:
        """Families by settings and identity of their candidates, which they keep so that no other can take it."""
        return RecentAnswers(most=51)

    @property
    def nominal(self) -> Array:
        """Coordinates (p,) of the nuisances as stated."""
        return np.array([u.centre for u in self.nuisances])

    def compatible(self, candidates: Candidates) -> bool:
        """True if these ``candidates`` make a model together; a drift is a bias already."""
        if {"bias", "drift"} <= {c.identifier for c in candidates}:
            return False
        replaced = {c.replaces for c in candidates}
        effects = [e for e in self.model.effects if e.identifier not in replaced]
        effects += [c.effect.__new__(c.effect) for c in candidates if c.effect is not None]
        try:
            check_compatible(tuple(effects))
        except InputError:
            return False
        return True

    def enabled_by(self, candidates: Candidates) -> Candidates:
        if all(c.effect is None or not c.effect.provides for c in candidates):
            return ()
        model = self.model
        for c in candidates:
            if c.effect is not None:
                model = model.with_effect(physical(c, list(c.starts[1])))
        refused_names = {name for name, why in self.refused.items() if why != LEFT_OUT}
        return tuple(c for c in find_candidates(model, {})[0] if c.identifier in refused_names and c.replaces is None)

    def empirical_terms(self) -> Candidates:
        """Steer torque proportional to lean, steer and their rates, and effects with the unphysical sign."""
        return (*self.directions(), *reversed_signs(self.candidates))

    def directions(self) -> Candidates:
        return feedback_terms()

    # ---- forced responses as a further measurement ----

    def propose_forced_response(self, fastest: float) -> tuple[Proposal, ...]:
        """Frequency responses to steer torque at the ``fastest`` measured speed (m/s) and above, unless it falls."""
        proposals = []
        for speed in (fastest, SPEEDS_TO_PROPOSE[1] * fastest):
            system = self.family(())(self.nominal[None], np.array([speed]))
            growth = eigensystem(system.dynamics[0], mass=system.mass[0]).values.real.max()
            if growth > 0.5:  # 1/s: it is not held up while the torque sweeps
                continue
            size = np.abs(self._response_to_steer_torque((), self.nominal[None], speed)[0])
            sd = FORCED_SD * (size + 0.1 * size.max(0)).ravel()
            low, high = FORCED_HZ[[0, -1]]
            title = f"swept steer torque, {low:g}-{high:g} Hz, at {speed:.3g} m/s (lean rate, steer, yaw rate)"
            proposals.append(Proposal(title, np.repeat(sd, 2), partial(self._swept_parts, speed)))
        return tuple(proposals)

    def _swept_parts(self, speed: float, candidates: Candidates, theta: Array) -> Prediction:
        """Real and imaginary parts (m,) of the swept responses, and their derivatives (m, p)."""
        batch, steps = self.family(candidates).stencil(theta)
        responses = self._response_to_steer_torque(candidates, batch, speed).reshape(len(batch), -1)
        parts = np.stack([responses.real, responses.imag], -1).reshape(len(batch), -1)
        return parts[0], central_differences(parts, steps)

    def _response_to_steer_torque(self, candidates: Candidates, theta: Array, speed: float) -> Complex:
        """C (i w E - F)^-1 B at a stencil of coordinates (K, p): (K, frequencies, outputs), per N m of steer torque."""
        family = self.family(candidates)
        names, system = family.symbolic, family(theta, np.array([speed]))
        gains = system.responses_about_the_first(
            angular_frequency(FORCED_HZ),
            inputs=[names.inputs.index("steer_torque")],
            outputs=[names.outputs.index(name) for name in FORCED_OUTPUTS],
        )
        return np.asarray(gains[:, 0, ..., 0])

    # ---- report ----

    def figures(self) -> dict[str, Figure]:
        return {"before_after": BEFORE_AFTER}

    def with_model(self, model: Model) -> Self:
        return replace(self, model=model)

    def corrected_model(self, final: Fit) -> Model:
        """The base model with the effects of ``final`` and a geometry that the file states wrongly."""
        return build_corrected_model(self.model, final)


class BatchedKind(BicycleKind, part=False):
    """A measurement whose numbers are predicted for many bicycles at once."""

    def _predict(self, candidates: Candidates, theta: Array) -> Array:
        """Predicted numbers (k, n) at coordinates (k, p)."""
        raise NotImplementedError

    def predict(self, candidates: Candidates, theta: Array) -> Array:
        return self._predict(candidates, theta[None])[0]

    def value_and_jacobian(self, candidates: Candidates, theta: Array) -> Prediction:
        batch, steps = self.family(candidates).stencil(theta)
        computed = self._predict(candidates, batch)
        return computed[0], central_differences(computed, steps)


def build_corrected_model(model: Model, final: Fit) -> Model:
    """A ``model`` with what ``final`` adds; InputError if its values make no effect, bicycle or combination."""
    bicycle, wrong = model.bicycle, wrong_geometry(final)
    if wrong:  # what follows the geometry still does
        corrected_values = {key: bicycle[key] + by for key, by in wrong.items() if key in bicycle.values}
        model = Model(bicycle.replace(**corrected_values, allow_unusual=True), model.effects)
    for c in sorted(final.candidates, key=lambda c: c.replaces is None):
        if c.effect is not None:
            model = model.with_effect(physical(c, final.theta[final.columns(c)].tolist()))
    return model


def refuse_repeats(path: Path, lines: Iterable[int], keys: Iterable[Hashable], noun: str) -> None:
    """Refuse a row of a table whose key an earlier row has."""
    first_lines: dict[Hashable, int] = {}
    for line, key in zip(lines, keys, strict=True):
        if (first := first_lines.setdefault(key, line)) != line:
            raise InputError(f"{path}, line {line}: the same {noun} as line {first}; keep one")


def without_motors(content: Mapping[str, Any], common: Mapping[str, Any]) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Common fields with a base model without motors, whose torque a record of the steer torque holds; a note of it."""
    model = common["model"]
    provided = {provision for effect in model.effects if effect.powered for provision in effect.provides}
    motors = [e.identifier for e in model.effects if e.powered or provided.intersection(e.requires)]
    if not motors:
        return dict(common), ()
    names = ", ".join(motors)
    if not content.get(MOTOR_IN_TORQUE, True):
        return dict(common), (f"{names}: acts in addition to the recorded steer torque ({MOTOR_IN_TORQUE} = false)",)
    motorless = Model(model.bicycle, tuple(effect for effect in model.effects if effect.identifier not in motors))
    uncertainty = {key: sd for key, sd in common["uncertainty"].items() if key.split(".")[0] not in motors}
    note = f"{names}: removed from the base model, as the recorded steer torque is assumed to include it"
    if content:  # of a measurement file; a command has no such key
        note += f"; write {MOTOR_IN_TORQUE} = false where it does not, as in what `velotyre simulate` writes"
    return {**common, "model": motorless, "uncertainty": uncertainty}, (note,)
