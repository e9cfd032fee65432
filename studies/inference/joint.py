"""Several forward models as one: common nuisances and effects, errors of its own for each part.

Evidence adds up: parts are independent given the coordinates, so residuals stand below each other and logarithms of
determinants add. A candidate that is a mistake of one part's sensors is named ``part/candidate`` and touches no other.
Parts may be of several things: what is not common to these is named ``thing/name`` (see :mod:`.part`).
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
from numpy.typing import NDArray

from studies.inference.arrays import Array
from studies.inference.forward import Forward, ProposedMeasurement, Residual, Rows
from studies.inference.parameter import Candidate, UncertainParameter
from studies.inference.part import OF, FromPart, Part, widened

APART = 0.05  # share by which places along one axis differ enough for a name

__all__ = ["OF", "JointForward", "Part"]


@dataclass(frozen=True)
class JointForward:
    """All ``parts`` at once (see :class:`studies.inference.forward.Forward`).

    Nuisances of one name in the whole are one unknown. A part whose stated uncertainty fixes one takes its own stated
    value.

    Raises
    ------
    ValueError
        No part, two of one name, a part called as a thing, or one nuisance with two priors.
    """

    parts: tuple[Part, ...]
    said: tuple[str, ...] = ()
    _enabling: dict[tuple[int, frozenset[str]], frozenset[str]] = field(default_factory=dict, repr=False, compare=False)

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts]
        if not names or len(set(names)) < len(names) or {part.thing for part in self.parts} & set(names):
            raise ValueError(f"parts {names}: give each a name of its own")
        for part in self.parts:
            for u in map(part.nuisance, part.forward.nuisances):
                other = self._nuisances[u.name]
                if (u.centre, u.scale) != (other.centre, other.scale):
                    raise ValueError(
                        f"{part.name}: {u.name} = {u.centre:g} +- {u.scale:g}, in another part {other.centre:g} +- "
                        f"{other.scale:g}; one thing has one prior"
                    )

    # ------------------------------------------------------------------ what is common

    @property
    def thorough(self) -> bool:
        """Whether each part is cheap enough to begin each fit from several starts."""
        return all(part.forward.thorough for part in self.parts)

    @cached_property
    def _nuisances(self) -> dict[str, UncertainParameter]:
        return {u.name: u for part in reversed(self.parts) for u in map(part.nuisance, part.forward.nuisances)}

    @cached_property
    def nuisances(self) -> tuple[UncertainParameter, ...]:
        """Each once, in the order of the parts."""
        names = dict.fromkeys(part.called(u.name) for part in self.parts for u in part.forward.nuisances)
        return tuple(self._nuisances[name] for name in names)

    @cached_property
    def candidates(self) -> tuple[Candidate, ...]:
        """Each common one once, then those of the parts."""
        return self._collected(lambda forward: forward.candidates)

    @property
    def library(self) -> tuple[Candidate, ...]:
        """What shares the prior."""
        return self._collected(lambda forward: forward.library)

    def _collected(self, of: Callable[[Forward], Iterable[Candidate]]) -> tuple[Candidate, ...]:
        common: dict[str, Candidate] = {}
        own: dict[str, Candidate] = {}
        for part in self.parts:
            for c in map(part.candidate, of(part.forward)):
                (own if OF in c.identifier else common).setdefault(c.identifier, c)
        return (*common.values(), *own.values())

    @cached_property
    def refused(self) -> Mapping[str, str]:
        """What no part can try, and why; a reason of one part alone begins with its name."""
        tried = {c.identifier for c in self.candidates}
        found: dict[str, str] = {}
        for part in self.parts:
            for name, why in part.forward.refused.items():
                if (called := part.called(name)) not in tried:
                    found.setdefault(called, why)
        return found

    @property
    def notes(self) -> tuple[str, ...]:
        """What was assumed: of all parts once, of one part after its name."""
        said = [part.forward.notes for part in self.parts]
        every = [note for note in said[0] if all(note in notes for notes in said)]
        alone = [
            f"{part.name}: {note}" for part, notes in zip(self.parts, said, strict=True) for note in notes
            if note not in every
        ]  # fmt: skip
        return (*self.said, *every, *alone)

    @property
    def varied(self) -> bool:
        """Whether one part alone is, or two parts look at different things."""
        if any(part.forward.varied for part in self.parts):
            return True
        places: dict[str, list[Array]] = {}
        for part in self.parts:
            places.setdefault(part.forward.rows.axis, []).append(part.forward.rows.abscissa)
        every = [np.concatenate(along) for along in places.values()]
        return any(bool(np.ptp(along) > APART * np.abs(along).max()) for along in every)

    # ------------------------------------------------------------------ part by part

    def concerns(self, candidate: Candidate) -> bool:
        """Whether a ``candidate`` of a larger whole is of one of these parts."""
        return any(part.here(candidate.identifier) is not None for part in self.parts)

    def of_part(self, number: int, candidates: tuple[Candidate, ...]) -> tuple[tuple[Candidate, ...], NDArray[np.intp]]:
        """What of ``candidates`` acts on the part with this ``number``, and where its coordinates (q,) stand in theirs.

        Parameters
        ----------
        number : int
        candidates : tuple of Candidate
            Of a joint hypothesis.
        """
        part = self.parts[number]
        columns = {u.name: k for k, u in enumerate(self.nuisances)}
        places, kept, start = [columns[part.called(u.name)] for u in part.forward.nuisances], [], len(columns)
        known = {c.identifier: c for c in part.forward.candidates}
        acting = self._acting(number, candidates)
        for c in candidates:
            name = part.here(c.identifier)
            if name in acting:
                kept.append(known.get(name, replace(c, identifier=name)))
                places += range(start, start + len(c.unknowns))
            start += len(c.unknowns)
        return tuple(kept), np.array(places, dtype=np.intp)

    def _acting(self, number: int, candidates: tuple[Candidate, ...]) -> frozenset[str]:
        """What of ``candidates`` a part takes: what it does not refuse, and what that makes possible; by its names."""
        part = self.parts[number]
        names = frozenset(name for c in candidates if (name := part.here(c.identifier)) is not None)
        refused = names.intersection(part.forward.refused)
        if not refused:
            return names
        key = number, names
        if key not in self._enabling:
            kept = tuple(c for c in part.forward.candidates if c.identifier in names)
            enabled = {c.identifier for c in part.forward.enabled_by(kept)}
            self._enabling[key] = (names - refused) | (refused & enabled)
        return self._enabling[key]

    def slices(self) -> list[slice]:
        """Rows of each part."""
        return self._slices_of([part.forward.rows for part in self.parts])

    @cached_property
    def rows(self) -> Rows:
        """Those of the parts below each other; a held-out fold is of one part."""
        every = [part.forward.rows for part in self.parts]
        shift = np.cumsum([0, *(rows.fold.max(initial=-1) + 1 for rows in every[:-1])])
        width = sum(rows.inputs.shape[1] for rows in every if rows.inputs is not None)
        inputs, column = np.zeros((sum(len(rows.where) for rows in every), width)), 0
        for rows, here in zip(every, self._slices_of(every), strict=True):
            if rows.inputs is not None:
                inputs[here, column : column + rows.inputs.shape[1]] = rows.inputs
                column += rows.inputs.shape[1]
        named = [(part.name, rows) for part, rows in zip(self.parts, every, strict=True)]
        axes = {rows.axis for rows in every}
        return Rows(
            tuple(f"{name}: {where}" for name, rows in named for where in rows.where),
            np.concatenate([rows.abscissa for rows in every]),
            tuple(f"{name}: {series}" for name, rows in named for series in rows.series),
            np.concatenate([rows.fold + k for rows, k in zip(every, shift, strict=True)]),
            inputs if width else None,
            shown={
                f"{name}: {series}": replace(rows.show(series), channel=f"{name}: {rows.show(series).channel}")
                for name, rows in named
                for series in dict.fromkeys(rows.series)
            },
            axis=axes.pop() if len(axes) == 1 else "",
        )

    @staticmethod
    def _slices_of(every: list[Rows]) -> list[slice]:
        ends = np.cumsum([0, *(len(rows.where) for rows in every)])
        return [slice(a, b) for a, b in pairwise(ends)]

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Residuals of the parts (n,) and their derivative (n, p). Arguments as :meth:`.Forward.residual`."""
        values, columns = [], []
        for number, part in enumerate(self.parts):
            kept, places = self.of_part(number, candidates)
            r, j = part.forward.residual(kept, theta[places], slopes=slopes)
            values.append(r)
            columns.append(widened(j, places, len(theta)) if slopes else np.empty((len(r), 0)))
        return np.concatenate(values), np.vstack(columns)

    def log_determinant(self, candidates: tuple[Candidate, ...], theta: Array) -> float:
        """Sum over the parts, with ``candidates`` at ``theta`` (p,)."""
        total = 0.0
        for number, part in enumerate(self.parts):
            kept, places = self.of_part(number, candidates)
            total += part.forward.log_determinant(kept, theta[places])
        return total

    def marginalised(self, candidates: tuple[Candidate, ...], theta: Array, white: Array) -> Array:
        """What each part leaves of its rows of ``white`` (n, draws), with ``candidates`` at ``theta`` (p,)."""
        found = []
        for number, (part, rows) in enumerate(zip(self.parts, self.slices(), strict=True)):
            kept, places = self.of_part(number, candidates)
            found.append(part.forward.marginalised(kept, theta[places], white[rows]))
        return np.concatenate(found)

    def easier(self) -> tuple["JointForward", ...]:
        """Each part's easiest problem at once; empty where none has one."""
        led = [part.forward.easier() for part in self.parts]
        if not any(led):
            return ()
        parts = [replace(p, forward=e[-1]) if e else p for p, e in zip(self.parts, led, strict=True)]
        return (replace(self, parts=tuple(parts)),)

    def refined(self, best: Residual) -> "JointForward":
        """Each part refined by its rows of the ``best`` fit."""
        parts = [
            replace(part, forward=part.forward.refined(SimpleNamespace(residual=best.residual[rows])))
            for part, rows in zip(self.parts, self.slices(), strict=True)
        ]
        same = all(new.forward is old.forward for new, old in zip(parts, self.parts, strict=True))
        return self if same else replace(self, parts=tuple(parts))

    # ------------------------------------------------------------------ what goes together, and what to do next

    def compatible(self, candidates: tuple[Candidate, ...]) -> bool:
        """Whether each part takes what of ``candidates`` acts on it."""
        parts = enumerate(self.parts)
        return all(part.forward.compatible(self.of_part(k, candidates)[0]) for k, part in parts)

    def enabled_by(self, candidates: tuple[Candidate, ...]) -> tuple[Candidate, ...]:
        """What ``candidates`` make possible in any part, each once."""
        found: dict[str, Candidate] = {}
        for number, part in enumerate(self.parts):
            for c in map(part.candidate, part.forward.enabled_by(self.of_part(number, candidates)[0])):
                found.setdefault(c.identifier, c)
        return tuple(found.values())

    def phenomenological(self) -> tuple[Candidate, ...]:
        """Those of the parts, each once."""
        return self._each_once(part.forward.phenomenological() for part in self.parts)

    def directions(self) -> tuple[Candidate, ...]:
        """Those of the parts, each once."""
        return self._each_once(part.forward.directions() for part in self.parts)

    def _each_once(self, terms: Iterable[tuple[Candidate, ...]]) -> tuple[Candidate, ...]:
        every = (part.candidate(c) for part, some in zip(self.parts, terms, strict=True) for c in some)
        return tuple({c.identifier: c for c in every}.values())

    def proposed(self) -> tuple[ProposedMeasurement, ...]:
        """Those of the parts, each once."""
        found: dict[str, FromPart] = {}
        for number, part in enumerate(self.parts):
            for proposal in part.forward.proposed():
                found.setdefault(proposal.what, FromPart(proposal.what, proposal.sd, number, proposal))
        return tuple(found.values())

    def predict(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array]:
        """As its part predicts a ``proposal``. Arguments as :meth:`studies.inference.forward.Forward.predict`."""
        assert isinstance(proposal, FromPart)
        kept, places = self.of_part(proposal.number, candidates)
        value, slope = self.parts[proposal.number].forward.predict(proposal.proposal, kept, theta[places])
        return value, widened(slope, places, len(theta))

    def loose(
        self, proposal: ProposedMeasurement, candidates: tuple[Candidate, ...], theta: Array
    ) -> tuple[Array, Array] | None:
        """As the part of a ``proposal`` says. Arguments as :meth:`studies.inference.forward.Forward.loose`."""
        assert isinstance(proposal, FromPart)
        kept, places = self.of_part(proposal.number, candidates)
        found = self.parts[proposal.number].forward.loose(proposal.proposal, kept, theta[places])
        return found and (widened(found[0], places, len(theta)), found[1])
