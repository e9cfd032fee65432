"""The body's segments: against thin slices summed by hand, and what a body must obey."""

import math

import numpy as np
import pytest

from bicycle.rider import Contacts, Lengths, join, read_rider, sit
from bicycle.rider import rider_body as human
from tyre.ground import InputError

yeadon = pytest.importorskip("yeadon")
AT = Contacts(np.array([0.2, -0.96]), np.array([0.4, -0.28]), np.array([0.9, -0.78]), 0.21)


def configuration(rider, lean=0.9):
    return sit(Lengths.of(rider.lengths), AT, torso_lean=lean).configuration


def slices(solid, count=400):
    """Mass and second moments (about the origin of the person) of a solid cut into thin stadium-shaped slices."""
    start, end = np.ravel(solid.pos), np.ravel(solid.end_pos)
    turn, thin = np.asarray(solid._rot_mat), solid.density * solid.height / count
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for s in (np.arange(count) + 0.5) / count:
        if hasattr(solid, "stads"):
            t, r = (
                (1 - s) * getattr(solid.stads[0], n) + s * getattr(solid.stads[1], n) for n in ("thickness", "radius")
            )
        else:
            t, r = 0.0, solid.radius * math.sqrt(1 - s * s)
        area = 4 * r * t + math.pi * r**2
        along = 4 * r * t**3 / 3 + math.pi * r**2 * t**2 + 8 * r**3 * t / 3 + math.pi * r**4 / 4
        across = 4 * t * r**3 / 3 + math.pi * r**4 / 4
        if getattr(solid, "alignment", "ML") == "AP":
            along, across = across, along
        place = start + s * (end - start)
        mass += thin * area
        first += thin * area * place
        second += thin * (area * np.outer(place, place) + turn @ np.diag([along, across, 0]) @ turn.T)
    return mass, first, second


def test_mass_centre_and_inertia_are_those_of_thin_slices():
    """Independent of the formulas and of the turns of yeadon: only its outlines, densities and places are used."""
    rider = read_rider("charlie")
    angles = configuration(rider)
    with human.quiet_yeadon():
        person = yeadon.Human(dict(rider.lengths))
        person.set_CFG_dict(dict(angles))
    parts = [slices(solid) for segment in person.segments for solid in segment.solids]
    mass, first, second = (sum(p[k] for p in parts) for k in range(3))
    centre = first / mass
    about = second - mass * np.outer(centre, centre)
    inertia = np.trace(about) * np.eye(3) - about
    factor = rider.mass / mass
    bodies = human.segments(rider, angles, np.zeros(2))
    found = join([part.body for part in bodies])
    axes = np.array([[0, -1, 0], [-1, 0, 0], [0, 0, -1]])  # x back, y left, z up are minus x, y, z of the bicycle
    np.testing.assert_allclose(found.centre, axes @ centre, atol=1e-5)
    np.testing.assert_allclose(found.inertia, factor * axes @ inertia @ axes.T, atol=2e-4)
    for part, segment in zip(bodies, person.segments, strict=True):  # the long side of a stadium lies across, or along
        solids = [solid for solid in segment.solids if hasattr(solid, "stads")]
        long = np.array([[s.radius + s.thickness, s.radius] for solid in solids for s in solid.stads])
        along = np.repeat([solid.alignment == "AP" for solid in solids], 2)
        half = np.stack([np.linalg.norm(part.wide, axis=1), np.linalg.norm(part.deep, axis=1)], 1)[: len(long)]
        np.testing.assert_allclose(half, np.where(along[:, None], long[:, ::-1], long))


def test_a_seated_body_is_symmetric_and_keeps_its_mass():
    rider = read_rider("jason")
    parts = human.segments(rider, configuration(rider), AT.hip)
    body = join([part.body for part in parts])
    assert len(parts) == 11
    assert body.mass == pytest.approx(83.5)
    assert body.centre[1] == pytest.approx(0, abs=1e-12)
    assert body.inertia[0, 1] == pytest.approx(0, abs=1e-12)
    assert body.inertia[1, 2] == pytest.approx(0, abs=1e-12)
    a, b, c = np.linalg.eigvalsh(body.inertia)
    assert a > 0
    assert c < a + b


def test_a_body_does_not_change_the_next_one():
    """yeadon keeps densities scaled to one person's mass for all that follow; here every body is its own."""
    light, heavy = read_rider("jason").weighing(60), read_rider("jason").weighing(120)
    angles = configuration(light)
    before, after = (
        sum(p.body.mass for p in human.segments(rider, angles, AT.hip, densities="Clauser")) for rider in (light, heavy)
    )
    assert (before, after) == (pytest.approx(60), pytest.approx(120))
    assert human.yeadon_module().Human.segmental_densities["Dempster"]["thigh"] == 1050


def test_a_missing_package_names_the_remedy(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "yeadon", None)
    with pytest.raises(
        InputError, match=r"needs yeadon: yeadon is not installed; install it with: pip install .*\[rider\]"
    ):
        human.segments(read_rider("jason"), {}, AT.hip)
