"""Whether roots that are linked across a step keep apart inside it, compiled. Needs numba (extra ``fast``).

Two roots meet where their discriminant (a - b)^2 is zero. It is smooth where roots are not, so that Hermite's cubic of
the two ends tells whether it may be zero in between: two real roots that are a pair for a moment, a pair that splits
for a moment, two pairs of which it is not plain whether they cross or turn back.
"""

import math

from bicycle.eigenvalues.compilation import compiled_within
from bicycle.modal.apart import AWAY, BLURRED, FAR, LOOKS
from bicycle.modal.cubic_kernel import hermite, miss, reach
from bicycle.modal.matching import TWIN
from bicycle.modal.track_kernel import MEETING, Track


@compiled_within
def keep_apart(t: Track, b: int, left: int, right: int, kind: int) -> bool:
    """Whether no two roots can meet in a step, beyond those two that it is known for.

    Parameters
    ----------
    t : Track
    b, left, right : int
        Indices of the bicycle and the two nodes.
    kind : int
        Number of the kind of step: SMOOTH, or MEETING where two roots meet.
    """
    n = t.re.shape[2]
    h = t.v[b, right] - t.v[b, left]
    size = 0.0
    for i in range(n):
        size = max(size, math.hypot(t.re[b, left, i], t.im[b, left, i]))
        size = max(size, math.hypot(t.re[b, right, i], t.im[b, right, i]))
    blur = BLURRED * TWIN * size
    for i in range(n):
        if t.im[b, left, i] < 0.0 or (kind == MEETING and i in (t.two[b, left, 0], t.two[b, left, 1])):
            continue
        p = t.match[b, left, i]
        if t.im[b, left, i] > 0.0:
            a, z = t.im[b, left, i], t.im[b, right, p]
            if not _stays(a, z, h * t.dim[b, left, i], h * t.dim[b, right, p], blur):
                return False
        for j in range(i):
            if (t.im[b, left, i] > 0.0) != (t.im[b, left, j] > 0.0) or t.im[b, left, j] < 0.0:
                continue
            if kind == MEETING and j in (t.two[b, left, 0], t.two[b, left, 1]):
                continue
            q = t.match[b, left, j]
            x, y = t.re[b, left, i] - t.re[b, left, j], t.re[b, right, p] - t.re[b, right, q]
            dx, dy = h * (t.dre[b, left, i] - t.dre[b, left, j]), h * (t.dre[b, right, p] - t.dre[b, right, q])
            if t.im[b, left, i] == 0.0:
                if not _stays(x, y, dx, dy, blur):
                    return False
                continue
            u, w = t.im[b, left, i] - t.im[b, left, j], t.im[b, right, p] - t.im[b, right, q]
            du, dw = h * (t.dim[b, left, i] - t.dim[b, left, j]), h * (t.dim[b, right, p] - t.dim[b, right, q])
            if not _pairs_stay(x, u, dx, du, y, w, dy, dw, blur):
                return False
    return True


@compiled_within
def _stays(a: float, z: float, rise_a: float, rise_z: float, blur: float) -> bool:
    """Whether a distance with these ends and slopes, and its square, stay away from zero."""
    if min(abs(a), abs(z)) < blur:
        return False
    if AWAY * abs(rise_a) < abs(a) and AWAY * abs(rise_z) < abs(z) and abs(z - a) < 0.5 * abs(a):
        return True
    least, _ = reach(a * a, z * z, 2.0 * a * rise_a, 2.0 * z * rise_z)
    return least > blur * blur + FAR * miss(a * a, z * z, 2.0 * a * rise_a, 2.0 * z * rise_z)


@compiled_within
def _pairs_stay(
    x: float, u: float, dx: float, du: float, y: float, w: float, dy: float, dw: float, blur: float
) -> bool:  # fmt: skip
    """Whether the distance x + iu of two upper halves, which is y + iw at the end, stays away from zero."""
    first, last = math.hypot(x, u), math.hypot(y, w)
    if min(first, last) < blur:
        return False
    slow = AWAY * math.hypot(dx, du) < first and AWAY * math.hypot(dy, dw) < last
    if slow and math.hypot(y - x, w - u) < 0.5 * first:
        return True
    a, c = x * x - u * u, 2.0 * x * u
    da, dc = 2.0 * (x * dx - u * du), 2.0 * (x * du + u * dx)
    z, s = y * y - w * w, 2.0 * y * w
    dz, ds = 2.0 * (y * dy - w * dw), 2.0 * (y * dw + w * dy)
    off = blur * blur + FAR * math.hypot(miss(a, z, da, dz), miss(c, s, dc, ds))
    for look in range(LOOKS + 1):
        at = look / LOOKS
        if math.hypot(hermite(a, z, da, dz, at), hermite(c, s, dc, ds, at)) <= off:
            return False
    return True
