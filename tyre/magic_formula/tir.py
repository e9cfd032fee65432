"""Tyre property files (.tir) as tyres: what they hold at a load and pressure."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import inf, isfinite
from pathlib import Path

import numpy as np

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.base.units import PASCAL_PER_BAR
from tyre.magic_formula.formula_tyre import FormulaTyre
from tyre.magic_formula.tir_coefficients import MF52Lateral, MF61Lateral
from tyre.magic_formula.tir_numbers import TirNumbers
from tyre.magic_formula.tir_text import TirText, parse, read_text

_SAME_PRESSURE = 0.02  # MF-Tyre 5.2 knows one pressure; a rig sets it within this share


@dataclass(frozen=True, eq=False)
class TirTyre(FormulaTyre):
    """The tyre of a property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2 (a :class:`tyre.tyre_source.TyreSource`).

    Relaxation length is C_Fy / K_y with LATERAL_STIFFNESS (6.1), or sigma_alpha of PTY1 and PTY2 (5.2). Camber
    stiffness, trail, twisting and overturning stiffness are there where the file has their coefficients
    (:mod:`tyre.magic_formula.tir_moments`).

    Attributes
    ----------
    file : TirText
        The file as it stands.
    relative_stiffness_sd : float
        Assumed sd(C_Fy) / C_Fy and sd(K_y) / K_y, as the format holds none.
    """

    file: TirText

    @cached_property
    def numbers(self) -> TirNumbers:
        """The numbers of the file, in SI units."""
        return TirNumbers(self.file)

    @property
    def coefficients(self) -> MF61Lateral | MF52Lateral:
        """Lateral coefficients in SI units, ISO signs as in the file.

        Raises
        ------
        InputError
            When the model is neither MF-Tyre 5.2 nor 6.1/6.2, or a needed coefficient is missing or out of range.
        """
        return self.numbers.lateral

    @property
    def tyre(self) -> str:
        """The name in the file's comment ``TYRE``, or the name of the file."""
        return self.file.comments.get("TYRE", Path(self.file.source).stem)

    @property
    def surface(self) -> str:
        """``flat`` or ``drum``: the file's comment ``SURFACE``, flat without one."""
        return self.file.comments.get("SURFACE", "flat")

    @property
    def label(self) -> str:
        """``tyre on surface (file)``, for messages."""
        return f"{self.tyre} on {self.surface} ({Path(self.file.source).name})"

    @property
    def description(self) -> str:
        """Which model the file holds."""
        return f"MF-Tyre {'6.1' if isinstance(self.coefficients, MF61Lateral) else '5.2'} coefficients"

    @property
    def source(self) -> str:
        """The file."""
        return self.file.source

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What a reader of any value must be told."""
        model, notes = self.coefficients, ["from a .tir file"]
        if any("synthetic" in line.lower() for line in self.file.text.splitlines() if line.startswith(("!", "$"))):
            notes.insert(0, "synthetic: no rig measured this tyre")
        if model.pky1 > 0:
            notes.append("PKY1 is positive: the file does not keep ISO signs, adapted SAE signs are taken")
        if "SURFACE" not in self.file.comments:
            notes.append("the file names no surface: taken as flat")
        if isinstance(model, MF52Lateral) and not isfinite(model.pressure):
            notes.append("the file states no pressure: its values are taken at the one asked for")
        elif self.pressure_range[1] == inf:
            notes.append("the file states no range of pressures (PRESMIN, PRESMAX)")
        if self.load_range[1] == inf:
            notes.append("the file states no range of loads (FZMIN, FZMAX)")
        if isinstance(model, MF52Lateral) and model.pty1 <= 0 and isfinite(self.numbers.lateral_stiffness):
            notes.append("no relaxation coefficients PTY1, PTY2: LATERAL_STIFFNESS gives the relaxation length")
        return (*notes, *self.doubts)

    @property
    def width(self) -> float | None:
        """WIDTH of the tyre, m."""
        width = self.numbers.number("WIDTH", 0.0) * self.numbers.length
        return width if width > 0 else None

    @property
    def load_range(self) -> tuple[float, float]:
        """FZMIN and FZMAX, N."""
        return self.coefficients.load_range

    @property
    def pressure_range(self) -> tuple[float, float]:
        """PRESMIN and PRESMAX, Pa; the one pressure of a 5.2 file."""
        model = self.coefficients
        if isinstance(model, MF61Lateral):
            return model.pressure_range
        spread = _SAME_PRESSURE * model.pressure
        return (model.pressure - spread, model.pressure + spread) if isfinite(model.pressure) else (0.0, inf)

    @property
    def loads(self) -> Array:
        """Ends of the range, where stated, and the nominal load, N."""
        return _known(*self.load_range, self.coefficients.fnomin)

    @property
    def pressures(self) -> Array:
        """Ends of the range, where stated, and the nominal pressure, Pa; none where a 5.2 file states none."""
        model = self.coefficients
        if isinstance(model, MF61Lateral):
            return _known(*model.pressure_range, model.nompres)
        return _known(model.pressure)

    def linear(self, *, load: Array, pressure: Array) -> Mapping[str, Array]:
        """Return what the file holds at many conditions; nothing is checked.

        Parameters
        ----------
        load, pressure : ndarray, shape (n,)
            N and Pa.

        Returns
        -------
        dict of str to ndarray, shape (n,)
            By the name of the field of `TyreProperties`, SI units.
        """
        model = self.coefficients
        if isinstance(model, MF61Lateral):
            cornering = model.cornering_stiffness(load=load, pressure=pressure)
            lateral = model.lateral_stiffness_at(load=load, pressure=pressure)
        else:
            cornering = model.cornering_stiffness(load=load)
            lateral = np.full(np.shape(load), self.numbers.lateral_stiffness)
            if model.pty1 > 0:
                lateral = np.abs(cornering) / model.relaxation_length(load=load)
        if model.pky1 > 0:
            cornering = -cornering
        held = {"cornering_stiffness": cornering}
        if isfinite(self.numbers.lateral_stiffness) or (isinstance(model, MF52Lateral) and model.pty1 > 0):
            held |= {"lateral_stiffness": lateral, "relaxation_length": cornering / lateral}
        return held | self.numbers.moments.linear(load=load, pressure=pressure, cornering_stiffness=cornering)

    @property
    def _described(self) -> tuple[str, str, str, tuple[str, ...]]:
        return self.tyre, self.surface, self.source, self.notes

    def _check(self, load: float, pressure: float) -> None:
        super()._check(load, pressure)
        model = self.coefficients
        if isinstance(model, MF52Lateral) and abs(pressure - model.pressure) > _SAME_PRESSURE * model.pressure:
            raise InputError(
                f"{self.file.source}: an MF-Tyre 5.2 file holds one pressure, here {model.pressure / PASCAL_PER_BAR:g} "
                f"bar; {pressure / PASCAL_PER_BAR:g} bar needs a file of its own"
            )


def _known(*values: float) -> Array:
    """Those that are positive and finite, ascending, each once."""
    return np.unique([value for value in values if 0 < value < inf])


def read_tir(path: str | Path) -> TirTyre:
    """Read a tyre property file of MF-Tyre 5.2 (PAC2002), 6.1 or 6.2.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    TirTyre

    Raises
    ------
    InputError
        When the file cannot be read, a line is no section, assignment, table or comment, or a key stands twice.
    """
    return parse_tir(read_text(path), source=str(path))


def parse_tir(text: str, *, source: str) -> TirTyre:
    """Interpret the text of a .tir file; ``read_tir`` says what is refused.

    Parameters
    ----------
    text : str
        Of the whole file.
    source : str
        Its name, for messages and where the file does not name the tyre.
    """
    return TirTyre(parse(text, source=source))
