"""What a critical speed is, and what tells it from the others of a model."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

from bicycle.eigenvalues.oscillation import angular_frequency, frequency_hz

OSCILLATORY, REAL = "oscillatory", "real"
DESTABILISING, STABILISING = "destabilising", "stabilising"


class CrossingIdentity(NamedTuple):
    """Which crossing it is, whatever its speed: the mode, which way, and the how-manieth of these from slow to fast.

    The same identity in two models stands for the same critical speed, moved.
    """

    mode: str
    destabilising: bool
    occurrence: int = 1

    def __str__(self) -> str:
        number = f" ({self.occurrence})" if self.occurrence > 1 else ""
        return f"{self.mode} {'unstable' if self.destabilising else 'stable'} above{number}"


@dataclass(frozen=True)
class CriticalSpeed:
    """A speed at which a mode changes its stability.

    Attributes
    ----------
    speed : float
        m/s.
    kind : str
        ``oscillatory`` (a pair crosses the imaginary axis) or ``real`` (a real root crosses zero).
    mode : str
        Name as in :func:`bicycle.modal.named_modes.modes`; empty as long as it is not known.
    frequency_hz : float
        Of the crossing pair, Hz; 0 for a real root.
    direction : str
        What happens to that root as the speed grows: ``stabilising`` or ``destabilising``.
    """

    speed: float
    kind: str
    mode: str
    frequency_hz: float
    direction: str

    @classmethod
    def of_root(cls, *, speed: float, root: complex, destabilising: bool, mode: str = "") -> "CriticalSpeed":
        """The critical speed at which a root lies on the imaginary axis.

        Parameters
        ----------
        speed : float
            m/s.
        root : complex
            The crossing root (1/s), of a pair either half; its imaginary part is exactly 0 for a real root.
        destabilising : bool
            Whether its real part rises with the speed.
        mode : str
            Name of the mode, where it is known.
        """
        kind = OSCILLATORY if root.imag else REAL
        hertz = abs(float(frequency_hz(root)))
        return cls(float(speed), kind, mode, hertz, DESTABILISING if destabilising else STABILISING)

    def __repr__(self) -> str:
        oscillation = f" at {self.frequency_hz:.4g} Hz" if self.oscillatory else ", a real root"
        return f"<CriticalSpeed {self.speed:.6g} m/s: {self.mode} {self.direction}{oscillation}>"

    @property
    def oscillatory(self) -> bool:
        """Whether a pair crosses, not a real root."""
        return self.kind == OSCILLATORY

    @property
    def destabilising(self) -> bool:
        """Whether the mode loses its stability as the speed grows."""
        return self.direction == DESTABILISING

    @property
    def angular_frequency(self) -> float:
        """Imaginary part of the crossing root, rad/s; 0 for a real root."""
        return float(angular_frequency(self.frequency_hz))

    @property
    def unstable_roots(self) -> int:
        """By how much the number of unstable roots grows here: +-2 for a pair, +-1 for a real root."""
        return (2 if self.oscillatory else 1) * (1 if self.destabilising else -1)

    def named(self, mode: str) -> "CriticalSpeed":
        """The same crossing of the mode called ``mode``."""
        return replace(self, mode=mode)


ACriticalSpeed = TypeVar("ACriticalSpeed", bound=CriticalSpeed)


def identified(crossings: Iterable[ACriticalSpeed]) -> dict[CrossingIdentity, ACriticalSpeed]:
    """Critical speeds of one model by their identity, in the order given.

    Parameters
    ----------
    crossings : iterable of CriticalSpeed
        From slow to fast, as :func:`bicycle.critical.critical_speeds.critical_speeds` gives them.
    """
    count = Counter[tuple[str, bool]]()
    identities = {}
    for crossing in crossings:
        key = (crossing.mode, crossing.destabilising)
        count[key] += 1
        identities[CrossingIdentity(*key, count[key])] = crossing
    return identities
