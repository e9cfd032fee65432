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
    origin : str
        Where it comes from, in words: the tyre's table, or the model file that states it.

    Raises
    ------
    InputError
        Matrices of another size than the names, or a name that stands twice.
    """

    names: tuple[str, ...] = ()
    matrix: Array = field(default_factory=lambda: np.zeros((0, 0)))
    variance_spread: tuple[Array, ...] = ()
    origin: str = "tyre table"

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


def checked_covariance(names: Sequence[str], covariance: ArrayLike) -> Array:
    """The covariance of parameters as an array (p, p).

    Parameters
    ----------
    names : sequence of str
        Of the parameters, p of them.
    covariance : array_like, shape (p, p)
        SI units.

    Raises
    ------
    InputError
        A name that stands twice, or a matrix that is of another size, not finite, or no covariance.
    """
    if not names:
        raise InputError("no parameter is uncertain: give at least one name with its covariance")
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(f"{twice} is given twice; keep one")
    spread, size = np.asarray(covariance, float), len(names)
    if spread.shape != (size, size) or not np.isfinite(spread).all():
        raise InputError(f"covariance of {', '.join(names)} must be {size} x {size} finite numbers")
    sd = np.sqrt(np.maximum(np.diag(spread), 0.0))
    scale = np.where(sd > 0, sd, 1.0)
    with np.errstate(all="ignore"):  # variances near the end of what a float holds
        correlation = spread / np.outer(scale, scale)
    symmetric = np.isfinite(correlation).all() and np.allclose(correlation, correlation.T, rtol=0, atol=1e-9)
    if not symmetric or np.linalg.eigvalsh(correlation)[0] < -1e-9:
        raise InputError(f"covariance of {', '.join(names)} must be symmetric without negative eigenvalues")
    return spread
