"""A measurement that can be diagnosed as it stands, every key explained: ``velotyre new m.toml --kind measurement``."""

import numpy as np
import pandas as pd

from bicycle.modal.named_modes import modes
from bicycle.model import Model
from bicycle.parameters import Bicycle
from studies.missing_effect.motion.modal_table import EIGENVALUE, SD
from tyre.base.errors import InputError

EXAMPLE = """\
# A measurement of a bicycle: what is missing from its model?
# velotyre diagnose {file} --out report
# Written by `velotyre new`. Units are SI unless a key names another. Lines that begin with # are comments: take the #
# away to use what stands behind it. docs/measurement_files.md has all kinds: time histories, recorded torques, bench
# tests, frequency responses, several of these together; `velotyre look RECORDING --out DIR` drafts those of recordings.

kind = "modal"                 # eigenvalues of named modes at speeds
bicycle = "{bicycle}"
# the bicycle: a packaged name, a file of yours ("mine.toml", "mine.txt"), or a table [bicycle] of parameters

# description = "Weave of my bicycle after a push at the saddle"
# source = "Laboratory book 7, 3 May"
# allow_unusual = false        # true lets values far from those of other bicycles pass

[modal]
table = "{table}"
# The numbers in it are SYNTHETIC, of the model itself with noise ({percent:g} % of each eigenvalue): put in yours.
# speed_m_s, mode, real_1_s, imag_rad_s are needed (decay rate and angular frequency, the imaginary part not negative).
# real_sd_1_s, imag_sd_rad_s: one standard deviation; without them it comes from repeats, else it is 3 %.
# steer_over_lean_re, _im, _sd and yaw_over_lean_re, _im, _sd: mode shapes, which separate what eigenvalues cannot.
# group: rows of one group are held out together. `velotyre modal` writes such a table from recordings.

# How well the bicycle is known: one standard deviation of a parameter, 0 fixes it. They decide the verdict more than
# anything else; without a line here the bicycle's own file counts, else careful measurement is taken for granted.
# [uncertainty]
# c = 0.003                    # trail, m
# lam = 0.01                   # steer axis tilt, rad
# IBxx = 0.5                   # kg m^2

# What the model has already beyond rolling without slip (`velotyre effects` lists what there is):
# [effects.steer_damper]
# damping = 0.5                # N m s/rad

# What is known of something that may be missing; it is then not fitted. An empty table asks for a motor:
# [candidates.luggage]
# x = 0.0
# z = -0.8
# [candidates.steer_assist]
"""
SPEEDS = np.arange(2.0, 15.0, 0.5)  # m/s, where an oscillation is looked for
POINTS, NOISE, SEED = 8, 0.02, 3
MOST_DAMPED, FASTEST_GROWTH = 0.5, 0.5  # damping ratio that a free decay shows; 1/s that a rider lets grow


def example_measurement(bicycle: Bicycle, *, file: str, table: str) -> tuple[str, pd.DataFrame]:
    """Text of a measurement file, and its table: the weave of a ``bicycle`` that rolls without slip, with noise.

    Parameters
    ----------
    bicycle : Bicycle
    file, table : str
        Names of both.

    Raises
    ------
    InputError
        The weave of this bicycle does not oscillate, or grows too fast, at the speeds that are looked at.
    """
    roots = modes(Model(bicycle).linear_model(), SPEEDS).branches.get("weave", np.full((len(SPEEDS), 1), np.nan))[:, 0]
    seen = (roots.imag > 0) & (roots.real < FASTEST_GROWTH) & (-roots.real < MOST_DAMPED * np.abs(roots))
    places = np.flatnonzero(seen)
    if len(places) < POINTS:
        raise InputError(
            f"--bicycle {bicycle.name}: its weave can be measured at {len(places)} of {len(SPEEDS)} speeds from "
            f"{SPEEDS[0]:g} to {SPEEDS[-1]:g} m/s only, too few for an example; take another bicycle"
        )
    rng = np.random.default_rng(SEED)
    rows = []
    for k in places[np.linspace(0, len(places) - 1, POINTS).round().astype(int)]:
        sd = NOISE * abs(roots[k])
        real, imag = roots[k].real + sd * rng.standard_normal(), roots[k].imag + sd * rng.standard_normal()
        rows.append([SPEEDS[k], "weave", *(round(x, 4) for x in (real, imag, sd, sd))])
    text = EXAMPLE.format(file=file, bicycle=bicycle.name, table=table, percent=100 * NOISE)
    return text, pd.DataFrame(rows, columns=["speed_m_s", "mode", *EIGENVALUE, *SD])
