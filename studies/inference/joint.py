"""Several measurements as one: common nuisances and effects, and errors of its own for each part.

Evidence adds up: parts are independent given the coordinates, so residuals stand below each other and logarithms of
determinants add. A mistake of one part's sensors is named ``part/candidate``. Parts may be of several things: whatever
these do not share is named ``thing/name``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from studies.inference.fit import Fit
from studies.inference.kind import Candidates, Figure, Kind, Prediction, Proposal, Rows
from studies.inference.parameter import Array, Candidate, UncertainParameter

if TYPE_CHECKING:
    from studies.inference.judge import Judgement

OF = "/"  # between a part, or a thing, and its own


@dataclass(frozen=True)
class Part:
    """One set of data among several."""

    name: str
    kind: Kind
    # candidates that are mistakes of this part alone: its sensors, its clock, its speed
    own: frozenset[str] = frozenset()
    # name of another thing than the first that was measured; its nuisances and candidates are ``THING/NAME``
    thing: str = ""
    common: frozenset[str] = frozenset()  # nuisances and candidates of such a part that all things share

    def called(self, name: str) -> str:
        """Name in the whole of a candidate or nuisance with this ``name`` here."""
        if name in self.own:
            return f"{self.name}{OF}{name}"
        return f"{self.thing}{OF}{name}" if self.thing and name not in self.common else name

    def here(self, whole: str) -> str | None:
        """Name here of a candidate called so in the ``whole``; None if it is of another part or thing."""
        owner, _, name = whole.rpartition(OF)
        if owner:
            return name if owner in (self.name, self.thing) else None
        return None if self.thing and whole not in self.common else whole

    def candidate(self, c: Candidate) -> Candidate:
        """The candidate ``c`` of this part as one of the whole."""
        identifier = self.called(c.identifier)
        owner = identifier.rpartition(OF)[0]
        words = f"{c.signature} ({owner})" if owner and c.signature else c.signature
        unknowns = tuple(self._unknown(u, owner) for u in c.unknowns)
        return replace(c, identifier=identifier, signature=words, unknowns=unknowns)

    def nuisance(self, u: UncertainParameter) -> UncertainParameter:
        """The nuisance ``u`` of this part as one of the whole."""
        name = self.called(u.name)
        return replace(self._unknown(u, name.rpartition(OF)[0]), name=name)

    def _unknown(self, u: UncertainParameter, owner: str) -> UncertainParameter:
        """An unknown of another thing sets numbers of that thing, never those of the first."""
        if not owner or owner != self.thing:
            return u
        return replace(u, sets={f"{owner}{OF}{key}": f for key, f in u.sets.items()})


@dataclass(frozen=True)
class Joint(Kind):
    """All ``parts`` at once."""

    parts: tuple[Part, ...] = field()
    said: tuple[str, ...] = ()
    _enabling: dict[tuple[int, frozenset[str]], frozenset[str]] = field(
        default_factory=dict, repr=False, compare=False, kw_only=True
    )

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts]
        if not names or len(set(names)) < len(names) or {part.thing for part in self.parts} & set(names):
            raise ValueError(f"parts {names}: give each a name of its own")
        for part in self.parts:
            for u in map(part.nuisance, part.kind.nuisances):
                other = self._nuisances[u.name]
                if (u.centre, u.scale) != (other.centre, other.scale):
                    raise ValueError(
                        f"{part.name}: {u.name} = {u.centre:g} +- {u.scale:g}, in another part {other.centre:g} +- "
                        f"{other.scale:g}; one thing has one prior"
                    )

    # ---- what is common ----

    @property
    def thorough(self) -> bool:  # type: ignore[override]
        """True if each part is cheap."""
        return all(part.kind.thorough for part in self.parts)

    @cached_property
    def _nuisances(self) -> dict[str, UncertainParameter]:
        return {u.name: u for part in reversed(self.parts) for u in map(part.nuisance, part.kind.nuisances)}

    @cached_property
    def nuisances(self) -> tuple[UncertainParameter, ...]:  # type: ignore[override]
        """Each once, in the order of the parts."""
        names = dict.fromkeys(part.called(u.name) for part in self.parts for u in part.kind.nuisances)
        return tuple(self._nuisances[name] for name in names)

    @cached_property
    def candidates(self) -> Candidates:  # type: ignore[override]
        """Each common one once, then those of the parts."""
        return self._collected(lambda kind: kind.candidates)

    @property
    def library(self) -> Candidates:
        return self._collected(lambda kind: kind.library)

    def _collected(self, of: Callable[[Kind], Iterable[Candidate]]) -> Candidates:
        every = self._once(of(part.kind) for part in self.parts)
        return tuple(sorted(every, key=lambda c: OF in c.identifier))

    def _once(self, each: Iterable[Iterable[Candidate]]) -> Candidates:
        found: dict[str, Candidate] = {}
        for part, some in zip(self.parts, each, strict=True):
            for c in map(part.candidate, some):
                found.setdefault(c.identifier, c)
        return tuple(found.values())

    @cached_property
    def refused(self) -> Mapping[str, str]:  # type: ignore[override]
        """Candidates that no part can try, and why."""
        tried = {c.identifier for c in self._collected(lambda kind: kind.candidates)}
        found: dict[str, str] = {}
        for part in self.parts:
            for name, why in part.kind.refused.items():
                if (called := part.called(name)) not in tried:
                    found.setdefault(called, why)
        return found

    @property
    def notes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Notes of all parts once, those of one part after its name."""
        said = [part.kind.notes for part in self.parts]
        every = [note for note in said[0] if all(note in notes for notes in said)]
        own = zip(self.parts, said, strict=True)
        alone = [f"{part.name}: {note}" for part, notes in own for note in notes if note not in every]
        return (*self.said, *every, *alone)

    @property
    def varied(self) -> bool:
        """True if one part alone is, or if two parts look at places that differ by 5 %."""
        if any(part.kind.varied for part in self.parts):
            return True
        places: dict[str, list[Array]] = {}
        for part in self.parts:
            places.setdefault(part.kind.rows.axis, []).append(part.kind.rows.abscissa)
        every = [np.concatenate(along) for along in places.values()]
        return any(bool(np.ptp(along) > 0.05 * np.abs(along).max()) for along in every)

    # ---- part by part ----

    def concerns(self, candidate: Candidate) -> bool:
        return any(part.here(candidate.identifier) is not None for part in self.parts)

    def restrict_to_part(self, number: int, candidates: Candidates) -> tuple[Candidates, NDArray[np.intp]]:
        part = self.parts[number]
        columns = {u.name: k for k, u in enumerate(self.nuisances)}
        places, kept, start = [columns[part.called(u.name)] for u in part.kind.nuisances], [], len(columns)
        known = {c.identifier: c for c in part.kind.candidates}
        acting = self._acting(number, candidates)
        for c in candidates:
            name = part.here(c.identifier)
            if name in acting:
                kept.append(known.get(name, replace(c, identifier=name)))
                places += range(start, start + len(c.unknowns))
            start += len(c.unknowns)
        return tuple(kept), np.array(places, dtype=np.intp)

    def _acting(self, number: int, candidates: Candidates) -> frozenset[str]:
        """Candidates that a part does not refuse, and those that they make possible; by its names."""
        part = self.parts[number]
        names = frozenset(name for c in candidates if (name := part.here(c.identifier)) is not None)
        refused = names.intersection(part.kind.refused)
        if not refused:
            return names
        key = number, names
        if key not in self._enabling:
            kept = tuple(c for c in part.kind.candidates if c.identifier in names)
            enabled = {c.identifier for c in part.kind.enabled_by(kept)}
            self._enabling[key] = (names - refused) | (refused & enabled)
        return self._enabling[key]

    def _each(self, candidates: Candidates, theta: Array) -> Iterator[tuple[Kind, Candidates, Array, NDArray[np.intp]]]:
        """Each part with the candidates and coordinates that act on it, and their places."""
        for number, part in enumerate(self.parts):
            kept, places = self.restrict_to_part(number, candidates)
            yield part.kind, kept, theta[places], places

    def slices(self) -> list[slice]:
        ends = np.cumsum([0, *(len(part.kind.rows.where) for part in self.parts)])
        return [slice(a, b) for a, b in pairwise(ends)]

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Rows of the parts below each other; a held-out fold is of one part."""
        every = [part.kind.rows for part in self.parts]
        shift = np.cumsum([0, *(rows.fold.max(initial=-1) + 1 for rows in every[:-1])])
        own = [np.empty((len(rows.where), 0)) if rows.inputs is None else rows.inputs for rows in every]
        inputs = block_diag(*own)
        named = [(part.name, rows) for part, rows in zip(self.parts, every, strict=True)]
        axes = {rows.axis for rows in every}
        shown = {
            f"{name}: {series}": replace(rows.show(series), channel=f"{name}: {rows.show(series).channel}")
            for name, rows in named
            for series in dict.fromkeys(rows.series)
        }
        return Rows(
            tuple(f"{name}: {where}" for name, rows in named for where in rows.where),
            np.concatenate([rows.abscissa for rows in every]),
            tuple(f"{name}: {series}" for name, rows in named for series in rows.series),
            np.concatenate([rows.fold + k for rows, k in zip(every, shift, strict=True)]),
            inputs if inputs.shape[1] else None,
            shown=shown,
            axis=axes.pop() if len(axes) == 1 else "",
        )

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        values, columns = [], []
        for kind, kept, own, places in self._each(candidates, theta):
            r, j = kind.residual(kept, own, slopes=slopes)
            values.append(r)
            columns.append(_widened(j, places, len(theta)) if slopes else np.empty((len(r), 0)))
        return np.concatenate(values), np.vstack(columns)

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        return sum(kind.log_determinant(kept, own) for kind, kept, own, _ in self._each(candidates, theta))

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        each = zip(self._each(candidates, theta), self.slices(), strict=True)
        return np.concatenate([kind.marginalise_noise(kept, own, white[rows]) for (kind, kept, own, _), rows in each])

    def marginalised_sizes(
        self, candidates: Candidates, theta: Array, name: str
    ) -> Mapping[str, tuple[float, float, str]]:
        each = zip(self.parts, self._each(candidates, theta), strict=True)
        found = [kind.marginalised_sizes(kept, own, part.here(name) or "") for part, (kind, kept, own, _) in each]
        return next(filter(None, found), {})

    def easier_problems(self) -> tuple["Joint", ...]:
        """Each part's easiest problem at once; empty if none has one."""
        led = [part.kind.easier_problems() for part in self.parts]
        if not any(led):
            return ()
        return (self._of(e[-1] if e else part.kind for part, e in zip(self.parts, led, strict=True)),)

    def _of(self, kinds: Iterable[Kind]) -> "Joint":
        """Joint of these parts with other ``kinds``, trying what this one tries; itself if these are its own."""
        parts = [p if p.kind is kind else replace(p, kind=kind) for p, kind in zip(self.parts, kinds, strict=True)]
        if all(new is old for new, old in zip(parts, self.parts, strict=True)):
            return self
        found, tried = replace(self, parts=tuple(parts)), {c.identifier for c in self.candidates}
        return found.with_candidates(tuple(c for c in found.candidates if c.identifier in tried))

    def thin(self, most: int) -> "Joint":
        return self._of(part.kind.thin(most // len(self.parts)) for part in self.parts)

    def simplify(self) -> "Joint":
        return self._of(part.kind.simplify() for part in self.parts)

    def misreadings(self) -> Iterator[tuple[str, Kind]]:
        """Readings of one part, the others as they stand."""
        for k, part in enumerate(self.parts):
            for what, kind in part.kind.misreadings():
                kinds = [kind if number == k else other.kind for number, other in enumerate(self.parts)]
                yield f"{part.name}: {what}", self._of(kinds)

    def estimate_noise(self, best: Any) -> "Joint":
        """Each part refined by its rows of the ``best`` fit."""
        each = zip(self.parts, self.slices(), strict=True)
        return self._of(part.kind.estimate_noise(SimpleNamespace(residual=best.residual[rows])) for part, rows in each)

    def compatible(self, candidates: Candidates) -> bool:
        return all(part.kind.compatible(self.restrict_to_part(k, candidates)[0]) for k, part in enumerate(self.parts))

    def enabled_by(self, candidates: Candidates) -> Candidates:
        return self._once(p.kind.enabled_by(self.restrict_to_part(k, candidates)[0]) for k, p in enumerate(self.parts))

    def empirical_terms(self) -> Candidates:
        return self._once(part.kind.empirical_terms() for part in self.parts)

    def directions(self) -> Candidates:
        return self._once(part.kind.directions() for part in self.parts)

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Proposals of the parts, each once."""
        found: dict[str, Proposal] = {}
        for number, part in enumerate(self.parts):
            for proposal in part.kind.propose_measurements():
                ask = partial(self._of_part, number)
                loose = proposal.loose and partial(ask, proposal.loose, slope=0)
                whole = replace(proposal, predict=partial(ask, proposal.predict, slope=1), loose=loose)
                found.setdefault(proposal.what, whole)
        return tuple(found.values())

    def _of_part(
        self,
        number: int,
        ask: Callable[[Candidates, Array], Prediction],
        candidates: Candidates,
        theta: Array,
        *,
        slope: int,
    ) -> Prediction:
        """The two arrays that a part answers, that with the number ``slope`` widened to all coordinates."""
        kept, places = self.restrict_to_part(number, candidates)
        found = list(ask(kept, theta[places]))
        found[slope] = _widened(found[slope], places, len(theta))
        return found[0], found[1]

    # ---- report ----

    @property
    def speeds(self) -> Array:
        """Speeds of all parts; empty if one has no motion."""
        every = [part.kind.speeds for part in self.parts]
        return np.concatenate(every) if all(len(one) for one in every) else np.zeros(0)

    def split_parts(self) -> Iterator[tuple[str, Kind, Kind]]:
        for part in self.parts:
            yield part.name, part.kind, Joint((part,))

    def select_parts(self, names: Sequence[str]) -> "Joint":
        return Joint(tuple(part for part in self.parts if part.name in names))

    def held_out_data(self) -> "Joint | None":
        unseen = [(part, part.kind.held_out_data()) for part in self.parts]
        parts = tuple(replace(part, kind=kind) for part, kind in unseen if kind is not None)
        return Joint(parts) if parts else None

    def find_mispairings(self, judgement: "Judgement") -> tuple[str, ...]:
        """Of each part, after its name."""
        found = []
        for number, part in enumerate(self.parts):
            found += [f"{part.name}: {text}" for text in part.kind.find_mispairings(self.view_part(judgement, number))]
        return tuple(found)

    def figures(self) -> dict[str, Figure]:
        """Figures of each part, such as ``gap_1``."""

        def of_part(figure: Figure, number: int, judgement: "Judgement", target: Path) -> bool:
            return figure[0](self.view_part(judgement, number), target)

        return {
            f"{name}_{number + 1}": (partial(of_part, figure, number), f"{part.name}: {figure[1]}")
            for number, part in enumerate(self.parts)
            for name, figure in part.kind.figures().items()
        }

    def view_part(self, judgement: "Judgement", number: int) -> "Judgement":
        """Restrict a judgement of all parts to the part with this ``number``."""
        whole, rows = judgement.kind, self.slices()[number]

        def restricted(f: Fit) -> Fit:
            kept, places = whole.restrict_to_part(number, f.candidates)
            return _FitOfPart(
                kept,
                tuple(f.unknowns[k] for k in places),
                f.theta[places],
                f.covariance[places][:, places],
                f.residual[rows],
                f.jacobian[rows][:, places],
                f.objective,
                f.log_evidence,
                f.nuisance_scale,
                f.converged,
                whole=f.name,
            )

        known = judgement.hypotheses
        null = restricted(known.null)
        final = null if judgement.final is known.null else restricted(judgement.final)
        return replace(
            judgement,
            kind=whole.parts[number].kind,
            hypotheses=replace(known, null=null),
            final=final,
            alone=judgement.alone and restricted(judgement.alone),
            nominal=judgement.nominal[rows],
        )


@dataclass(frozen=True)
class _FitOfPart(Fit):
    """A joint fit restricted to one part, under the name of the ``whole``."""

    whole: str = ""

    @property
    def name(self) -> str:
        return self.whole


def _widened(slopes: Array, places: NDArray[np.intp], width: int) -> Array:
    """The ``slopes`` (m, q) of a part at their ``places`` (q,) among all coordinates."""
    wide = np.zeros((len(slopes), width))
    wide[:, places] = slopes
    return wide
