"""All that is said of what could not be named: the fitted torque, what it looks like, the critical speeds with it."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from studies.missing_effect.diagnose import Diagnosis
from studies.missing_effect.reporting.corrected_model import corrected_model
from studies.missing_effect.residual.amplitude import Amplitude, amplitude_of
from studies.missing_effect.residual.changed import changed
from studies.missing_effect.residual.claims import Claims, claims
from studies.missing_effect.residual.fitting import Residual, fit_residual
from studies.missing_effect.residual.seen import Seen, seen
from studies.missing_effect.residual.shapes import Likeness, Shape, shape_of
from studies.missing_effect.residual.terms import DEGREES, EFFECT
from tyre.base.errors import InputError


@dataclass(frozen=True, eq=False)
class Kept:
    """What could not be named.

    Attributes
    ----------
    refused : str
        Why nothing was fitted, in words; empty where it was.
    residual, motion, shape :
        The torque, the motion seen, what it looks like on it; None where nothing was fitted.
    amplitude : Amplitude, optional
        Of time histories.
    critical : Claims, optional
        Critical speeds of the corrected model; None where the values make no bicycle.
    """

    refused: str = ""
    residual: Residual | None = None
    motion: Seen | None = None
    shape: Shape | None = None
    amplitude: Amplitude | None = None
    critical: Claims | None = None


def keep(diagnosis: Diagnosis) -> Kept | None:
    """Fit and describe what a ``diagnosis`` could not name; None where it left no more than noise, or of a tyre."""
    forward = diagnosis.forward
    try:
        residual = fit_residual(diagnosis)
    except InputError as error:
        return Kept(refused=str(error), amplitude=amplitude_of(forward, diagnosis.final))
    if residual is None:
        return None
    motion = seen(forward, residual.fit.candidates, residual.fit.theta)
    return Kept(
        residual=residual, motion=motion, shape=shape_of(forward, residual, motion),
        amplitude=amplitude_of(forward, residual.fit, residual), critical=_claims(diagnosis, residual),
    )  # fmt: skip


def _claims(diagnosis: Diagnosis, residual: Residual) -> Claims | None:
    try:
        model = corrected_model(diagnosis, residual)
    except InputError:  # as is said beside the corrected model
        return None
    return None if model is None else claims(residual, model)


def record(kept: Kept | None) -> dict[str, Any] | None:
    """For JSON: what was ``kept``."""
    if kept is None:
        return None
    residual, shape = kept.residual, kept.shape
    if residual is None or shape is None:
        return {"fitted": False, "why": kept.refused, "amplitude": _amplitude(kept.amplitude)}
    names = (*residual.kept, *residual.dropped)
    first = len(residual.covariance) - len(names)
    units = {u.name: u.unit for u in residual.fit.unknowns}
    return {
        "fitted": True, "name_of_a_cause": False, "effect": EFFECT,
        "middle_speed_m_s": residual.scale.middle, "speed_span_m_s": residual.scale.span,
        "coefficients": {
            name: {
                "value": value, "sd": residual.sd[name], "sd_alone": residual.sd_alone[name], "unit": units[name],
                "gain_log_evidence": _of(residual.gains, name, 0), "gain_held_out": _of(residual.gains, name, 1),
            }
            for name, value in residual.values.items()
        },
        "left_at_zero": {name: {"sd": residual.sd[name]} for name in residual.dropped},
        "covariance": {"coefficients": list(names), "matrix": residual.covariance[first:, first:].tolist()},
        "changed": [asdict(one) for one in changed(residual)],
        "misfit": residual.misfit, "goodness_of_fit_p": residual.p,
        "chi2": {"without": residual.beside.chi2, "with": residual.fit.chi2},
        "held_out": {
            "gap_without": residual.before.gap, "gap_with": residual.after.gap,
            "chi2_without": residual.before.chi2, "chi2_with": residual.after.chi2,
            "log_score_gain": residual.after.log_score - residual.before.log_score,
        },
        "share_of_power": {f"{torque}_from_{state}": share for (torque, state), share in shape.shares.items()},
        "newton_metre_of_steer_torque_counts_as_lean": shape.counts,
        "like_effects": _likeness(shape.library), "like_errors_of_the_measurement": _likeness(shape.errors),
        "amplitude": _amplitude(kept.amplitude),
        "critical_speeds": None if kept.critical is None else kept.critical.to_dict(),
    }  # fmt: skip


def _of(gains: Mapping[str, tuple[float, float]], name: str, which: int) -> float | None:
    """The gain of the last term of a pair; earlier ones are judged with it."""
    return gains[name][which] if name in gains else None


def _likeness(found: tuple[Likeness, ...]) -> list[dict[str, Any]]:
    return [{"identifier": one.identifier, "share": one.share, "wrong_sign": one.reversed} for one in found]


def _amplitude(found: Amplitude | None) -> dict[str, Any] | None:
    if found is None:
        return None
    return {
        "viscous_N_m_s_rad": list(found.viscous), "dry_friction_N_m": list(found.dry),
        "damping_falls_with_amplitude": found.falls,
        "pieces": [
            {"steer_rate_rad_s": a, "damping_N_m_s_rad": b, "sd": c}
            for a, b, c in zip(found.rate.tolist(), found.damping.tolist(), found.sd.tolist(), strict=True)
        ],
    }  # fmt: skip


def plain(name: str) -> str:
    """A coefficient called ``name`` in words: ``steer torque from lean rate, slope``."""
    torque, _, rest = name.partition("_from_")
    degree = next((d for d in DEGREES if d and rest.endswith(d)), "")
    state = rest.removesuffix(degree).replace("_", " ") if degree else rest.replace("_", " ")
    return f"{torque} torque from {state}{f', {degree[1:]}' if degree else ''}"
