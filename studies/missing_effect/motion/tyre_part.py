"""What a rig says of the tyres of a bicycle: slip compliance, relaxation length and trail, with covariance.

The rig's fit is a normal distribution of these numbers at the static load and the pressure of each wheel; their
departure from what the model has, whitened, is what is fitted. Rolling without slip has no slip compliance and no
relaxation length, side slip no relaxation length: the rig speaks against such a model as loud as it measured.
"""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bicycle.effect import WHEELS, registry
from bicycle.files.wheel_tyres import EXTRAPOLATE, joint_wheel_tyres, tyre_file, tyre_notes
from bicycle.model import Model
from bicycle.parameters import Bicycle
from studies.inference.forward import Rows, Series
from studies.inference.parameter import Candidate, central_differences
from studies.missing_effect.motion.bicycle_forward import BicycleForward
from tyre.base.arrays import Array
from tyre.base.checks import anything, flag, text
from tyre.base.errors import InputError
from tyre.base.schema import maybe, needed, read, table
from tyre.base.units import PASCAL_PER_BAR
from tyre.campaigns.campaign import fit_campaign
from tyre.campaigns.export import measured_tables
from tyre.campaigns.summary import FitSettings
from tyre.joint_properties import JointProperties
from tyre.maps.tyre_map import TyreMap

EXAMPLE = 'write tyre = "TABLE.csv" (or recordings = "FOLDER") and pressure_bar'
RIG = table(
    {
        maybe("tyre"): anything, maybe("surface"): text("must be 'flat' or 'drum'", allowed=("flat", "drum")),
        maybe("recordings"): text("must be a folder in quotes", blank=False),
        needed("pressure_bar", f"pressure_bar is missing; {EXAMPLE}"): anything,
        maybe(EXTRAPOLATE, False): flag, maybe("trail", True): flag,
    }
)  # fmt: skip
EXACT = 1e-3  # relative sd that is added to each number: two wheels at one condition say the same thing once
SOFTEST = 1.0  # N/rad: a tyre that holds less is none, and its compliance stays a number
COMPLIANCE, LENGTH, TRAIL = "slip compliance", "relaxation length", "pneumatic trail"
CONTACT, ALIGNING, STIFFNESS = "contact law", "aligning moment", "aligning_stiffness"  # slots, number of a tyre
UNITS = {COMPLIANCE: "rad/N", LENGTH: "m", TRAIL: "m"}


@dataclass(frozen=True)
class TyreNumbers:
    """What the rig says.

    Attributes
    ----------
    names : tuple of (str, str)
        Quantity and wheel of each number.
    values : ndarray, shape (n,)
        SI units.
    covariance : ndarray, shape (n, n)
    load : float
        Mean of the wheels, N.
    pressures : tuple of float
        Of rear and front, Pa.
    """

    names: tuple[tuple[str, str], ...]
    values: Array
    covariance: Array
    load: float
    pressures: tuple[float, ...]

    @classmethod
    def of_wheels(cls, tyres: JointProperties, *, trail: bool) -> "TyreNumbers":
        """The numbers of rear and front ``tyres``, with the ``trail`` where it was measured and is wanted."""
        names: list[tuple[str, str]] = []
        values: list[float] = []
        rows: list[Array] = []
        for k, (wheel, p) in enumerate(zip(WHEELS, tyres.properties, strict=True)):
            if not np.isfinite(p.relaxation_length):
                raise InputError(f"{p.tyre}: no lateral stiffness is known, so there is no relaxation length; add it")
            names += [(COMPLIANCE, wheel), (LENGTH, wheel)]
            values += [1 / p.cornering_stiffness, p.relaxation_length]
            unit = np.eye(len(tyres.covariance))
            rows += [-unit[3 * k] / p.cornering_stiffness**2, unit[3 * k + 2]]
        to = np.array(rows)
        covariance = to @ tyres.covariance @ to.T
        lengths = tyres.trails
        if trail and lengths is not None and all(e is not None for e in lengths.estimates):
            names += [(TRAIL, wheel) for wheel in WHEELS]
            values += [e.value for e in lengths.estimates if e is not None]
            whole = np.zeros((len(values), len(values)))
            whole[: len(to), : len(to)], whole[len(to) :, len(to) :] = covariance, lengths.covariance
            covariance = whole
        covariance = covariance + np.diag((EXACT * np.array(values)) ** 2)
        load = float(np.mean([p.load for p in tyres.properties]))
        return cls(tuple(names), np.array(values), covariance, load, tuple(p.pressure for p in tyres.properties))


def read_tyre_part(content: Any, folder: Path, bicycle: Bicycle) -> tuple[TyreNumbers, tuple[str, ...]]:
    """The numbers of a table ``[part.rig]`` at the loads of a bicycle, and notes.

    Parameters
    ----------
    content : object
        That table.
    folder : Path
        Where the files that it names are.
    bicycle : Bicycle

    Raises
    ------
    InputError
        A key that is missing, unknown or not allowed; a condition out of reach of the tyre; several tyres.
    """
    given = read(RIG, content, section="rig")
    if ("tyre" in given) == ("recordings" in given):
        raise InputError(f"[rig]: give one of tyre and recordings; {EXAMPLE}")
    if "recordings" in given and "surface" in given:
        raise InputError("[rig]: surface belongs to a tyre; recordings have their own")
    how = {key: given.get(key) for key in ("surface", "pressure_bar", EXTRAPOLATE)}
    if "tyre" in given:
        tyres = joint_wheel_tyres(tyre=_files(given["tyre"], folder), bicycle=bicycle, **how)
        notes = tyre_notes(dict(zip(WHEELS, tyres.properties, strict=True)))
    else:
        tyres, notes = _fitted(folder / given["recordings"], bicycle, how)
    return TyreNumbers.of_wheels(tyres, trail=given["trail"]), tuple(notes)


def _files(tyre: Any, folder: Path) -> Any:
    if isinstance(tyre, dict):
        return {wheel: tyre_file(one, folder) for wheel, one in tyre.items()}
    return tyre_file(tyre, folder)


def _fitted(folder: Path, bicycle: Bicycle, how: dict[str, Any]) -> tuple[JointProperties, list[str]]:
    """The recordings in a folder fitted as ``velotyre tyre fit`` does, at the loads of the wheels."""
    from tempfile import TemporaryDirectory

    campaign = fit_campaign(folder, settings=FitSettings(), jobs=1, progress=False)
    tables, remarks = measured_tables(campaign)
    if len(tables) != 1:
        raise InputError(
            f"{folder}: recordings of {len(tables)} tyres and surfaces with both stiffnesses; a part is one tyre on "
            f"one surface{''.join(f'; {remark}' for remark in remarks)}"
        )
    with TemporaryDirectory() as scratch:  # one way for tables, whoever made them
        file = Path(scratch) / "tyre.csv"
        TyreMap(tables[0]).to_file(file)
        tyres = joint_wheel_tyres(tyre=file.as_posix(), bicycle=bicycle, **how)
    left = [f"{name} left out: {why}" for name, why in campaign.skipped.items()]
    return tyres, [*remarks, *left, *tyre_notes(dict(zip(WHEELS, tyres.properties, strict=True)))]


@dataclass(frozen=True, kw_only=True)
class TyreForward(BicycleForward):
    """The forward model of what a rig says (see :class:`studies.inference.forward.Forward`).

    Attributes
    ----------
    numbers : TyreNumbers
    """

    numbers: TyreNumbers

    @property
    def varied(self) -> bool:
        """No: one condition of each wheel."""
        return False

    @cached_property
    def rows(self) -> Rows:
        """One for each number; all are held out together."""
        names = self.numbers.names
        n = len(names)
        where = tuple(f"{quantity}, {wheel}" for quantity, wheel in names)
        shown = {label: Series(quantity, f"{quantity}, {UNITS[quantity]}", "load, N")
                 for label, (quantity, _) in zip(where, names, strict=True)}  # fmt: skip
        return Rows(where, np.full(n, self.numbers.load), where, np.zeros(n, np.intp), shown=shown, axis="load, N")

    @cached_property
    def _whitening(self) -> Array:
        return np.asarray(np.linalg.inv(np.linalg.cholesky(self.numbers.covariance)))

    def residual(self, candidates: tuple[Candidate, ...], theta: Array, *, slopes: bool = True) -> tuple[Array, Array]:
        """Whitened departure of the rig's numbers from the model's, (n,) and (n, p), at ``theta`` (p,).

        Arguments as :meth:`.Forward.residual`.
        """
        family = self.family(candidates)
        batch, steps = family.stencil(theta) if slopes else (theta[None], np.zeros(0))
        gone = {c.replaces for c in candidates}
        there = {e.identifier for e in self.base.effects} - gone
        there |= {c.effect.identifier for c in candidates if c.effect is not None}
        values = family.values(batch)
        computed = np.stack([_model(quantity, wheel, values, there) for quantity, wheel in self.numbers.names], 1)
        white = (self.numbers.values - computed) @ self._whitening.T
        return white[0], central_differences(white, steps) if slopes else np.empty((len(white[0]), 0))


def _model(quantity: str, wheel: str, values: dict[str, Array], there: set[str]) -> Array:
    """A number of the model for each coordinate of a batch (K,); what the model has not is zero."""

    def of(slot: str, number: str) -> Array | None:
        """What an effect of that slot takes from a tyre under the name of a number."""
        for name, effect in registry().items():
            for p in effect.parameters if name in there and effect.slot == slot else ():
                if p.tyre == number and (found := values.get(f"{name}.{p.name}.{wheel}")) is not None:
                    return found[:, 0]
        return None

    nothing = np.zeros(len(next(iter(values.values()))))
    stiffness = of(CONTACT, "cornering_stiffness")
    if stiffness is not None:  # a search may try a tyre that holds nothing: far from any rig's number, and a number
        stiffness = np.maximum(stiffness, SOFTEST)
    if quantity == COMPLIANCE:
        return nothing if stiffness is None else 1 / stiffness
    if quantity == LENGTH:
        length = of(CONTACT, _number(LENGTH))
        return nothing if length is None else length
    trail, aligning = of(ALIGNING, _number(TRAIL)), of(ALIGNING, STIFFNESS)
    if trail is not None:
        return trail
    return aligning / stiffness if aligning is not None and stiffness is not None else nothing


def _number(quantity: str) -> str:
    """What a tyre calls a quantity."""
    return quantity.replace(" ", "_")


def own_trails() -> tuple[str, ...]:
    """Effects with a trail that is none of a tyre's numbers, for it follows from something else."""
    numbers = {_number(TRAIL), STIFFNESS}
    return tuple(
        name for name, effect in registry().items()
        if effect.slot == ALIGNING and not any(p.tyre in numbers for p in effect.parameters)
    )  # fmt: skip


def refuse_own_trail(model: Model, numbers: TyreNumbers) -> None:
    """Refuse a ``model`` whose trail follows from something else where the ``numbers`` hold a trail.

    Raises
    ------
    InputError
        With the remedy.
    """
    own = [e.identifier for e in model.effects if e.identifier in own_trails()]
    if own and any(q == TRAIL for q, _ in numbers.names):
        raise InputError(f"[rig]: the rig's pneumatic trail cannot be compared with {own[0]}; write trail = false")


def pressure_in_words(numbers: TyreNumbers) -> str:
    """At what the ``numbers`` hold, for the report."""
    bars = " and ".join(dict.fromkeys(f"{p / PASCAL_PER_BAR:g}" for p in numbers.pressures))
    return f"tyre numbers at a mean wheel load of {numbers.load:.0f} N, {bars} bar"
