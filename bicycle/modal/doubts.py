"""Why a batch is not sure of a bicycle and leaves it to the track, as numbers and in words."""

from collections.abc import Mapping
from types import MappingProxyType

SURE = 0
NO_VECTORS, TOO_CLOSE, NOT_CLEAR, BESIDE_A_CHANGE, RIVALS, STIFF = 1, 2, 3, 4, 5, 6
NO_ANCHOR, SHORT_PAIR, NO_HEIR, BEYOND = 9, 10, 11, 12
WHY: Mapping[int, str] = MappingProxyType({
    NO_VECTORS: "a root without eigenvectors",
    TOO_CLOSE: "roots that come too close",
    NOT_CLEAR: "roles that two modes play nearly alike",
    NO_ANCHOR: "two speeds at which names are equally plain",
    SHORT_PAIR: "real roots that are a pair for a short while",
    NO_HEIR: "roots that change hands in two ways",
    BESIDE_A_CHANGE: "names change next to a speed asked for",
    BEYOND: "speeds that cannot be tracked",
    STIFF: "models that are nearly too stiff to be computed",
    RIVALS: "roots that are too close at a speed asked for",
})  # fmt: skip
"""By status."""

SMALLEST = 2.0**-16  # of the unit of speed: a step below it is left to the track
NODES = 192  # of one bicycle at most
