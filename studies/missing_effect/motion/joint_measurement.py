"""Several measurements of one bicycle: its parameters and effects are common, sensors are each measurement's own."""

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Self

from bicycle.model import Model
from studies.inference.forward import Forward
from studies.inference.joint import OF, JointForward, Part
from studies.inference.parameter import Candidate
from studies.missing_effect.gap_figures import GAP
from studies.missing_effect.interface import Figure
from studies.missing_effect.motion.measurements import BicycleMeasurement
from tyre.base.errors import refuse_unknown


@dataclass(frozen=True, kw_only=True)
class JointMeasurement(BicycleMeasurement):
    """``parts`` by name, each with the model and the uncertainty of the whole."""

    parts: tuple[tuple[str, BicycleMeasurement], ...]

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
        """All parts at once; a mistake of one part's sensors is left out as ``PART/NAME``.

        ``without`` and ``also`` as of :meth:`BicycleMeasurement.forward`.
        """
        known = {name: part.names() for name, part in self.parts}
        every = {n for name, names in known.items() for n in names | {f"{name}{OF}{n}" for n in names}}
        for option, given in (("--without", without), ("--with", also)):
            refuse_unknown("effect", given, every, where=option)
        parts = []
        for name, part in self.parts:
            left, tried = (_concerning(name, known[name], given) for given in (without, also))
            own = frozenset(c.identifier for c in part.sensors() if c.mistake)
            parts.append(Part(name, part.forward(without=left, also=tried), own))
        return JointForward(tuple(parts))

    def unfitted(self, forward: Forward) -> Forward | None:
        """The held-out data of all parts, as models like those of the parts of ``forward``."""
        if not isinstance(forward, JointForward):
            return None
        measured = dict(self.parts)
        kept = [(part, measured[part.name].unfitted(part.forward)) for part in forward.parts]
        parts = tuple(replace(part, forward=unseen) for part, unseen in kept if unseen is not None)
        return JointForward(parts) if parts else None

    def figures(self) -> dict[str, Figure]:
        """The gap of all parts."""
        return {"gap": GAP}

    def on(self, model: Model) -> Self:
        """All parts with another base ``model``."""
        return replace(self, model=model, parts=tuple((name, part.on(model)) for name, part in self.parts))


def _concerning(part: str, known: Iterable[str], given: tuple[str, ...]) -> tuple[str, ...]:
    """What of the names ``given`` is meant for a part: its own after ``PART/``, and those that it knows."""
    own = [name.removeprefix(part + OF) for name in given if name.startswith(part + OF)]
    return (*own, *(name for name in given if name in known))
