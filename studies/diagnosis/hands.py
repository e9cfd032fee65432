"""Ring-downs of the steering with hands on the handlebar: front wheel in the air, known springs at the handlebar.

What it predicts is :func:`bicycle.standing.predict_ring_downs`: the model at rest without the rows of the rear frame,
with one of the springs at the steering.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.effects.effect import Effect
from bicycle.effects.effect_registry import registry
from bicycle.model.model import Model
from bicycle.standing import (
    HANDS,
    HANDS_TABLE,
    SPRING_SD,
    RingDown,
    predict_ring_downs,
    read_ring_downs,
    select_grip,
    spring_error,
)
from studies.diagnosis.bicycle_kind import BatchedKind
from studies.diagnosis.family import Family, Settings
from studies.diagnosis.mistakes import friction_candidate
from studies.inference.evidence import folds
from studies.inference.kind import Candidates, Rows, Series
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.ground.arrays import Array
from tyre.ground.schema import read

ACTING = ("rider_arms", "rider_hands", "steer_damper", "steer_spring", "handlebar_bag")
"""Effects that act on a handlebar that oscillates while the bicycle stands still."""
NO_PART = "has no part in a steering that oscillates with the front wheel in the air"
NO_AMPLITUDE = "needs ring-downs of two amplitudes and the column amplitude_deg: dry friction damps small ones most"
DIFFERENT = 1.5  # largest amplitude over the smallest from which dry friction shows
QUANTITIES = {"frequency": "frequency, Hz", "damping ratio": "damping ratio"}


@dataclass(frozen=True, kw_only=True)
class HandsKind(BatchedKind, kind=HANDS):
    """Ring-downs of one grip."""

    keys: ClassVar[Any] = HANDS_TABLE
    ring_downs: tuple[RingDown, ...] = field()

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "HandsKind":
        table = read(HANDS_TABLE, content, section=HANDS)
        ring_downs = select_grip(read_ring_downs(folder / table["table"]), table.get("grip"))
        return cls(**common, ring_downs=ring_downs)

    # ---- candidates ----

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """Prepare the library: what acts on the steering; the springs float with their uncertainty."""
        prepared = super().prepare(without=without, also=also)
        acting = tuple(c for c in prepared.candidates if c.effect is None or c.identifier in ACTING)
        return replace(prepared, candidates=acting, nuisances=(*prepared.nuisances, *self._spring_errors()))

    def _spring_errors(self) -> tuple[UncertainParameter, ...]:
        springs = dict.fromkeys(one.spring for one in self.ring_downs if one.spring)
        names = [spring_error(spring) for spring in springs]
        return tuple(UncertainParameter(name, "1", {name: 1.0}, 0.0, SPRING_SD) for name in names)

    def mistakes(self) -> tuple[Candidate, ...]:
        return (friction_candidate(),) if self._amplitudes_differ else ()

    @property
    def _amplitudes_differ(self) -> bool:
        amplitudes = np.array([one.amplitude for one in self.ring_downs])
        return bool(np.isfinite(amplitudes).all() and amplitudes.max() >= DIFFERENT * amplitudes.min())

    def refusals(self) -> dict[str, str]:
        present = {effect.identifier for effect in self.model.effects}
        reasons = {name: NO_PART for name in registry() if name not in present and name not in ACTING}
        return reasons if self._amplitudes_differ else {**reasons, "steer_friction": NO_AMPLITUDE}

    def assumptions(self) -> tuple[str, ...]:
        held = "the rear frame was held, the front wheel in the air"
        return (held, f"the springs float with a standard uncertainty of {SPRING_SD:.0%}")

    # ---- physics ----

    @cached_property
    def _standing(self) -> tuple[Model, tuple[tuple[str, float], ...]]:
        """The base model with what acts here alone, and the parameters that have no part."""
        model = Model(self.model.bicycle, tuple(one for one in self.model.effects if one.identifier in ACTING))
        return model, tuple((k, value) for k, value in self.model.parameters.items() if k not in model.parameters)

    def family(self, candidates: Candidates, settings: Settings = ()) -> Family:
        model, unused = self._standing
        return Family(model, self.nuisances, candidates, (*unused, *settings))

    @cached_property
    def data(self) -> tuple[Array, Array]:
        measured = [(one.frequency_hz, one.damping_ratio) for one in self.ring_downs]
        sd = [(one.frequency_sd_hz, one.damping_ratio_sd) for one in self.ring_downs]
        return np.array(measured).ravel(), np.array(sd).ravel()

    @property
    def varied(self) -> bool:
        return len({one.spring for one in self.ring_downs}) > 1

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """A series is a quantity along the stiffness of the spring; a ring-down is held out as a whole."""
        labels, series, springs, groups = [], [], [], []
        for number, one in enumerate(self.ring_downs, 1):
            for quantity in QUANTITIES:
                labels.append(f"{quantity} of ring-down {number}, {one.spring:g} N m/rad")
                series.append(quantity)
                springs.append(one.spring)
                groups.append(f"{number:06d}")
        fold = folds(groups, springs, groups)
        displays = {name: Series(name, shown) for name, shown in QUANTITIES.items()}
        return Rows(tuple(labels), np.array(springs), tuple(series), fold, displays=displays, axis="spring, N m/rad")

    def _predict(self, candidates: Candidates, theta: Array) -> Array:
        """Predicted numbers (k, n) at coordinates (k, p)."""
        model, _ = self._standing
        effects: Sequence[type[Effect]] = [type(effect) for effect in model.effects if effect.slot is None]
        effects = [*effects, *(c.effect for c in candidates if c.effect is not None)]
        values = {key: value[:, 0] for key, value in self.family(candidates).values(theta).items()}
        return predict_ring_downs(self.ring_downs, effects, values)
