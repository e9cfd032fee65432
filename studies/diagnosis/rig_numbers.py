"""Slip compliance, relaxation length and trail of a bicycle's tyres by a rig, with covariance: a part of joint data.

The rig's fit is a normal distribution of these numbers at the static load and the pressure of each wheel; their
departure from the model's, whitened, is fitted. Rolling without slip has no slip compliance and no relaxation length,
side slip no relaxation length: the rig speaks against such a model as loud as it measured.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from bicycle.effects.effect import WHEELS
from bicycle.effects.effect_registry import registry
from bicycle.model.wheel_tyres import EXTRAPOLATE, joint_wheel_tyres, tyre_file, tyre_notes
from bicycle.parameters.bicycle import Bicycle
from studies.diagnosis.bicycle_kind import DRY, BicycleKind
from studies.inference import kind as base
from studies.inference.kind import Candidates, Rows, Series
from studies.inference.parameter import central_differences
from tyre.fits.campaign import fit_campaign, measured_tables
from tyre.fits.condition import FitSettings
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError
from tyre.ground.schema import anything, flag, maybe, needed, read, table, text
from tyre.ground.units import PASCAL_PER_BAR
from tyre.maps.tyre_map import TyreMap
from tyre.measured.properties import JointProperties

EXAMPLE = 'write tyre = "TABLE.csv" (or recordings = "FOLDER") and pressure_bar'
COMPLIANCE, LENGTH, TRAIL = "slip compliance", "relaxation length", "pneumatic trail"
CONTACT, ALIGNING = "contact law", "aligning moment"  # slots of effects
TRAIL_NUMBERS = ("pneumatic_trail", "aligning_stiffness")  # numbers of a tyre that make a trail
UNITS = {COMPLIANCE: "rad/N", LENGTH: "m", TRAIL: "m"}


def own_trails() -> tuple[str, ...]:
    """Effects with a trail that is none of a tyre's numbers, for it follows from something else."""
    return tuple(
        name
        for name, effect in registry().items()
        if effect.slot == ALIGNING and not any(p.tyre in TRAIL_NUMBERS for p in effect.parameters)
    )


@dataclass(frozen=True, kw_only=True)
class RigNumbers(BicycleKind, kind="rig", top=False):
    """Numbers of both wheels' tyres."""

    keys: ClassVar[Any] = table(
        {
            maybe("tyre"): anything,
            maybe("surface"): text("must be 'flat' or 'drum'", allowed=("flat", "drum")),
            maybe("recordings"): text("must be a folder in quotes", blank=False),
            needed("pressure_bar", f"pressure_bar is missing; {EXAMPLE}"): anything,
            maybe(EXTRAPOLATE, False): flag,
            maybe("trail", True): flag,
        }
    )
    quantities: tuple[tuple[str, str], ...]  # quantity and wheel of each number
    values: Array  # (n,), SI units
    covariance: Array  # (n, n), SI units
    load: float  # mean of the wheels, N
    pressures: tuple[float, ...]  # of rear and front, Pa

    @classmethod
    def read(cls, content: Any, folder: Path, common: Mapping[str, Any]) -> "RigNumbers":
        settings, model = read(cls.keys, content, section="rig"), common["model"]
        if ("tyre" in settings) == ("recordings" in settings):
            raise InputError(f"[rig]: give one of tyre and recordings; {EXAMPLE}")
        if "recordings" in settings and "surface" in settings:
            raise InputError("[rig]: surface belongs to a tyre; recordings have their own")
        how = {key: settings.get(key) for key in ("surface", "pressure_bar", EXTRAPOLATE)}
        notes: list[str] = []
        if "tyre" in settings:
            tyre = settings["tyre"]
            several = isinstance(tyre, dict)
            files = {w: tyre_file(name, folder) for w, name in tyre.items()} if several else tyre_file(tyre, folder)
            tyres = joint_wheel_tyres(tyre=files, bicycle=model.bicycle, **how)
        else:
            tyres, notes = _fit_folder(folder / settings["recordings"], model.bicycle, how)
        notes += tyre_notes(dict(zip(WHEELS, tyres.properties, strict=True)))
        quantities, values, covariance = _numbers(tyres, trail=settings["trail"])
        trail_effects = [e.identifier for e in model.effects if e.identifier in own_trails()]
        if trail_effects and any(quantity == TRAIL for quantity, _ in quantities):
            raise InputError(
                f"[rig]: the rig's pneumatic trail cannot be compared with {trail_effects[0]}; write trail = false"
            )
        return cls(
            **common,
            quantities=quantities,
            values=values,
            covariance=covariance,
            notes=tuple(notes),
            load=float(np.mean([p.load for p in tyres.properties])),
            pressures=tuple(p.pressure for p in tyres.properties),
        )

    def refusals(self) -> dict[str, str]:
        return DRY | {"speed_offset": "needs motion at several speeds"}

    def assumptions(self) -> tuple[str, ...]:
        bars = " and ".join(dict.fromkeys(f"{p / PASCAL_PER_BAR:g}" for p in self.pressures))
        return (f"tyre numbers at a mean wheel load of {self.load:.0f} N, {bars} bar",)

    @property
    def excludes(self) -> tuple[str, ...]:
        return own_trails() if any(quantity == TRAIL for quantity, _ in self.quantities) else ()

    @property
    def varied(self) -> bool:
        return False

    @cached_property
    def rows(self) -> Rows:  # type: ignore[override]
        """One row for each number; all are held out together."""
        n = len(self.quantities)
        labels = tuple(f"{quantity}, {wheel}" for quantity, wheel in self.quantities)
        displays = {
            label: Series(quantity, f"{quantity}, {UNITS[quantity]}", "load, N")
            for label, (quantity, _) in zip(labels, self.quantities, strict=True)
        }
        return Rows(labels, np.full(n, self.load), labels, np.zeros(n, np.intp), displays=displays, axis="load, N")

    @property
    def data(self) -> tuple[Array, Array]:
        return self.values, np.sqrt(self.covariance.diagonal())

    def residual(self, candidates: Candidates, theta: Array, *, slopes: bool = True) -> base.Prediction:
        family = self.family(candidates)
        batch, steps = family.stencil(theta) if slopes else (theta[None], np.zeros(0))
        acting = {e.identifier for e in self.model.effects} - {c.replaces for c in candidates}
        acting |= {c.effect.identifier for c in candidates if c.effect is not None}
        values = family.values(batch)
        computed = np.stack([_model(quantity, wheel, values, acting) for quantity, wheel in self.quantities], 1)
        white = np.linalg.solve(np.linalg.cholesky(self.covariance), (self.values - computed).T).T
        return white[0], central_differences(white, steps) if slopes else np.empty((len(white[0]), 0))


def _numbers(tyres: JointProperties, *, trail: bool) -> tuple[tuple[tuple[str, str], ...], Array, Array]:
    """Quantities, values and covariance of rear and front ``tyres``, with the ``trail`` if it was measured."""
    for p in tyres.properties:
        if not np.isfinite(p.relaxation_length):
            raise InputError(f"{p.tyre}: no lateral stiffness is known, so there is no relaxation length; add it")
    wheels = list(enumerate(zip(WHEELS, tyres.properties, strict=True)))
    # quantity and wheel, the tyre's own name, value, slope to the tyre's own number
    numbers: list[tuple[tuple[str, str], str, Any, float]] = [
        number
        for k, (wheel, p) in wheels
        for number in (
            ((COMPLIANCE, wheel), f"cornering_stiffness.{k}", 1 / p.cornering_stiffness, -(p.cornering_stiffness**-2)),
            ((LENGTH, wheel), f"relaxation_length.{k}", p.relaxation_length, 1.0),
        )
    ]
    if trail and all(p.pneumatic_trail_sd is not None for p in tyres.properties):
        numbers += [((TRAIL, wheel), f"pneumatic_trail.{k}", p.pneumatic_trail, 1.0) for k, (wheel, p) in wheels]
    names, keys, values, slopes = zip(*numbers, strict=True)
    covariance = tyres.joint.among(keys) * np.outer(slopes, slopes)
    # two wheels at one condition say the same thing once: a relative sd of 0.1 % is added to each number
    return names, np.array(values), covariance + np.diag((1e-3 * np.array(values)) ** 2)


def _fit_folder(folder: Path, bicycle: Bicycle, how: dict[str, Any]) -> tuple[JointProperties, list[str]]:
    """Tyres of the recordings in a folder, fitted as ``velotyre tyre fit`` does, at the loads of the wheels."""
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
    return tyres, [*remarks, *(f"{name} left out: {why}" for name, why in campaign.skipped.items())]


def _model(quantity: str, wheel: str, values: dict[str, Array], acting: set[str]) -> Array:
    """A number of the model for each coordinate of a batch (K,), zero if the model has none."""

    def of(slot: str, number: str) -> Array | None:
        """The value that an effect of that slot takes from a tyre under the name of a number."""
        for name, effect in registry().items():
            if name in acting and effect.slot == slot:
                for p in effect.parameters:
                    if p.tyre == number and (wheel_value := values.get(f"{name}.{p.name}.{wheel}")) is not None:
                        return wheel_value[:, 0]
        return None

    nothing = np.zeros(len(next(iter(values.values()))))
    stiffness = of(CONTACT, "cornering_stiffness")
    if stiffness is not None:  # a search may try a tyre that holds nothing: far from any rig's number, and a number
        stiffness = np.maximum(stiffness, 1.0)
    if quantity == COMPLIANCE:
        return nothing if stiffness is None else 1 / stiffness
    if quantity == LENGTH:
        length = of(CONTACT, "relaxation_length")
        return nothing if length is None else length
    trail, aligning = (of(ALIGNING, number) for number in TRAIL_NUMBERS)
    if trail is not None:
        return trail
    return aligning / stiffness if aligning is not None and stiffness is not None else nothing
