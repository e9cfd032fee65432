"""Which measurement would narrow a result most: variance-based indices of a critical speed."""

import numpy as np

from bicycle.critical.critical_speed import CrossingIdentity
from bicycle.sensitivity.eigenvalue_derivatives import critical_speed_sensitivities
from studies.uncertainty.propagation import Uncertainty
from tyre.base.errors import InputError
from tyre.base.optional import not_installed


def total_effects(
    uncertainty: Uncertainty, name: str | CrossingIdentity, *, max_speed: float = 60.0, base: int = 512, seed: int = 0
) -> dict[str, tuple[float, float, float]]:
    """Which measurement would narrow a critical speed most: variance-based indices of each (Saltelli et al. 2010).

    ``name`` says which critical speed, as the table of the results writes it. Returns measurement -> (first-order
    index, total index, its 95 % half-width). The first-order index is the part of the variance that vanishes on average
    when that measurement is made exact.

    Parameters
    ----------
    uncertainty : Uncertainty
    name : str
        Of the critical speed, as :meth:`Uncertainty.crossings` calls it.
    max_speed : float, optional
        m/s.
    base : int, optional
        Number of samples of the design, a power of two.
    seed : int, optional
        Of the design, any whole number.

    Raises
    ------
    InputError
        SALib is missing, there is no such critical speed, or it vanishes for some of the bicycles.
    """
    try:
        from SALib.analyze import sobol
        from SALib.sample import sobol as sampling
    except ImportError as error:
        raise InputError(not_installed("SALib", extra="sensitivity")) from error
    crossings = uncertainty.crossings(max_speed)
    crossing = next((crossing for which, crossing in crossings.items() if str(which) == str(name)), None)
    if crossing is None:
        raise InputError(f"no critical speed {str(name)!r}; this model has {', '.join(map(str, crossings)) or 'none'}")
    slopes = critical_speed_sensitivities(uncertainty.nominal, [crossing])
    count = len(uncertainty.names)
    groups = [group for group, members in uncertainty.measurements.items() for _ in members]
    problem = {
        "num_vars": count, "names": list(uncertainty.names), "groups": groups,
        "bounds": [[0.0, 1.0]] * count, "dists": ["norm"] * count,
    }  # fmt: skip
    z = sampling.sample(problem, base, calc_second_order=False, seed=seed)
    speeds = uncertainty.crossing_speeds(crossing, {key: float(v[0]) for key, v in slopes.items()}, z, max_speed)
    lost = int(np.isnan(speeds).sum())
    if lost:
        raise InputError(
            f"{name} is missing up to {max_speed:g} m/s for {lost} of {len(z)} bicycles, so its variance is not "
            "defined; ask for another critical speed, or a higher --max-speed"
        )
    found = sobol.analyze(problem, speeds, calc_second_order=False, seed=seed)
    return {
        group: (float(found["S1"][k]), float(found["ST"][k]), float(found["ST_conf"][k]))
        for k, group in enumerate(uncertainty.measurements)
    }
