"""Coordinates of inertias: what they give is a body, the priors are those stated, and exact numbers stay exact."""

import numpy as np
import pytest

from bicycle import Bicycle, Model, available_bicycles, load_bicycle
from bicycle.model import standard_deviations
from bicycle.parameters import bounds_beside, fitting_moments, inertia_coordinates, is_rod

FRAMES, WHEELS = ("B", "H"), ("R", "F")


def of(name, only=""):
    """Values, standard deviations and coordinates of a packaged bicycle; ``only`` some keys float."""
    bicycle = load_bicycle(name)
    sd = {key: one.sd for key, one in standard_deviations(Model(bicycle)).items()}
    sd = {key: size for key, size in sd.items() if size > 0 and (not only or key in only.split())}
    return dict(bicycle.values), sd, inertia_coordinates(bicycle.values, sd)


def moments(values, keys, inertias):
    """Principal moments in the plane (K,) and thickness of wheels (K,), of the bicycle with these inertias."""
    every = {
        **{key: np.full(inertias.shape[1], value) for key, value in values.items()},
        **dict(zip(keys, inertias, strict=True)),
    }
    found = []
    for body in FRAMES:
        xx, zz, xz = (every[f"I{body}{axes}"] for axes in ("xx", "zz", "xz"))
        found.append(np.linalg.eigvalsh(np.moveaxis(np.array([[xx, xz], [xz, zz]]), -1, 0)).min(1) / (xx + zz))
    for body in WHEELS:
        xx, yy = every[f"I{body}xx"], every[f"I{body}yy"]
        found += [yy / xx, (2 * xx - yy) / xx]
    return np.array(found)


@pytest.mark.parametrize("name", available_bicycles())
@pytest.mark.parametrize("size", [1.0, 30.0])
def test_no_coordinates_lead_out_of_the_bodies_that_exist(name, size):
    values, sd, inertias = of(name)
    scale = size * np.array([[sd[key]] for key in inertias.keys])
    coordinates = inertias.origin + scale * np.random.default_rng(57).normal(size=(len(scale), 2000))
    coordinates = np.maximum(coordinates, inertias.lowest[:, None])
    assert moments(values, inertias.keys, inertias.values(coordinates)).min() > -1e-12
    straight = moments(values, inertias.keys, coordinates).min()
    assert straight < 0 or size < 2  # by themselves the coordinates would


@pytest.mark.parametrize("name", ["benchmark", "kooijman2008", "pista_charlie_drops"])
def test_priors_are_as_stated_to_first_order(name):
    _, sd, inertias = of(name)
    spread = np.array([sd[key] for key in inertias.keys])
    assert inertias.values(inertias.origin)[:, 0] == pytest.approx(inertias.origin[:, 0], rel=1e-15)
    step = 1e-4 * np.diag(spread)
    forward, backward = (inertias.values(inertias.origin + sign * step) for sign in (1, -1))
    slopes = (forward - backward) / (2e-4 * spread)
    covariance = slopes @ np.diag(spread**2) @ slopes.T
    assert covariance / np.outer(spread, spread) == pytest.approx(np.eye(len(spread)), abs=1e-6)


def test_one_standard_deviation_is_one_where_the_boundary_is_far():
    _, sd, inertias = of("benchmark", "IBxx IBzz IBxz")
    spread = np.array([[sd[key]] for key in inertias.keys])
    for sign in (1, -1):
        assert inertias.values(inertias.origin + sign * spread) == pytest.approx(
            inertias.origin + sign * spread, rel=1e-4
        )


def test_a_frame_comes_as_near_to_a_rod_as_one_likes_and_never_passes_it():
    """((9.2, 2.4), (2.4, 11)): along Ixz alone a rod is reached at sqrt(9.2 11)."""
    values, _, inertias = of("benchmark", "IBxz")
    assert inertias.keys == ("IBxz",)
    rod = np.sqrt(values["IBxx"] * values["IBzz"])
    there = inertias.values(np.array([[-1e3, rod, 15.0, 1e3]]))[0]
    assert there[0] == pytest.approx(-rod, rel=1e-6)
    assert 2.4 < there[1] < there[2] < there[3] < rod
    assert there[3] == pytest.approx(rod, rel=1e-6)


def test_a_flat_wheel_grows_thicker_and_never_thinner():
    values, sd, inertias = of("kooijman2008")
    thickness = inertias.keys.index("IRxx")
    assert values["IRxx"] == values["IRyy"] / 2
    assert inertias.lowest[thickness] == pytest.approx(values["IRxx"], rel=1e-12)
    coordinates = inertias.origin.copy()
    coordinates[thickness] += sd["IRxx"]
    found = dict(zip(inertias.keys, inertias.values(coordinates)[:, 0], strict=True))
    size = np.hypot(sd["IRxx"], sd["IRyy"] / 2)  # of the thickness
    assert found["IRxx"] - found["IRyy"] / 2 == pytest.approx(size, rel=1e-9)


@pytest.mark.parametrize("beyond", [-1e-3, 1e-12, 4e-4, 0.05])  # of 2 Ixx, by which the front wheel is stated flatter
def test_wheels_stated_flatter_than_flat_are_written_as_wheels_that_exist(beyond):
    """The way began beyond the bound of the thickness, and being shortened it ended there, by 6e-7 in one diagnosis."""
    values, sd, _ = of("kooijman2008")
    values["IFyy"] = 2 * values["IFxx"] * (1 + beyond)
    inertias = inertia_coordinates(values, sd)
    scale = 10 * np.array([[sd[key]] for key in inertias.keys])
    coordinates = inertias.begin + scale * np.random.default_rng(571).normal(size=(len(scale), 300))
    written = inertias.values(np.maximum(coordinates, inertias.lowest[:, None]))
    assert moments(values, inertias.keys, written).min() > -1e-12
    for sample in written.T[:40]:
        every = {**values, **dict(zip(inertias.keys, sample, strict=True))}
        bicycle = Bicycle("written", {**every, **fitting_moments(every)})
        assert not [text for text in bicycle.warnings if "triangle" in text]
    stated = np.array([[values[key]] for key in inertias.keys])  # where the prior is centred
    assert inertias.values(stated) == pytest.approx(stated, rel=1e-4)


def test_what_floats_alone_has_plain_bounds():
    values = load_bicycle("benchmark").values
    assert bounds_beside("IRxx", values) == (values["IRyy"] / 2, np.inf)
    assert bounds_beside("IFyy", values) == (0.0, 2 * values["IFxx"])
    assert bounds_beside("mB", values)[0] == 0
    assert bounds_beside("IRyy", values | {"IRxx": 0.0}) == (0.0, np.inf)  # the mass of the wheel is in the frame's
    assert inertia_coordinates(values, {"IRxx": 0.1, "mB": 1.0}) is None


def test_a_rod_has_no_room():
    values = {**load_bicycle("benchmark").values, "IHxx": 0.04, "IHzz": 0.01, "IHxz": 0.02}
    assert is_rod(values, ("IHxx", "IHzz", "IHxz"))
    assert not is_rod(values, ("IBxx", "IBzz", "IBxz"))
    assert inertia_coordinates(values, {"IHxx": 0.01}) is None


def test_a_moment_that_no_motion_shows_goes_where_the_others_allow():
    values = dict(load_bicycle("kooijman2008").values)
    assert fitting_moments(values) == {}
    low, high = np.linalg.eigvalsh([[values["IBxx"], values["IBxz"]], [values["IBxz"], values["IBzz"]]])
    assert fitting_moments({**values, "IByy": 100.0}) == pytest.approx({"IByy": low + high})
    assert fitting_moments({**values, "IByy": 0.0}) == pytest.approx({"IByy": high - low})
    moved = Bicycle("moved", {**values, **fitting_moments({**values, "IByy": 100.0})})
    assert not any("triangle" in text for text in moved.warnings)
