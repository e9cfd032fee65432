"""Joint uncertainty of some parameters of a model, with the degrees of freedom behind it."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from tyre.base.arrays import Array
from tyre.base.errors import InputError
from tyre.joint_properties import effective_degrees_of_freedom


@dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """Covariance of parameters whose errors hang together, as those of one measured tyre do.

    Attributes
    ----------
    names : tuple of str
        ``effect.name[.wheel]`` or bicycle keys, p of them.
    matrix : ndarray, shape (p, p)
        SI units.
    variance_spread : tuple of ndarray, shape (p, p) each
        As in :class:`tyre.joint_properties.JointCovariance`; empty where the standard deviations are known well.

    Raises
    ------
    InputError
        Matrices of another size than the names, or a name that stands twice.
    """

    names: tuple[str, ...] = ()
    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)))
    variance_spread: tuple[Array, ...] = ()

    def __post_init__(self) -> None:
        size = len(self.names)
        if len(set(self.names)) < size:
            raise InputError(f"covariance of {', '.join(self.names)}: a parameter stands there twice; keep one")
        for matrix in (self.matrix, *self.variance_spread):
            if np.shape(matrix) != (size, size):
                raise InputError(
                    f"covariance of {', '.join(self.names) or 'no parameter'} has the shape {np.shape(matrix)}; "
                    f"it must be {size} x {size}"
                )

    def __eq__(self, other: object) -> bool:
        return isinstance(other, ParameterCovariance) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @property
    def _content(self) -> tuple[object, ...]:
        matrices = (self.matrix, *self.variance_spread)
        return (self.names, *(tuple(np.asarray(matrix, float).ravel().tolist()) for matrix in matrices))

    @property
    def sd(self) -> dict[str, float]:
        """One standard deviation of each parameter."""
        return dict(zip(self.names, np.sqrt(np.diag(self.matrix)).tolist(), strict=True))

    def among(self, names: Sequence[str]) -> Array:
        """The covariance among other parameters, zero for those it says nothing of, shape (q, q).

        Parameters
        ----------
        names : sequence of str
            q of them.
        """
        return _among(self.matrix, self.names, names)

    def degrees_of_freedom(self, names: Sequence[str], gradient: ArrayLike, covariance: Array) -> float:
        """Effective degrees of freedom behind the variance g' S g of a result (Welch-Satterthwaite).

        Parameters
        ----------
        names : sequence of str
            Parameters of the gradient, q of them; those of which nothing is said here count as known well.
        gradient : array_like, shape (q,)
            Of the result.
        covariance : ndarray, shape (q, q)
            Of these parameters, what is said here included.
        """
        spread = [_among(part, self.names, names) for part in self.variance_spread]
        return effective_degrees_of_freedom(gradient, covariance, spread)

    def and_also(self, other: "ParameterCovariance") -> "ParameterCovariance":
        """This and the covariance of parameters that have nothing in common with it.

        Parameters
        ----------
        other : ParameterCovariance
            Of further parameters.
        """
        names = (*self.names, *other.names)
        parts = [(self.names, part) for part in self.variance_spread]
        parts += [(other.names, part) for part in other.variance_spread]
        return ParameterCovariance(
            names,
            _among(self.matrix, self.names, names) + _among(other.matrix, other.names, names),
            tuple(_among(part, mine, names) for mine, part in parts),
        )


def _among(matrix: Array, mine: Sequence[str], names: Sequence[str]) -> Array:
    select = np.array([[float(name == own) for own in mine] for name in names]).reshape(len(names), len(mine))
    return np.asarray(select @ np.asarray(matrix, float) @ select.T)
