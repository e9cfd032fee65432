"""Joint data: of a bicycle, of its tyre on a rig, of several bicycles with one tyre.

Parameters and effects of one bicycle are common to its parts, sensors are each part's own. Several bicycles share their
tyre: effects of :func:`tyre_effects`, unless the file says otherwise. A stiffness in N/rad is then one number in
proportion to the static load; of a tyre of the base models they share the departure from its stated numbers.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, ClassVar, Self

from bicycle.effects.effect_registry import registry
from bicycle.model.model import Model
from bicycle.model.model_file import build_model
from studies.diagnosis.bicycle_kind import build_corrected_model
from studies.diagnosis.candidates import nuisances
from studies.diagnosis.measurement_file import PARTS, flat_uncertainty, read_kind
from studies.diagnosis.rig_numbers import ALIGNING, CONTACT
from studies.inference.fit import Fit
from studies.inference.joint import OF, Joint, Part
from studies.inference.kind import Kind
from studies.inference.parameter import Candidate, UncertainParameter
from tyre.ground.errors import InputError, refuse_unknown
from tyre.ground.schema import any_table, anything, flag, maybe, needed, read, refusal, table, text
from tyre.measured.plausible import WAY_OUT

MARKS = (OF, ".", "+")  # between a part and its sensors, an effect and its parameter, two effects
OWN_BICYCLE = ("bicycle", "effects", WAY_OUT, "uncertainty")


def tyre_effects() -> tuple[str, ...]:
    """Effects that are the tyre's: contact laws, aligning moments, and any that takes a value from a tyre."""
    effects = registry().items()
    return tuple(name for name, e in effects if e.slot in (CONTACT, ALIGNING) or any(p.tyre for p in e.parameters))


@dataclass(frozen=True, kw_only=True)
class JointData(Joint, kind="joint"):
    """Several measurements with the base model of the first bicycle."""

    of_bicycle: ClassVar[bool] = True
    whole: ClassVar[bool] = True
    name: str = field()  # the file's name
    model: Model = field()  # base model of the bicycle at the top of the file
    uncertainty: Mapping[str, float] = field(default_factory=dict)  # as of a single measurement
    known: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)  # as of a single measurement
    description: str = ""  # words of the file
    source: str = ""  # words of the file: who measured, and where it was published
    common: tuple[str, ...] = ()  # effects that all bicycles share; those of :func:`tyre_effects` if none are given

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "JointData":
        """Read ``content["part"]`` and ``content["common"]`` of a whole file."""
        if "part" not in content:
            raise InputError(f"kind is 'joint' but there is no part: {PARTS}")
        if len(content["part"]) < 2:
            raise InputError(
                f"there is one [[part]] only: {PARTS}; of one set of data, write its kind at the top and its table "
                'without "part."'
            )
        tables = dict.fromkeys(part_kind.table for part_kind in Kind.part.values())
        if stray := [name for name in tables if name in content]:
            raise InputError(
                f"kind is 'joint' but there is a table [{stray[0]}] at the top; write it as [part.{stray[0]}]"
            )
        parts: dict[str, Part] = {}
        for number, entry in enumerate(content["part"], 1):
            part = _read_part(entry, number, content, folder, common)
            if part.name in parts:
                raise InputError(f"[[part]]: {part.name!r} is given twice; give each part a name of its own")
            parts[part.name] = part
        things = {part.thing for part in parts.values()} - {""}
        if all(part.thing for part in parts.values()):
            raise InputError("every [[part]] has a bicycle of its own; one at least must be of the bicycle at the top")
        if ambiguous := things & set(parts):
            name = ambiguous.pop()
            raise InputError(f"[[part]]: {name!r} is the name of a part and of a bicycle; call the part otherwise")
        if "common" in content:
            if not things:
                raise InputError("common: all parts are of one bicycle, which shares everything; take it out")
            refuse_unknown("effect", content["common"], registry(), where="common")
        return cls(**common, parts=tuple(parts.values()), common=tuple(content.get("common", ())))

    @property
    def shared(self) -> tuple[str, ...]:
        """Effects that all bicycles share."""
        return self.common or tyre_effects()

    def prepare(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Self:
        """All parts with candidates; names of one part, or one bicycle, are ``PART/NAME`` or ``BICYCLE/NAME``."""
        names_by_part = {part.name: part.kind.names() for part in self.parts}
        known_names = {name for names in names_by_part.values() for name in names}
        for part in self.parts:
            for owner in _owners(part):
                known_names |= {f"{owner}{OF}{name}" for name in names_by_part[part.name]}
        for option, chosen in (("--without", without), ("--with", also)):
            refuse_unknown("effect", chosen, known_names, where=option)
        excluded = (name for part in self.parts for name in part.kind.excludes)
        without = tuple(dict.fromkeys((*without, *excluded)))

        def prepare_part(part: Part, owners: Iterable[str]) -> Any:
            left_out, asked_for = (_concerning(owners, names_by_part[part.name], chosen) for chosen in (without, also))
            return part.kind.prepare(without=left_out, also=asked_for)

        first = next(part for part in self.parts if not part.thing)
        parts: list[Part] = []
        for part in self.parts:
            mistakes = frozenset(c.identifier for c in part.kind.mistakes() if c.mistake)
            kind = prepare_part(part, _owners(part))
            if part.thing:
                common = {u.name for u in kind.nuisances if u.name.split(".")[0] in self.shared}
                kind = _as_of(prepare_part(first, (first.name,)), kind, self.shared)
                parts.append(replace(part, kind=kind, own=mistakes, common=frozenset({*self.shared, *common})))
            else:
                parts.append(replace(part, kind=kind, own=mistakes))
        other_things = ", ".join(dict.fromkeys(part.thing for part in self.parts if part.thing))
        note = (
            f"several bicycles: {self.model.bicycle.name} and {other_things}; common to all of them: "
            f"{', '.join(self.shared)}; everything else of another bicycle is its own and called BICYCLE/NAME"
        )
        try:
            return replace(self, parts=tuple(parts), joint_notes=(note,) if other_things else ())
        except ValueError as error:
            raise InputError(f"[[part]]: {error}") from error

    def with_model(self, model: Model) -> Self:
        """All parts of the first bicycle with another base ``model``."""
        parts = tuple(part if part.thing else replace(part, kind=part.kind.with_model(model)) for part in self.parts)
        return replace(self, model=model, parts=parts)

    def corrected_model(self, final: Fit) -> Model:
        return build_corrected_model(self.model, final)

    def bicycles(self, final: Fit) -> dict[str, tuple[Kind, Fit]]:
        fits: dict[str, tuple[Kind, Fit]] = {"": (self, _of_first(final))}
        for called in dict.fromkeys(part.thing for part in self.parts if part.thing):
            floating: dict[str, tuple[UncertainParameter, int]] = {}
            acting: dict[str, tuple[Candidate, list[int]]] = {}
            first: Kind | None = None
            for number, part in enumerate(self.parts):
                if part.thing != called:
                    continue
                first = first or part.kind
                candidates, places = self.restrict_to_part(number, final.candidates)
                position = iter(places.tolist())
                floating |= {u.name: (u, next(position)) for u in part.kind.nuisances}
                acting |= {c.identifier: (c, [next(position) for _ in c.unknowns]) for c in candidates}
            assert first is not None
            fits[called] = first, _select_unknowns(final, floating.values(), acting.values())
        return fits


def _owners(part: Part) -> tuple[str, ...]:
    return (part.name, part.thing) if part.thing else (part.name,)


def _concerning(owners: Iterable[str], part_names: Iterable[str], names: tuple[str, ...]) -> tuple[str, ...]:
    """Names ``names`` that are meant for a part: its own after ``PART/``, and those that it knows."""
    prefixed = [name.removeprefix(owner + OF) for owner in owners for name in names if name.startswith(owner + OF)]
    return (*prefixed, *(name for name in names if name in part_names))


# ---- reading ----


def _part_table() -> Any:
    """Schema of one table [[part]]."""
    allowed = ", ".join(map(repr, Kind.part))
    unknown_kind = f"is not allowed in [[part]]; write one of {allowed}"
    tables = dict.fromkeys(part_kind.table for part_kind in Kind.part.values())
    return table(
        {
            needed("name", f"a part without a name; {PARTS}"): _name,
            needed("kind", f"a part without a kind; {PARTS}"): text(unknown_kind, allowed=Kind.part),
            maybe("bicycle"): anything,
            maybe("effects"): any_table,
            maybe(WAY_OUT): flag,
            maybe("uncertainty"): any_table,
        }
        | dict.fromkeys(map(maybe, tables), any_table)
    )


def _name(value: Any) -> Any:
    if not isinstance(value, str) or not value.strip() or any(mark in value for mark in MARKS):
        raise refusal(value, f"must be a name in quotes without {', '.join(map(repr, MARKS))}, which join names")
    return value


def _read_part(entry: Any, number: int, whole: Mapping[str, Any], folder: Path, common: Mapping[str, Any]) -> Part:
    """Read one table [[part]], with its own bicycle if it has one; errors name the part."""
    part = read(_part_table(), entry, section=f"part {number}")
    name = part["name"]
    extra = [key for key in OWN_BICYCLE if key in part]
    try:
        if "bicycle" in part:
            common = _other_bicycle(part, whole, folder, common)
        elif extra:
            raise InputError(f"{extra[0]} belongs to a bicycle; give the part a bicycle, or write it at the top")
        kind = read_kind(Kind.part[part["kind"]], part, folder, common)
    except InputError as error:
        raise InputError(f"part {name!r}: {error}") from error
    if "bicycle" not in part:
        return Part(name, kind)
    bicycle_name = Path(part["bicycle"]).stem if isinstance(part["bicycle"], str) else f"bicycle of {name}"
    return Part(name, kind, thing=bicycle_name.translate(dict.fromkeys(map(ord, MARKS), "_")))


def _other_bicycle(
    part: Mapping[str, Any], whole: Mapping[str, Any], folder: Path, common: Mapping[str, Any]
) -> dict[str, Any]:
    """Common fields but for the bicycle: its effects are those at the top unless the part has them."""
    if part["bicycle"] == whole.get("bicycle"):
        raise InputError("bicycle is the one at the top; leave it out")
    effects = {**whole.get("effects", {}), **part.get("effects", {})}
    content = {"bicycle": part["bicycle"], "effects": effects}
    if WAY_OUT in part:
        content[WAY_OUT] = part[WAY_OUT]
    model = build_model(content, folder=folder)
    of_effects = {key: sd for key, sd in common["uncertainty"].items() if "." in key}
    uncertainty = of_effects | flat_uncertainty(part.get("uncertainty", {}))
    nuisances(model, uncertainty)  # complains here, where the part is known
    return {**common, "model": model, "uncertainty": uncertainty}


# ---- several bicycles ----


def _of_first(final: Fit) -> Fit:
    """Part of a ``final`` fit that is of the first bicycle: without effects that are another's own."""
    candidates = [c for c in final.candidates if c.effect is None or OF not in c.identifier]
    floating = [(u, k) for k, u in enumerate(final.unknowns[: final.effect_columns.start])]
    return _select_unknowns(
        final, floating, [(c, list(range(*final.columns(c).indices(len(final.theta))))) for c in candidates]
    )


def _select_unknowns(
    final: Fit, nuisances: Iterable[tuple[UncertainParameter, int]], candidates: Iterable[tuple[Candidate, list[int]]]
) -> Fit:
    """A ``final`` fit with only these unknowns, each with its places among the coordinates."""
    floating, acting = list(nuisances), list(candidates)
    places = [*(k for _, k in floating), *(k for _, columns in acting for k in columns)]
    return replace(
        final,
        candidates=tuple(c for c, _ in acting),
        theta=final.theta[places],
        unknowns=(*(u for u, _ in floating), *(u for c, _ in acting for u in c.unknowns)),
        covariance=final.covariance[places][:, places],
        jacobian=final.jacobian[:, places],
    )


def _as_of(first: Any, other_kind: Any, shared: tuple[str, ...]) -> Kind:
    """Another bicycle's kind whose shared effects have the coordinates and priors of those of the ``first`` one."""
    heavier = sum(other_kind.model.bicycle.static_loads) / sum(first.model.bicycle.static_loads)
    first_candidates = {c.identifier: c for c in first.candidates}
    first_nuisances = {u.name: u for u in first.nuisances}

    def scaled(u: UncertainParameter, unknown: UncertainParameter, factor: float) -> UncertainParameter:
        return replace(u, sets={key: factor * share for key, share in unknown.sets.items()})

    def alike(c: Candidate) -> Candidate:
        if c.identifier not in shared or c.identifier not in first_candidates:
            return c
        pairs = zip(first_candidates[c.identifier].unknowns, c.unknowns, strict=True)
        # a stiffness in N/rad is in proportion to the static load
        return replace(
            c, unknowns=tuple(scaled(u, unknown, heavier if u.unit == "N/rad" else 1.0) for u, unknown in pairs)
        )

    def relative(unknown: UncertainParameter) -> UncertainParameter:
        if unknown.name.split(".")[0] not in shared or unknown.name not in first_nuisances:
            return unknown
        u = first_nuisances[unknown.name]
        return scaled(u, unknown, unknown.centre / u.centre if u.centre else 1.0)

    changed: Kind = replace(
        other_kind,
        candidates=tuple(map(alike, other_kind.candidates)),
        nuisances=tuple(map(relative, other_kind.nuisances)),
    )
    return changed
