"""Several measurements as one: common nuisances and effects, and errors of its own for each part.

Evidence adds up: parts are independent given the coordinates, so residuals are stacked and logarithms of
determinants add. An error of one part's sensors is named ``part/candidate``. Parts may be of several things: whatever
these do not share is named ``thing/name``.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import block_diag

from studies.inference.fit import Fit
from studies.inference.kind import Candidates, Figure, Kind, Prediction, Proposal, Rows, Series
from studies.inference.last_answer import RecentAnswers
from studies.inference.parameter import Array, Candidate, UncertainParameter

if TYPE_CHECKING:
    from studies.inference.judge import Judgement

OF = "/"  # between a part, or a thing, and its own


@dataclass(frozen=True)
class Part:
    """One set of data among several."""

    name: str  # as the file calls it; no two parts have the same
    kind: Kind  # its data and physics, in its own names
    # identifiers of candidates that are errors of this part alone: its sensors, its clock, its speed
    own: frozenset[str] = frozenset()
    # name of another thing than the first that was measured; its nuisances and candidates are ``THING/NAME``
    thing: str = ""
    common: frozenset[str] = frozenset()  # names of nuisances and candidates of such a part that all things share

    def joint_name(self, name: str) -> str:
        """Name in the joint data of a candidate or nuisance that the part calls ``name``."""
        if name in self.own:
            return f"{self.name}{OF}{name}"
        return f"{self.thing}{OF}{name}" if self.thing and name not in self.common else name

    def part_name(self, joint_name: str) -> str | None:
        """Name in the part of the candidate called ``joint_name`` in the joint data; None if it is of another part."""
        owner, _, name = joint_name.rpartition(OF)
        if owner:
            return name if owner in (self.name, self.thing) else None
        return None if self.thing and joint_name not in self.common else joint_name

    def candidate(self, c: Candidate) -> Candidate:
        """Copy of the candidate ``c`` of this part under its name, words and parameters in the joint data."""
        identifier = self.joint_name(c.identifier)
        owner = identifier.rpartition(OF)[0]
        words = f"{c.signature} ({owner})" if owner and c.signature else c.signature
        unknowns = tuple(self._unknown(u, owner) for u in c.unknowns)
        return replace(c, identifier=identifier, signature=words, unknowns=unknowns)

    def nuisance(self, u: UncertainParameter) -> UncertainParameter:
        """Copy of the nuisance ``u`` of this part under its name and parameters in the joint data."""
        name = self.joint_name(u.name)
        return replace(self._unknown(u, name.rpartition(OF)[0]), name=name)

    def _unknown(self, u: UncertainParameter, owner: str) -> UncertainParameter:
        """Copy of ``u`` that sets parameters of its ``owner`` if that is another thing than the first; else ``u``."""
        if not owner or owner != self.thing:
            return u
        return replace(u, sets={f"{owner}{OF}{key}": f for key, f in u.sets.items()})


@dataclass(frozen=True)
class Joint(Kind):
    """Several measurements fitted at once."""

    parts: tuple[Part, ...] = field()  # the sets of data, in the order of the file
    joint_notes: tuple[str, ...] = ()  # notes on the whole, for the report
    # identifiers of the candidates that are tried; None for all candidates of the parts
    tried: frozenset[str] | None = field(default=None, kw_only=True)

    def __post_init__(self) -> None:
        names = [part.name for part in self.parts]
        if not names or len(set(names)) < len(names) or {part.thing for part in self.parts} & set(names):
            raise ValueError(f"parts {names}: give each a name of its own")
        for part in self.parts:
            for u in map(part.nuisance, part.kind.nuisances):
                first = self._nuisances[u.name]
                if (u.centre, u.scale) != (first.centre, first.scale):
                    raise ValueError(
                        f"{part.name}: {u.name} = {u.centre:g} +- {u.scale:g}, in another part {first.centre:g} +- "
                        f"{first.scale:g}; one thing has one prior"
                    )

    # ---- what is common ----

    @property
    def thorough(self) -> bool:  # type: ignore[override]
        """True if each part is cheap enough to begin each fit from several starts."""
        return all(part.kind.thorough for part in self.parts)

    @cached_property
    def _nuisances(self) -> dict[str, UncertainParameter]:
        """Nuisances by their joint names, each as the first part that has it declares it."""
        return {u.name: u for part in reversed(self.parts) for u in map(part.nuisance, part.kind.nuisances)}

    @cached_property
    def nuisances(self) -> tuple[UncertainParameter, ...]:  # type: ignore[override]
        """Nuisances under their joint names, each once, in the order of the parts."""
        names = dict.fromkeys(part.joint_name(u.name) for part in self.parts for u in part.kind.nuisances)
        return tuple(self._nuisances[name] for name in names)

    @cached_property
    def candidates(self) -> Candidates:  # type: ignore[override]
        """Candidates that are tried: each common one once, then those of single parts."""
        candidates = self._collect_candidates(lambda kind: kind.candidates)
        return candidates if self.tried is None else tuple(c for c in candidates if c.identifier in self.tried)

    def with_candidates(self, candidates: Candidates) -> Self:
        return replace(self, tried=frozenset(c.identifier for c in candidates))

    @property
    def library(self) -> Candidates:
        """Candidates among which the prior probability is shared: each common one once, then those of single parts."""
        return self._collect_candidates(lambda kind: kind.library)

    def _collect_candidates(self, candidates_of: Callable[[Kind], Iterable[Candidate]]) -> Candidates:
        """Candidates that ``candidates_of`` gives for the parts, each once; those that all parts share come first."""
        merged = self._merge(candidates_of(part.kind) for part in self.parts)
        return tuple(sorted(merged, key=lambda c: OF in c.identifier))

    def _merge(self, candidates_by_part: Iterable[Iterable[Candidate]]) -> Candidates:
        """Candidates of each part, in the order of the parts, under their joint names and each once."""
        merged: dict[str, Candidate] = {}
        for part, candidates in zip(self.parts, candidates_by_part, strict=True):
            for c in map(part.candidate, candidates):
                merged.setdefault(c.identifier, c)
        return tuple(merged.values())

    @cached_property
    def refused(self) -> Mapping[str, str]:  # type: ignore[override]
        """Reasons by the joint names of the candidates that no part can try."""
        possible = {c.identifier for c in self._collect_candidates(lambda kind: kind.candidates)}
        reasons: dict[str, str] = {}
        for part in self.parts:
            for name, reason in part.kind.refused.items():
                joint_name = part.joint_name(name)
                if joint_name not in possible:
                    reasons.setdefault(joint_name, reason)
        return reasons

    @property
    def notes(self) -> tuple[str, ...]:  # type: ignore[override]
        """Notes on the whole, then those that all parts have, then those of single parts, after the part's name."""
        notes_by_part = [part.kind.notes for part in self.parts]
        shared = [note for note in notes_by_part[0] if all(note in notes for notes in notes_by_part)]
        single = [f"{part.name}: {note}" for part in self.parts for note in part.kind.notes if note not in shared]
        return (*self.joint_notes, *shared, *single)

    @property
    def varied(self) -> bool:
        """True if one part alone is varied, or if abscissae of the same quantity differ by 5 % between the parts."""
        if any(part.kind.varied for part in self.parts):
            return True
        places: dict[str, list[Array]] = {}
        for part in self.parts:
            places.setdefault(part.kind.rows.axis, []).append(part.kind.rows.abscissa)
        abscissae = [np.concatenate(arrays) for arrays in places.values()]
        return any(bool(np.ptp(x) > 0.05 * np.abs(x).max()) for x in abscissae)

    # ---- part by part ----

    def concerns(self, candidate: Candidate) -> bool:
        """True if the ``candidate`` acts on one part at least."""
        return any(part.part_name(candidate.identifier) is not None for part in self.parts)

    def restrict_to_part(self, number: int, candidates: Candidates) -> tuple[Candidates, NDArray[np.intp]]:
        """Candidates in the names of part ``number`` that act on it, and the indices (q,) of its coordinates."""
        part = self.parts[number]
        columns = {u.name: k for k, u in enumerate(self.nuisances)}
        places = [columns[part.joint_name(u.name)] for u in part.kind.nuisances]
        part_candidates = {c.identifier: c for c in part.kind.candidates}
        acting = self._find_acting(number, candidates)
        restricted = []
        start = len(columns)
        for c in candidates:
            name = part.part_name(c.identifier)
            if name in acting:
                restricted.append(part_candidates.get(name, replace(c, identifier=name)))
                places += range(start, start + len(c.unknowns))
            start += len(c.unknowns)
        return tuple(restricted), np.array(places, dtype=np.intp)

    def _find_acting(self, number: int, candidates: Candidates) -> frozenset[str]:
        """Names in part ``number`` of ``candidates`` that it does not refuse or that the others make possible."""
        part = self.parts[number]
        names = frozenset(name for c in candidates if (name := part.part_name(c.identifier)) is not None)
        refused_names = names.intersection(part.kind.refused)
        if not refused_names:
            return names

        def find_enabled() -> frozenset[str]:
            present = tuple(c for c in part.kind.candidates if c.identifier in names)
            return frozenset(c.identifier for c in part.kind.enabled_by(present))

        return (names - refused_names) | (refused_names & self._recently_enabled.get((number, names), find_enabled))

    @cached_property
    def _recently_enabled(self) -> RecentAnswers[frozenset[str]]:
        """Names that candidates make possible in a part: a fit asks for the same ones at every step."""
        return RecentAnswers(10_000)

    def _restrict_all(
        self, candidates: Candidates, theta: Array
    ) -> Iterator[tuple[Kind, Candidates, Array, NDArray[np.intp]]]:
        """For each part its kind, candidates and coordinates (q,) that act on it, their indices in ``theta`` (p,)."""
        for number, part in enumerate(self.parts):
            restricted, places = self.restrict_to_part(number, candidates)
            yield part.kind, restricted, theta[places], places

    def slices(self) -> list[slice]:
        """Slice of the rows of each part."""
        ends = np.cumsum([0, *(len(part.kind.rows.places) for part in self.parts)])
        return [slice(a, b) for a, b in pairwise(ends)]

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """Rows of the parts below each other; a held-out fold is of one part."""
        places: list[str] = []
        names: list[str] = []
        folds: list[NDArray[np.intp]] = []
        inputs_by_part: list[Array] = []
        displays: dict[str, Series] = {}
        next_fold = 0
        for part in self.parts:
            rows = part.kind.rows
            places += [f"{part.name}: {place}" for place in rows.places]
            names += [f"{part.name}: {series}" for series in rows.series]
            folds.append(rows.fold + next_fold)
            next_fold += int(rows.fold.max(initial=-1)) + 1
            inputs_by_part.append(np.empty((len(rows.places), 0)) if rows.inputs is None else rows.inputs)
            for series in dict.fromkeys(rows.series):
                display = rows.show(series)
                displays[f"{part.name}: {series}"] = replace(display, channel=f"{part.name}: {display.channel}")
        inputs = block_diag(*inputs_by_part)
        axes = {part.kind.rows.axis for part in self.parts}
        return Rows(
            tuple(places),
            np.concatenate([part.kind.rows.abscissa for part in self.parts]),
            tuple(names),
            np.concatenate(folds),
            inputs if inputs.shape[1] else None,
            displays=displays,
            axis=axes.pop() if len(axes) == 1 else "",
        )

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> Prediction:
        values, derivatives = [], []
        for kind, acting, coordinates, places in self._restrict_all(candidates, theta):
            r, j = kind.residual(acting, coordinates, slopes=slopes)
            values.append(r)
            derivatives.append(_spread_columns(j, places, len(theta)) if slopes else np.empty((len(r), 0)))
        return np.concatenate(values), np.vstack(derivatives)

    def log_determinant(self, candidates: Candidates, theta: Array) -> float:
        parts = self._restrict_all(candidates, theta)
        return sum(kind.log_determinant(acting, coordinates) for kind, acting, coordinates, _ in parts)

    def marginalise_noise(self, candidates: Candidates, theta: Array, white: Array) -> Array:
        noise = []
        for part, rows in zip(self._restrict_all(candidates, theta), self.slices(), strict=True):
            kind, acting, coordinates, _ = part
            noise.append(kind.marginalise_noise(acting, coordinates, white[rows]))
        return np.concatenate(noise)

    def marginalised_sizes(
        self, candidates: Candidates, theta: Array, name: str
    ) -> Mapping[str, tuple[float, float, str]]:
        """Value, sd and unit of each number marginalised for the candidate ``name``, by the first part with any."""
        for part, (kind, acting, coordinates, _) in zip(self.parts, self._restrict_all(candidates, theta), strict=True):
            sizes = kind.marginalised_sizes(acting, coordinates, part.part_name(name) or "")
            if sizes:
                return sizes
        return {}

    def easier_problems(self) -> tuple["Joint", ...]:
        """Joint problem made of each part's last one, or of the part itself; empty if no part has any."""
        problems = [part.kind.easier_problems() for part in self.parts]
        if not any(problems):
            return ()
        easiest = (p[-1] if p else part.kind for part, p in zip(self.parts, problems, strict=True))
        return (self._with_kinds(easiest),)

    def _with_kinds(self, kinds: Iterable[Kind]) -> "Joint":
        """Copy whose parts have these ``kinds`` and that tries the same candidates; itself if nothing changes."""
        parts = [p if p.kind is kind else replace(p, kind=kind) for p, kind in zip(self.parts, kinds, strict=True)]
        if all(new is old for new, old in zip(parts, self.parts, strict=True)):
            return self
        return replace(self, parts=tuple(parts), tried=frozenset(c.identifier for c in self.candidates))

    def thin(self, most: int) -> "Joint":
        """Copy with about ``most`` of the data, each part an equal number; itself if that changes no part."""
        return self._with_kinds(part.kind.thin(most // len(self.parts)) for part in self.parts)

    def simplify(self) -> "Joint":
        """Copy whose parts are problems for a first look."""
        return self._with_kinds(part.kind.simplify() for part in self.parts)

    def misreadings(self) -> Iterator[tuple[str, Kind]]:
        """Pairs of another reading of one part's data, in words, and the joint data read so, other parts unchanged."""
        for k, misread in enumerate(self.parts):
            for reading, kind in misread.kind.misreadings():
                kinds = [kind if number == k else part.kind for number, part in enumerate(self.parts)]
                yield f"{misread.name}: {reading}", self._with_kinds(kinds)

    def estimate_noise(self, best: Any) -> "Joint":
        """Copy whose parts estimate their noise, each from its own rows of ``best.residual`` (n,)."""
        kinds = []
        for part, rows in zip(self.parts, self.slices(), strict=True):
            kinds.append(part.kind.estimate_noise(SimpleNamespace(residual=best.residual[rows])))
        return self._with_kinds(kinds)

    def compatible(self, candidates: Candidates) -> bool:
        """True if these ``candidates`` can be in one model, by every part."""
        return all(part.kind.compatible(self.restrict_to_part(k, candidates)[0]) for k, part in enumerate(self.parts))

    def enabled_by(self, candidates: Candidates) -> Candidates:
        """Further candidates that ``candidates`` make possible in any part, each once."""
        return self._merge(p.kind.enabled_by(self.restrict_to_part(k, candidates)[0]) for k, p in enumerate(self.parts))

    def empirical_terms(self) -> Candidates:
        """Terms of all parts without a physical cause, each once."""
        return self._merge(part.kind.empirical_terms() for part in self.parts)

    def directions(self) -> Candidates:
        """Terms of all parts for which the remainder of a hypothesis is tested, each once."""
        return self._merge(part.kind.directions() for part in self.parts)

    def propose_measurements(self) -> tuple[Proposal, ...]:
        """Further measurements that the parts propose, each once, as functions of the joint coordinates."""
        proposals: dict[str, Proposal] = {}
        for number, part in enumerate(self.parts):
            for proposal in part.kind.propose_measurements():
                predict = partial(self._predict_for_part, number, proposal.predict, slope=1)
                inner = proposal.inner and partial(self._predict_for_part, number, proposal.inner, slope=0)
                proposals.setdefault(proposal.what, replace(proposal, predict=predict, inner=inner))
        return tuple(proposals.values())

    def _predict_for_part(
        self,
        number: int,
        predict: Callable[[Candidates, Array], Prediction],
        candidates: Candidates,
        theta: Array,
        *,
        slope: int,
    ) -> Prediction:
        """The two arrays of ``predict`` for part ``number``; derivatives, the array ``slope``, by all p coordinates."""
        acting, places = self.restrict_to_part(number, candidates)
        arrays = list(predict(acting, theta[places]))
        arrays[slope] = _spread_columns(arrays[slope], places, len(theta))
        return arrays[0], arrays[1]

    # ---- report ----

    @property
    def speeds(self) -> Array:
        """Measured speeds of all parts, m/s; empty if one part has no motion."""
        speeds = [part.kind.speeds for part in self.parts]
        return np.concatenate(speeds) if all(len(v) for v in speeds) else np.zeros(0)

    def split_parts(self) -> Iterator[tuple[str, Kind, Kind]]:
        """Triples, one for each part: its name, its kind, and joint data of this part alone."""
        for part in self.parts:
            yield part.name, part.kind, Joint((part,))

    def select_parts(self, names: Sequence[str]) -> "Joint":
        """Joint data of the parts with these ``names`` only, all their candidates tried."""
        return Joint(tuple(part for part in self.parts if part.name in names))

    def held_out_data(self) -> "Joint | None":
        """Joint data of the parts that have data never fitted; None if none has any."""
        held_out = [(part, part.kind.held_out_data()) for part in self.parts]
        parts = tuple(replace(part, kind=kind) for part, kind in held_out if kind is not None)
        return Joint(parts) if parts else None

    def find_mispairings(self, judgement: "Judgement") -> tuple[str, ...]:
        """Sentences about data compared with another mode or channel than named, each after the part's name."""
        sentences = []
        for number, part in enumerate(self.parts):
            in_part = part.kind.find_mispairings(self.view_part(judgement, number))
            sentences += [f"{part.name}: {sentence}" for sentence in in_part]
        return tuple(sentences)

    def figures(self) -> dict[str, Figure]:
        """Figures of each part by name and number of the part, such as ``gap_1``."""

        def draw_part(figure: Figure, number: int, judgement: "Judgement", target: Path) -> bool:
            return figure[0](self.view_part(judgement, number), target)

        figures: dict[str, Figure] = {}
        for number, part in enumerate(self.parts):
            for name, figure in part.kind.figures().items():
                figures[f"{name}_{number + 1}"] = partial(draw_part, figure, number), f"{part.name}: {figure[1]}"
        return figures

    def view_part(self, judgement: "Judgement", number: int) -> "Judgement":
        """The ``judgement`` of all parts restricted to the part with this ``number``."""
        whole, rows = judgement.kind, self.slices()[number]

        def restrict(f: Fit) -> Fit:
            acting, places = whole.restrict_to_part(number, f.candidates)
            return _FitOfPart(
                acting,
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

        hypotheses = judgement.hypotheses
        null = restrict(hypotheses.null)
        final = null if judgement.final is hypotheses.null else restrict(judgement.final)
        return replace(
            judgement,
            kind=whole.parts[number].kind,
            hypotheses=replace(hypotheses, null=null),
            final=final,
            alone=judgement.alone and restrict(judgement.alone),
            nominal=judgement.nominal[rows],
        )


@dataclass(frozen=True)
class _FitOfPart(Fit):
    """A joint fit restricted to one part, under its name in the joint data."""

    whole: str = ""  # name of the joint fit, identifiers joined by +

    @property
    def name(self) -> str:
        return self.whole


def _spread_columns(slopes: Array, places: NDArray[np.intp], width: int) -> Array:
    """Derivatives (m, width) by all coordinates: ``slopes`` (m, q) in the columns ``places`` (q,), zero elsewhere."""
    wide = np.zeros((len(slopes), width))
    wide[:, places] = slopes
    return wide
