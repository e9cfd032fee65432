"""Bands of the stability chart in the browser, on boundaries whose band is known by construction."""

from types import SimpleNamespace

import numpy as np
import pytest

from studies.chart import CLOSED, EDGE, Boundary, NamedBoundary
from studies.explorer import BAND_NAME, LIGHT, bands, note_hidden_bands

RADIUS, SLOPE = 0.3, 4.0  # of a circle in the middle; of the real part across it, 1/s per whole axis


def circle(sd):
    angle = np.linspace(0, 2 * np.pi, 200, endpoint=False)
    outward = np.stack([np.cos(angle), np.sin(angle)], -1)
    curve = Boundary(0.5 + RADIUS * outward, np.full(200, 1j), SLOPE * outward + 0j, np.ones(200), real=False,
                     ends=(CLOSED, CLOSED))  # fmt: skip
    return named(curve, sd)


def line(sd):
    shares = np.stack([np.full(50, 0.4), np.linspace(0, 1, 50)], -1)
    slopes = np.tile([SLOPE + 0j, 0j], (50, 1))
    return named(Boundary(shares, np.full(50, 1j), slopes, np.ones(50), real=False, ends=(EDGE, EDGE)), sd)


def named(curve, sd):
    count = len(curve.shares)
    return NamedBoundary(curve, ("weave",) * count, np.zeros(count, int), np.full(count, SLOPE * sd))


def chart(*boundaries, uncertain=True):
    """Of axes from 10 to 12 and from 0 to 100."""
    spans = (SimpleNamespace(at=lambda s: 10 + 2 * s), SimpleNamespace(at=lambda s: 100 * s))
    plane = SimpleNamespace(spans=spans, x=lambda shares: np.asarray(shares) * [2, 100] + [10, 0])
    return SimpleNamespace(boundaries=boundaries, plane=plane, uncertain=uncertain)


def rims(trace):
    parts, found = [[]], list(zip(trace["x"], trace["y"], strict=True))
    for x, y in found:
        parts.append([]) if x is None else parts[-1].append(((x - 10) / 2, y / 100))
    return [np.array(part) for part in parts]


@pytest.mark.parametrize("sd", [0.02, 0.004])  # drawn by cells, and along the normals
def test_a_band_ends_at_1_96_standard_deviations_on_both_sides(sd):
    (trace,) = bands(chart(circle(sd)), LIGHT)
    found = sorted(float(np.hypot(*(rim - 0.5).T).mean()) for rim in rims(trace))
    assert found == pytest.approx([RADIUS - 1.96 * sd, RADIUS + 1.96 * sd], abs=2e-4)
    assert all(np.hypot(*(rim - 0.5).T) == pytest.approx(np.hypot(*(rim[0] - 0.5)), abs=1e-3) for rim in rims(trace))
    turned = [np.sum(rim[:-1, 0] * rim[1:, 1] - rim[1:, 0] * rim[:-1, 1]) > 0 for rim in rims(trace)]
    assert sorted(turned) == [False, True]  # the inner rim is a hole
    assert (trace["fill"], trace["line"]["dash"], trace["name"]) == ("toself", "dot", BAND_NAME)


def test_what_is_too_narrow_too_wide_or_exact_has_none():
    assert bands(chart(line(0.0005)), LIGHT) == []
    assert note_hidden_bands(chart(line(0.02), line(0.0005))) == [
        "boundary 2: its band is narrower than its line; the table gives the standard uncertainties"
    ]
    assert bands(chart(line(0.2)), LIGHT) == []  # the doubts of the chart say so
    assert bands(chart(line(0.02), uncertain=False), LIGHT) == []
    assert note_hidden_bands(chart(line(0.0005), uncertain=False)) == []
