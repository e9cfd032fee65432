"""Every figure that the result of a sweep gives, each as PNG and SVG with its numbers as CSV."""

import contextlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from studies.sweep_pictures.figure_critical import LEAST_FOR_BARS, MOST_ROWS, draw_distributions, draw_each
from studies.sweep_pictures.figure_parameters import draw_pairs, draw_shares
from studies.sweep_pictures.figure_speed import draw_modes_along_speed, draw_stability
from studies.sweep_pictures.quantities import CRITICAL, any_limit
from studies.sweep_pictures.shares import LEAST, LEAST_OF_A_GRID, Share, correlated, shares, stated_correlations
from studies.sweep_pictures.stored import Stored, read_result, speeds_of
from studies.sweep_pictures.targets import Stability, Target, mode_targets, stability, targets
from studies.sweep_pictures.varied import Varied, grid_parameters, sampled_parameters
from studies.sweeps.spec import SPEED
from tyre.base.errors import InputError

OVERLAP = "correlated"


@dataclass(frozen=True)
class Drawn:
    """What was drawn: ``figures`` by name with what is to be seen, and ``remarks`` on what was not and why."""

    folder: Path
    figures: dict[str, str]
    remarks: list[str]


def figures_folder(result: str | Path) -> Path:
    """Where the figures of a ``result`` go if nothing else is said: ``NAME_figures`` beside it."""
    return Path(result).with_name(f"{Path(result).stem}_figures")


def draw_result(result: str | Path, folder: Path | None = None, *, at: float | None = None) -> Drawn:
    """Draw all that a result holds.

    Parameters
    ----------
    result : str or Path
        Of ``velotyre sweep``.
    folder : Path, optional
        For the figures; :func:`figures_folder` by default.
    at : float, optional
        Speed (m/s) at which stable and unstable bicycles are told apart.

    Raises
    ------
    InputError
        No result, one that holds nothing to draw, or a speed that it does not hold.
    """
    stored = read_result(result)
    drawn = Drawn(folder or figures_folder(result), {}, [])
    if at is not None and not (np.isfinite(at) and at >= 0):
        raise InputError(f"--at {at:g} must be a speed of 0 m/s or more")
    if not stored.reduced and not stored.possible.any():
        raise InputError(f"{stored.path.as_posix()}: no bicycle of it is possible, so there is nothing to draw")
    asked = None if at is None or stored.reduced else stability(stored, at)  # refused before anything is drawn
    drawn.folder.mkdir(parents=True, exist_ok=True)
    _critical(stored, drawn)
    _along_speed(stored, drawn)
    _parameters(stored, drawn, asked)
    if not drawn.figures:
        with contextlib.suppress(OSError):  # others' files are in it
            drawn.folder.rmdir()
        raise InputError(
            f"{stored.path.as_posix()} holds nothing that is drawn ({', '.join(stored.sweep.outputs)}; "
            f"{'; '.join(drawn.remarks)}); ask the sweep for critical_speeds, or for largest_growth_rate, "
            "damping_ratios or modes at several speeds"
        )
    drawn.remarks.extend(_said(stored))
    return drawn


def _said(stored: Stored) -> list[str]:
    found = []
    out = 0 if stored.reduced else int((~stored.possible).sum())
    if out:
        found.append(f"{out} of {stored.bicycles} bicycles are impossible and in no figure")
    if stored.extrapolated:
        every = stored.sweep.items if stored.reduced else stored.bicycles
        found.append(f"{stored.extrapolated} of {every} bicycles have a tyre outside its measured loads and pressures")
    return found


def _critical(stored: Stored, drawn: Drawn) -> None:
    held = CRITICAL in stored.data or f"{CRITICAL}_quantiles" in stored.data
    if held and not any_limit(stored):
        drawn.remarks.append(f"no bicycle has a critical speed up to {stored.sweep.max_speed:g} m/s, so none are drawn")
        return
    many = not stored.reduced and held and stored.bicycles >= LEAST_FOR_BARS
    if many:
        name = "critical_speeds"
        drawn.figures[name] = draw_distributions(stored, drawn.folder / name)
    if held and stored.cells <= MOST_ROWS and (stored.cells > 1 or not many):
        name = "critical_speeds_each"
        drawn.figures[name] = draw_each(stored, drawn.folder / name)
    elif held and stored.cells > MOST_ROWS:
        drawn.remarks.append(f"{stored.cells} combinations are too many for a row each (at most {MOST_ROWS})")


def _along_speed(stored: Stored, drawn: Drawn) -> None:
    several = len(speeds_of(stored)) > 1
    names = {str(name) for name in stored.data}
    total = {"largest_growth_rate", "smallest_damping_ratio", "eigenvalues"}
    named = {"modes", "frequencies", "damping_ratios"}
    for name, wanted, draw in (
        ("stability_along_speed", total, draw_stability),
        ("modes_along_speed", named, draw_modes_along_speed),
    ):
        held = {one.removesuffix("_quantiles") for one in names} & wanted
        if held and several:
            drawn.figures[name] = draw(stored, drawn.folder / name)
        elif held and SPEED in stored.data.dims:
            drawn.remarks.append(f"one speed only, so nothing of {', '.join(sorted(held))} is drawn along the speed")


def _parameters(stored: Stored, drawn: Drawn, asked: Stability | None) -> None:
    if stored.reduced:
        drawn.remarks.append("[reduce] kept no samples, so nothing is drawn against the parameters that were sampled")
        return
    sampled, remark = sampled_parameters(stored)
    drawn.remarks.extend([remark] if remark else [])
    varied = [*grid_parameters(stored), *sampled]
    if not varied:
        if not remark:
            drawn.remarks.append("nothing but the speed is varied, so nothing is drawn against parameters")
        return
    stable = asked or stability(stored, None)
    outputs = [*targets(stored, stable), *mode_targets(stored, None if stable is None else stable.speed)]
    if stable is None:
        drawn.remarks.append(
            "stable and unstable bicycles are not told apart: the result holds no largest_growth_rate, and there is no "
            "critical speed to tell them apart at, or what makes the result has changed since; give --at, or ask the "
            "sweep for largest_growth_rate"
        )
    if not outputs:
        return
    found, remarks = _shares(stored, varied, outputs, whole=not remark)
    if len(varied) == 1:
        drawn.remarks.append(f"{varied[0].name} alone is varied, so there are no shares to compare")
    elif not found:
        drawn.remarks.append(
            f"no shares of the variance: no output that varies is had by {LEAST} bicycles of a sample, or by "
            f"{LEAST_OF_A_GRID} of a grid"
        )
    rank = {one.name: max((s.first for every in found.values() for s in every if s.name == one.name), default=0.0)
            for one in varied}  # fmt: skip
    ordered = sorted(varied, key=lambda one: -rank[one.name]) if found else varied
    drawn.figures["pairs"] = draw_pairs(stored, drawn.folder / "pairs", ordered, outputs, stable, ranked=bool(found))
    if found and len(varied) > 1:
        drawn.figures["variance_shares"] = draw_shares(stored, drawn.folder / "variance_shares", found, remarks)
        overlapping = dict.fromkeys(text[text.index(OVERLAP) :] for text in remarks.values() if OVERLAP in text)
        drawn.remarks.extend(f"variance shares: {text}" for text in overlapping)


def _shares(
    stored: Stored, varied: list[Varied], outputs: list[Target], *, whole: bool
) -> tuple[dict[str, list[Share]], dict[str, str]]:
    """Shares by label of the output, and what must be said of them."""
    found: dict[str, list[Share]] = {}
    remarks: dict[str, str] = {}
    for output in outputs:
        y = np.where(stored.possible, output.values, np.nan)
        every = shares(y, varied)
        if not every:
            continue
        found[output.label] = every
        said = []
        has = np.isfinite(y)
        if has.sum() < stored.possible.sum():
            said.append(f"of the {int(has.sum())} of {int(stored.possible.sum())} bicycles that have it")
        drawn_so = stated_correlations(stored.sweep.normals)
        told = {pair[:2] for pair in drawn_so}
        if not whole:
            said.append("the sampled parameters are missing")
        pairs = drawn_so + [pair for pair in correlated(varied, has) if pair[:2] not in told]
        if pairs:
            words = ", ".join(f"{a} and {b} ({r:+.2f})" for a, b, r in pairs[:3])
            said.append(f"{OVERLAP}: {words}; their shares overlap and have no unique split")
        remarks[output.label] = "; ".join(said)
    return found, remarks
