"""Draws that make no bicycle: which, how many, and why, in words."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]


@dataclass
class Refused:
    """Items (m,) that cannot be computed; each is counted once, for the first reason that is found."""

    mask: Mask
    reasons: dict[str, Mask] = field(default_factory=dict)
    examples: dict[str, str] = field(default_factory=dict)

    @classmethod
    def none(cls, count: int) -> "Refused":
        """All, a number ``count``, are possible so far."""
        return cls(np.zeros(count, bool))

    def add(self, why: str, mask: Mask, example: str = "") -> None:
        """Refuse more items for a reason, with the message of one of them where the reason does not say it all.

        Parameters
        ----------
        why : str
        mask : ndarray of bool, shape (m,)
        example : str
            A message.
        """
        new = np.broadcast_to(mask, self.mask.shape) & ~self.mask
        if new.any():
            self.reasons[why] = self.reasons.get(why, np.zeros_like(new)) | new
            self.examples.setdefault(why, example)
            self.mask = self.mask | new

    @property
    def counts(self) -> dict[str, int]:
        """How many are refused, by reason, with the example in brackets."""
        return {self.sentence(why): int(mask.sum()) for why, mask in self.reasons.items()}

    def sentence(self, why: str) -> str:
        """The reason ``why`` with its example."""
        example = self.examples.get(why, "")
        return f"{why}, for example: {example}" if example else why


def left_out(counts: Mapping[str, int], total: int) -> str:
    """Say how many of a number ``total`` of draws are left out and why; empty where none is.

    ``counts`` holds the number for each reason.
    """
    number = sum(counts.values())
    if not number:
        return ""
    why = "; ".join(counts) if len(counts) == 1 else "; ".join(f"{count}: {reason}" for reason, count in counts.items())
    verbs = "makes no bicycle that can be computed" if number == 1 else "make no bicycle that can be computed"
    return f"{number} of {total} draws {verbs} ({why}) and {'is' if number == 1 else 'are'} left out"
