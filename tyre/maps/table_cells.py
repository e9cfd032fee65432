"""The declared columns of a measured tyre table: what each of its cells may hold."""

from typing import Any

from tyre.base.checks import Check, number
from tyre.base.plausible import LARGEST
from tyre.maps.table_sidecar import POSITIVE

REQUIRED = ("load_N", "pressure_bar", "cornering_stiffness_N_per_deg")
STIFFNESS = ("relaxation_length_mm", "lateral_stiffness_N_per_mm")
SD = ("cornering_stiffness_sd_N_per_deg", "relaxation_length_sd_mm", "lateral_stiffness_sd_N_per_mm")
CORRELATION, DOF = "stiffness_correlation", ("cornering_stiffness_dof", "lateral_stiffness_dof")
TRAIL = "pneumatic_trail"
DIRECT = {"slip step": "relaxation_length_slip_step", "two sweep rates": "relaxation_length_two_rates"}

_NOT_NEGATIVE = number(least=0, most=LARGEST, says="must be finite and >= 0")
_FREEDOM = number(above=0, endless=True, says="must be > 0 (inf where the standard deviation is known well)")
_ANY = number(least=-LARGEST, most=LARGEST, says="must be finite, or empty where it was not measured")


def _or_empty(check: Check) -> Check:
    def checked(value: Any) -> Any:
        return float("nan") if value == "" else check(value)

    return checked


COLUMNS: dict[str, Check] = (
    dict.fromkeys((*REQUIRED, *STIFFNESS), POSITIVE)
    | dict.fromkeys(SD, _NOT_NEGATIVE)
    | {CORRELATION: number(least=-1, most=1, says="must be from -1 to 1")}
    | dict.fromkeys(DOF, _FREEDOM)
    | {
        f"{name}{end}": _or_empty(check)
        for name in (TRAIL, *DIRECT.values())
        for end, check in (("_mm", _ANY), ("_sd_mm", _NOT_NEGATIVE), ("_dof", _FREEDOM))
    }
)
