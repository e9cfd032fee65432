"""The linear model with numbers: E x' = F(v) x + B(v) u, y = C(v) x + D(v) u, with names, units and validity."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bicycle.equations.declarations import Declarations
from bicycle.equations.evaluation import Matrices
from bicycle.equations.speed_polynomial import SpeedPolynomial
from bicycle.model.eigen import in_batches
from tyre.ground.arrays import Array
from tyre.ground.errors import InputError, refuse_unknown


@dataclass(frozen=True)
class SpeedRange:
    """The matrices that hold for lower < v <= upper (m/s); most models have a single range from 0 to infinity."""

    lower: float  # m/s, not in the range
    upper: float  # m/s, in the range
    matrices: Matrices  # polynomials in the speed


@dataclass(frozen=True, eq=False)
class LinearModel:
    """Lateral dynamics of one bicycle as a descriptor system, a Laurent polynomial in the forward speed v.

    Attributes
    ----------
    states, inputs, outputs : tuple of str
        Names; angles in rad, rates in rad/s, ``rear_lateral_velocity`` in m/s, lateral forces in N, torques in N m.
    ranges : tuple of SpeedRange
        One, or several where a controller switches at a speed.
    scale : ndarray, shape (n,)
        Fixed powers of two: ``state = scale * scaled state``. Forces in newtons next to angles in radians would cost
        slow modes their last digits.
    parameters : mapping
        Every bicycle and effect parameter, ``effect.name[.wheel]``, SI.
    static_loads : (float, float)
        Vertical load of the rear and front wheel at rest, N.
    warnings : tuple of str
        What a reader of a result must know.
    declared : Declarations
        Unit and role of every state, the modes that the effects bring, units of inputs and outputs.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    ranges: tuple[SpeedRange, ...]
    scale: Array
    parameters: Mapping[str, float]
    static_loads: tuple[float, float]
    effects: tuple[str, ...] = ()  # their identifiers
    warnings: tuple[str, ...] = field(default=())
    declared: Declarations = field(default=Declarations(), repr=False)

    def __repr__(self) -> str:
        rear, front = self.static_loads
        switches = f", equations switch at {', '.join(f'{r.lower:g}' for r in self.ranges[1:])} m/s"
        return (
            f"<LinearModel with {', '.join(self.effects) or 'no effects'}: {self.order} states "
            f"({', '.join(self.states)})\n"
            f" inputs {', '.join(self.inputs) or 'none'}; wheel loads {rear:.4g} N rear, {front:.4g} N front"
            f"{switches if len(self.ranges) > 1 else ''}; {len(self.warnings)} warnings>"
        )

    @property
    def order(self) -> int:
        """Number of states."""
        return len(self.states)

    @property
    def singular_at_rest(self) -> bool:
        """True where the model divides by the speed (side slip without relaxation)."""
        return any(-1 in at.matrices.dynamics for at in self.ranges)

    @cached_property
    def coefficients(self) -> tuple[SpeedPolynomial, ...]:
        """The scaled state matrix (n, n) of each speed range as a polynomial in v.

        A(v) = sum over k of v^k A_k has the eigenvalues of the model; its states are the model's divided by ``scale``.
        """
        return tuple(
            SpeedPolynomial(
                {
                    power: np.linalg.solve(at.matrices.mass, matrix * self.scale) / self.scale[:, None]
                    for power, matrix in at.matrices.dynamics.items()
                },
                shape=(self.order, self.order),
            )
            for at in self.ranges
        )

    def by_range(self, speeds: ArrayLike) -> list[tuple[int, NDArray[np.intp]]]:
        """Numbers of the ``ranges`` that hold some of the ``speeds`` (m,), m/s, rising, and the places of these speeds.

        A speed at which the equations switch belongs to the range below.
        """
        v = np.atleast_1d(np.asarray(speeds, float))
        number = np.searchsorted([at.upper for at in self.ranges], v)
        return [(int(k), np.flatnonzero(number == k)) for k in np.unique(number)]

    def check_speeds(self, speeds: ArrayLike) -> Array:
        """Speeds as an array; refuses negative, non-finite and, for a model singular at rest, zero speeds.

        Parameters
        ----------
        speeds : array_like, shape (...)
            m/s.

        Raises
        ------
        InputError
            Naming the first speed that is not allowed.
        """
        v = np.asarray(speeds, float)
        bad = ~np.isfinite(v) | (v < 0)
        if bad.any():
            raise InputError(f"speed {v[bad].flat[0]:g} m/s is not allowed; give finite speeds >= 0 m/s")
        if self.singular_at_rest and (v == 0).any():
            raise InputError(
                "speed 0 m/s is not allowed with side_slip: slip without relaxation is singular at rest; "
                "give speeds > 0 or use relaxation_length"
            )
        return v

    def state_matrix(self, speeds: ArrayLike) -> Array:
        """Scaled state matrices, whose eigenvalues (1/s) are the model's own.

        Parameters
        ----------
        speeds : array_like, shape (...)
            m/s.

        Returns
        -------
        ndarray, shape (..., n, n)
        """
        v = self.check_speeds(speeds)
        if len(self.ranges) == 1:
            return self.coefficients[0](v)
        matrices = np.empty((v.size, self.order, self.order))
        for number, places in self.by_range(v.ravel()):
            matrices[places] = self.coefficients[number](v.ravel()[places])
        return matrices.reshape(*v.shape, self.order, self.order)

    def eigenvalues(self, speeds: ArrayLike, *, threads: int = 1) -> NDArray[np.complex128]:
        """Eigenvalues (1/s), sorted by real then imaginary part.

        Where real parts differ by rounding only, as at rest without dampers, the processor decides the order:
        :func:`bicycle.stability.named_modes.modes` names the roots.

        Parameters
        ----------
        speeds : array_like, shape (...)
            m/s.
        threads : int
            Number of threads that more than a thousand speeds are spread over; the result does not depend on it.

        Returns
        -------
        ndarray of complex, shape (..., n)

        Raises
        ------
        InputError
            A speed the model does not allow, or fewer threads than one.
        """
        v = self.check_speeds(speeds)
        flat = v.reshape(-1)
        matrices = in_batches(lambda part: self.state_matrix(flat[part]), (v.size, self.order), threads)
        return matrices.reshape(*v.shape, self.order)

    def matrices_at(self, speed: float) -> tuple[Array, Array, Array]:
        """State, input and output matrix (A, B, C) in physical units at one speed; D is :meth:`feedthrough`.

        Parameters
        ----------
        speed : float
            m/s.

        Returns
        -------
        state, input, output : ndarray, shape (n, n), (n, inputs), (outputs, n)
        """
        m, v = self._matrices(speed)
        state, inputs = (np.linalg.solve(m.mass, part(v)) for part in (m.dynamics, m.input_matrix))
        return np.asarray(state, float), np.asarray(inputs, float), m.output_matrix(v)

    def feedthrough(self, speed: float) -> Array:
        """Direct gain D (outputs, inputs) at one ``speed`` (m/s): slip acts at once on a force without lag."""
        m, v = self._matrices(speed)
        return m.feedthrough(v)

    def _matrices(self, speed: float) -> tuple[Matrices, float]:
        v = float(self.check_speeds(speed))
        ((number, _),) = self.by_range(v)
        return self.ranges[number].matrices, v

    def to_control(
        self,
        speed: float,
        *,
        inputs: Sequence[str] = ("steer_torque", "lean_torque"),
        outputs: Sequence[str] | None = None,
    ) -> Any:
        """Return the model at one speed as a ``control.StateSpace`` with the model's names.

        It is called ``bicycle at 5,5 m/s``: control allows no dot in the name of a system.

        Parameters
        ----------
        speed : float
            m/s.
        inputs : sequence of str
            Names of inputs of the model, in the order of the columns.
        outputs : sequence of str, optional
            Names of outputs of the model, in the order of the rows; all of them when not given.

        Raises
        ------
        InputError
            An input or output that the model does not have.
        """
        import control

        chosen = tuple(self.outputs) if outputs is None else tuple(outputs)
        state, input_matrix, output_matrix = self.matrices_at(speed)
        refuse_unknown("input", inputs, self.inputs)
        refuse_unknown("output", chosen, self.outputs)
        columns, rows = [self.inputs.index(name) for name in inputs], [self.outputs.index(name) for name in chosen]
        name = f"bicycle at {speed:g} m/s".replace(".", ",")  # a dot in a name separates system and signal in control
        return control.StateSpace(
            state,
            input_matrix[:, columns],
            output_matrix[rows],
            self.feedthrough(speed)[np.ix_(rows, columns)],
            states=list(self.states),
            inputs=list(inputs),
            outputs=list(chosen),
            name=name,
        )
