"""Riders and loads by mass, place and inertia, joined to a frame; expected by the theorem of Steiner with tensors."""

import json

import numpy as np
import pytest
import tomli_w
import yaml

from bicycle import load_bicycle
from bicycle.model import build_model
from tyre.ground import InputError

FRAME = dict(load_bicycle("pista").values)
RIDER = {"name": "rider", "mass": 75.0, "place": [0.35, 1.05], "inertia": [8.0, 9.0, 2.5, 1.2]}


def joined(frame, *bodies):
    """Mass, centre and tensor of a frame with bodies (mass, x, z, tensor), about the common centre."""
    tensor = np.array([[frame["IBxx"], 0, frame["IBxz"]], [0, 0, 0], [frame["IBxz"], 0, frame["IBzz"]]])
    parts = [(frame["mB"], frame["xB"], frame["zB"], tensor), *bodies]
    mass = sum(part[0] for part in parts)
    x, z = (sum(part[0] * part[k] for part in parts) / mass for k in (1, 2))
    whole = np.zeros((3, 3))
    for m, own_x, own_z, own in parts:
        r = np.array([own_x - x, 0.0, own_z - z])
        whole += own + m * (r @ r * np.eye(3) - np.outer(r, r))
    return {"mB": mass, "xB": x, "zB": z, "IBxx": whole[0, 0], "IBzz": whole[2, 2], "IBxz": whole[0, 2]}


def tensor(xx, yy, zz, xz=0.0):
    return np.array([[xx, 0, xz], [0, yy, 0], [xz, 0, zz]])


def values(**more):
    return {"values": FRAME, **more}


@pytest.mark.parametrize("inertia", [[8.0, 9.0, 2.5, 1.2], [8.0, 9.0, 2.5], None])
def test_a_rider_by_mass_place_and_inertia(tmp_path, inertia):
    body = {key: value for key, value in RIDER.items() if key != "inertia"}
    body |= {"inertia": inertia} if inertia else {}
    path = tmp_path / "ridden.toml"
    path.write_text(tomli_w.dumps(values(bodies=[body])))
    right = joined(FRAME, (75.0, 0.35, -1.05, tensor(*inertia) if inertia else np.zeros((3, 3))))
    found = load_bicycle(path)
    assert {key: found[key] for key in right} == pytest.approx(right, rel=1e-12)
    assert {key: found[key] for key in FRAME if key not in (*right, "IByy")} == {
        key: value for key, value in FRAME.items() if key not in (*right, "IByy")
    }


@pytest.mark.parametrize("form", ["json", "yml", "model file"])
def test_every_form_that_holds_lists_takes_bodies(tmp_path, form):
    right = joined(FRAME, (75.0, 0.35, -1.05, tensor(8.0, 9.0, 2.5, 1.2)))
    content = values(bodies=[RIDER])
    if form == "model file":
        found = build_model({"bicycle": {**FRAME, "bodies": [RIDER]}}).bicycle
    else:
        path = tmp_path / f"ridden.{form}"
        path.write_text(json.dumps(content) if form == "json" else yaml.safe_dump(content))
        found = load_bicycle(path)
    assert {key: found[key] for key in right} == pytest.approx(right, rel=1e-12)


def test_a_body_of_a_file_whose_z_points_up(tmp_path):
    """Place is a height either way; the product of inertia turns."""
    up = FRAME | {key: -FRAME[key] for key in ("zB", "zH", "IBxz", "IHxz")}
    path = tmp_path / "up.toml"
    body = RIDER | {"inertia": [8.0, 9.0, 2.5, -1.2]}
    path.write_text(tomli_w.dumps({"z_up": True, "values": up, "bodies": [body]}))
    right = joined(FRAME, (75.0, 0.35, -1.05, tensor(8.0, 9.0, 2.5, 1.2)))
    found = load_bicycle(path)
    assert {key: found[key] for key in right} == pytest.approx(right, rel=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"inertia": [8.0, 1.0, 1.0]}, "body rider: no rigid body has the principal inertias 1, 1 and 8 kg m\\^2"),
        ({"inertia": [1.0, 1.0, 1.0, 2.0]}, "principal inertias -1, 1 and 3"),
        ({"inertia": [1.0, 1.0]}, "must be .Ixx, Iyy, Izz., or .Ixx, Iyy, Izz, Ixz., in kg"),
        ({"size": [0.3, 0.3, 0.3]}, "body rider: size and inertia both give its inertia; keep one"),
    ],
)
def test_a_body_that_cannot_be_is_refused(tmp_path, change, message):
    path = tmp_path / "ridden.toml"
    path.write_text(tomli_w.dumps(values(bodies=[RIDER | change])))
    with pytest.raises(InputError, match=message):
        load_bicycle(path)
