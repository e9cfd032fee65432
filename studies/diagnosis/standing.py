"""Deflections and vibrations of a bicycle that stands still, its rear frame held and its front wheel in the air.

What it predicts is :class:`bicycle.standing.Prediction`: M, C and K of the model at rest without the rows of what is
held.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np

from bicycle.effects.effect import Effect
from bicycle.effects.effect_registry import registry
from bicycle.effects.sprung_joint import SprungJoint
from bicycle.model.model import Model
from bicycle.standing import (
    SERIES,
    SUPPORT,
    TABLE,
    TYRE,
    TYRE_DAMPING,
    Prediction,
    Readings,
    at_rim,
    read_standing,
    require_rider,
)
from studies.diagnosis.bicycle_kind import BatchedKind
from studies.diagnosis.candidates import nobody_rides
from studies.diagnosis.family import Family, Settings
from studies.diagnosis.mistakes import SENSOR
from studies.inference.evidence import folds
from studies.inference.kind import Candidates, Rows, Series
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.ground.arrays import Array

TURNING = ("steer_damper", "steer_spring")  # act on a handlebar that is free
SADDLE, REAR, WHEEL = "rider_saddle", "rear_compliance", "wheel_compliance"
NO_PART = "has no part in the deflections and vibrations of a front frame that stands still"
NO_RIM = "no deflection was read at the rim under a weight at the rim: no other reading loads rim and spokes"
HELD_BAR = "the handlebar is held"
RIGID_HZ = 200.0
"""Frequency (Hz) of a rigid front frame: faster than any that is read."""
WIDER_DAMPING = (
    2.0  # sd of the logarithm of a damping: bare frames have a tenth of what riders and frames have together
)
HOLD_SOFTEST = 4e3  # N m/rad: half its compliance is one prior sd of a hold
LATERAL_PER_ROTATION = 16.0  # 1/m^2, stiffness of a hold to the side over that in rotation: two arms of 0.25 m
TYRE_LOSS = 40.0  # N s/m
TYRE_SOFTEST = 5e4  # N/m to the side: half its compliance is one prior sd
HOLD_PLACE = (0.4, 0.5)  # share of the wheelbase, m above the ground
QUANTITIES = {
    "deflection": ("deflection, mm", 1000.0),
    "frequency": ("frequency, Hz", 1.0),
    "damping ratio": ("damping ratio", 1.0),
}


@dataclass(frozen=True, kw_only=True)
class StandingKind(BatchedKind, kind="standing"):
    """Readings of a standing bicycle."""

    keys: ClassVar[Any] = TABLE
    readings: Readings
    held: str = field(default="")  # what held the frame

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "StandingKind":
        found = read_standing(content, folder, common["model"].bicycle.values)
        return cls(**common, readings=found.readings, held=found.held, notes=found.notes)

    # ---- candidates ----

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """Prepare the library: joints of frame and fork, which these readings show directly, and the hold."""
        require_rider(self.readings, self.model)
        shown = [name for name in ("fork_bending", REAR) if name not in without and not self._unseen(registry()[name])]
        prepared = super().prepare(without=without, also=(*also, *shown))
        acting = tuple(
            _with_wider_damping(c) for c in prepared.candidates if c.effect is None or not self._unseen(c.effect)
        )
        return replace(prepared, candidates=acting)

    def _unseen(self, effect: type[Effect]) -> str:
        """Reason why an ``effect`` does not act here; empty if it does."""
        if effect.identifier in TURNING:
            return "" if self.readings.bar_free else HELD_BAR
        if effect.identifier == SADDLE:
            return self._rider_unseen()
        if effect.identifier == REAR:
            return self._rear_unseen()
        if effect.identifier == WHEEL:
            return "" if self._reads_rim() else NO_RIM
        carries_front = effect.identifier in ("front_compliance", "fork_bending")
        return "" if issubclass(effect, SprungJoint) and carries_front else NO_PART

    def _rider_unseen(self) -> str:
        """Reason why a rider who yaws on the saddle does not show; empty if they do."""
        if not self.readings.seated:
            return f"no rider: the rear frame was held ({self.held})"
        if why := nobody_rides(self.model):
            return why
        return "" if self.readings.taps else "the frame is held while weights hang: only taps show the rider"

    def _rear_unseen(self) -> str:
        """Reason why the rear triangle does not show; empty if it lies between the hold and the front frame."""
        if self.readings.axle_held:
            return ""
        if self.readings.seated:
            return "" if self.readings.taps else "the frame is held while weights hang: only taps show it"
        return f"the main frame was held ({self.held}): nothing loads the rear triangle"

    def _reads_rim(self) -> bool:
        """True if a weight hung at the rim while the rim was read: elsewhere rim and spokes do not show."""
        radius = self.model.bicycle["rF"]
        return any(at_rim(d.loaded, radius) and at_rim(d.read, radius) for d in self.readings.deflections)

    def mistakes(self) -> tuple[Candidate, ...]:
        """A compliant hold: springs support the frame, or under a rider the rear tyre does."""
        if self.readings.seated:
            return (_rear_tyre(),)
        scale = 0.5 / HOLD_SOFTEST
        stiffness = UncertainParameter(
            "stiffness",
            "N m/rad",
            {SUPPORT[0]: 1.0, SUPPORT[1]: LATERAL_PER_ROTATION},
            0.0,
            scale,
            1e-3 * scale,
            power=-1,
            size=True,
            labels=("rotation", "lateral"),
        )
        share, height = HOLD_PLACE
        return (
            Candidate(
                "support",
                (stiffness,),
                fixed={SUPPORT[2]: share * self.model.bicycle["w"], SUPPORT[3]: -height},
                signature="the rear frame moves with the front frame: soft in all readings, most above the hinge",
                title="compliant hold of the rear frame",
                weight=SENSOR,
            ),
        )

    def refusals(self) -> dict[str, str]:
        present = {effect.identifier for effect in self.model.effects}
        reasons = {name: self._unseen(effect) for name, effect in registry().items() if name not in present}
        return {name: why for name, why in reasons.items() if why}

    def assumptions(self) -> tuple[str, ...]:
        held = f"the rear frame was held ({self.held}), the front wheel in the air"
        if self.readings.seated and not nobody_rides(self.model):
            held = f"the front wheel was in the air and only the rider held the frame in the taps ({self.held})"
        rigid = f"a front frame that is rigid in the base model is taken to vibrate at {RIGID_HZ:g} Hz"
        empty = (
            "the damping of the front frame is that of an empty frame: with a rider who is fixed to the frame it is "
            "too small for a ride; give the bicycle rider_saddle"
        )
        fixed_rider = not nobody_rides(self.model) and all(e.identifier != SADDLE for e in self.model.effects)
        return (
            (held, rigid, empty) if self.readings.damped and not self.readings.seated and fixed_rider else (held, rigid)
        )

    # ---- physics ----

    @cached_property
    def _standing(self) -> tuple[Model, tuple[tuple[str, float], ...]]:
        """The base model with what acts here alone, and the parameters that have no part."""
        # contact laws have no part, but rim and spokes are in series with one
        acting = tuple(e for e in self.model.effects if e.slot is not None or not self._unseen(type(e)))
        model = Model(self.model.bicycle, acting)
        return model, tuple((k, value) for k, value in self.model.parameters.items() if k not in model.parameters)

    def family(self, candidates: Candidates, settings: Settings = ()) -> Family:
        model, unused = self._standing
        return Family(model, self.nuisances, candidates, (*unused, *settings))

    @cached_property
    def _used(self) -> tuple[Array, Array, Any]:
        measured, sd = self.readings.numbers()
        used = np.flatnonzero(np.isfinite(measured))
        return measured[used], sd[used], used

    @property
    def data(self) -> tuple[Array, Array]:
        return self._used[:2]

    @property
    def varied(self) -> bool:
        return len(self._used[0]) > 1

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """A series is a quantity; rows of one arrangement are held out together."""
        labels, quantities, groups = [], [], []
        for deflection in self.readings.deflections:
            labels.append(
                f"deflection {deflection.read.above_hub:g} m above the hub, {deflection.force:g} N at "
                f"{deflection.loaded.above_hub:g} m"
            )
            quantities.append("deflection")
            groups.append(f"{deflection.force:g} N at {deflection.loaded.above_hub:g} m")
        for tap in self.readings.taps:
            of_tap = ["frequency", "damping ratio"]
            for ratio in tap.ratios:
                places = f"{ratio.read.above_hub:g} m over {ratio.over.above_hub:g} m"
                of_tap += [f"ratio, {places}", f"ratio, {places}, imaginary part"]
            labels += [f"{quantity} of {tap.name}" for quantity in of_tap]
            quantities += of_tap
            groups += [tap.name] * len(of_tap)
        used = self._used[2]
        labels, quantities, groups = ([column[k] for k in used] for column in (labels, quantities, groups))
        order = np.arange(len(used), dtype=float)
        fold = folds(groups, order.tolist(), [f"{k:06d}" for k in range(len(used))])
        displays = {
            name: Series("tap" if name != "deflection" else "load", name, "reading", *QUANTITIES.get(name, (name, 1.0)))
            for name in dict.fromkeys(quantities)
        }
        return Rows(tuple(labels), order, tuple(quantities), fold, displays=displays, axis="reading")

    def _predict(self, candidates: Candidates, theta: Array) -> Array:
        """Predicted numbers (k, n) at coordinates (k, p)."""
        model, _ = self._standing
        present = [type(effect) for effect in model.effects if effect.slot is None]
        present += [c.effect for c in candidates if c.effect is not None]
        effects: Sequence[type[Effect]] = [effect for effect in present if effect.identifier != WHEEL]  # not a joint
        values = {key: value[:, 0] for key, value in self.family(candidates).values(theta).items()}
        used = self._used[2]
        if not effects and not {SUPPORT[0], SERIES, TYRE} & set(values):
            return np.tile(self._rigid[used], (len(theta), 1))
        ridden = not nobody_rides(self.model)
        prediction = Prediction(self.readings, tuple(sorted(effects, key=lambda effect: effect.identifier)), ridden)
        return prediction(values)[:, used]

    @cached_property
    def _rigid(self) -> Array:
        """Numbers of a rigid front frame."""
        numbers = [0.0] * len(self.readings.deflections)
        for tap in self.readings.taps:
            numbers += [RIGID_HZ, 0.0, *(0.0 for _ in tap.ratios for _ in ("real", "imaginary"))]
        return np.array(numbers)


def _rear_tyre() -> Candidate:
    """A laterally compliant rear tyre under a seated rider."""
    scale = 0.5 / TYRE_SOFTEST
    stiffness = UncertainParameter("stiffness", "N/m", {TYRE: 1.0}, 0.0, scale, 1e-3 * scale, power=-1, size=True)
    damping = UncertainParameter("damping", "N s/m", {TYRE_DAMPING: 1.0}, math.log(TYRE_LOSS), 1.0, power=0)
    return Candidate(
        "rear_tyre",
        (stiffness, damping),
        signature="the frame moves to the side over the rear contact: the saddle looks softer",
        title="lateral compliance of the rear tyre",
        weight=SENSOR,
    )


def _with_wider_damping(candidate: Candidate) -> Candidate:
    """The candidate with a damping that may be that of a bare frame."""
    unknowns = (replace(u, scale=WIDER_DAMPING) if u.name == "damping" else u for u in candidate.unknowns)
    return replace(candidate, unknowns=tuple(unknowns))
