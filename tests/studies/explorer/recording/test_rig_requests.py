"""Rig recordings on the page: what is gathered for the fit, sidecars made of drafts, and tricks with them."""

import io
import os
import time

import pytest

pytest.importorskip("dash", reason="the page needs dash (extra explore)")

from studies.explorer.recording.desk import Desk
from studies.explorer.recording.gathered import gathered
from studies.explorer.recording.mounted import mounted
from studies.explorer.recording.sidecar import described, drafted
from studies.explorer.recording.tyre_options import tyre_options
from studies.explorer.state import parse_state
from studies.explorer.tyre_files import TYRES, shown_name
from tyre.base.errors import InputError

HOME = {"Host": "127.0.0.1:8050"}
DRAFT = """# Draft
recording = "../{recording}"
tyre = ""  # FILL IN: name of the tyre
load_N = 400  # CHECK: the declared vertical load in N
pressure_bar = ""  # FILL IN: inflation pressure in bar
surface = ""  # FILL IN: "flat", or "drum"
axes = "SAE"  # CHECK: guessed
rigid_rim = true  # CHECK: true only if the rim cannot move

[channels]
time = {{column = "clk"}}  # CHECK: a rising column
"""
KNOWN = {"draft": "look/rig.toml", "tyre": "A", "load_N": 410, "pressure_bar": 5, "surface": "flat", "axes": "ISO"}


@pytest.fixture
def desk():
    made = Desk()
    put(made, "runs/rig.csv", b"clk\n1\n")
    (made.folder / "look").mkdir()
    (made.folder / "look" / "rig.toml").write_text(DRAFT.format(recording="runs/rig.csv"))
    (made.folder / "look" / "rig.channels.toml").write_text("[channels]\n")
    yield made
    made.close()


def put(desk, name, content):
    desk.load(name, io.BytesIO(content), len(content))


def test_a_draft_becomes_the_sidecar_beside_its_recording(desk):
    (draft,) = drafted(desk.folder / "look")
    assert draft["file"] == "look/rig.toml"
    assert [(field["key"], field["kind"], field["value"]) for field in draft["fields"]] == [
        ("tyre", "text", ""), ("load_N", "number", 400), ("pressure_bar", "number", ""), ("surface", "choice", ""),
        ("drum_radius_m", "number", ""), ("axes", "choice", "SAE"), ("rigid_rim", "flag", True),
    ]  # fmt: skip
    name, written = described(desk, KNOWN | {"rigid_rim": False})
    assert name == "runs/rig.toml"
    assert written.splitlines()[1:8] == [
        'recording = "rig.csv"', 'tyre = "A"', "load_N = 410.0", "pressure_bar = 5.0", 'surface = "flat"',
        'axes = "ISO"', "rigid_rim = false",
    ]  # fmt: skip
    assert 'column = "clk"' in written
    desk.make(name, written)
    assert desk.files()[1] == {"name": "runs/rig.toml", "bytes": len(written), "made": True}
    put(desk, name, b"")  # the user's own in its place
    assert desk.files()[1] == {"name": "runs/rig.toml", "bytes": 0}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"draft": "look/no.toml"}, "look/no.toml: there is no such draft; look at the recording again"),
        ({"draft": "look/../runs/rig.csv"}, "there is no such draft"),
        ({"draft": "/etc/passwd"}, "there is no such draft"),
        ({"draft": 3}, "must be a draft of the look"),
        ({"draft": "look/rig.channels.toml"}, "its recording is no longer loaded"),
        ({"tyre": ""}, "sidecar: tyre is empty"),
        ({"load_N": -1}, "load_N = -1"),
        ({"pressure_bar": 500}, "rig.toml: pressure is 500 bar, allowed are 0.2 to 20 bar"),
        ({"surface": "ice"}, "must be flat or drum"),
        ({"axes": "mine"}, "must be one of ISO, SAE, adapted SAE"),
        ({"surface": "drum"}, "rig.toml: a drum needs its radius"),
        ({"drum_radius_m": 0.5}, "drum_radius_m is of a drum; leave it out, or choose the surface drum"),
        ({"recording": "/etc/passwd"}, "unknown key 'recording'"),
        ({"speed_km_h": 10}, "unknown key 'speed_km_h'"),
    ],
)
def test_a_sidecar_that_cannot_be_is_refused_in_words(desk, change, words):
    with pytest.raises(InputError) as refused:
        described(desk, KNOWN | change)
    assert words in str(refused.value)
    assert str(desk.folder) not in str(refused.value)


def test_only_what_is_loaded_is_gathered_and_what_leads_out_from_there_is_refused(desk, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    put(desk, "a.toml", b'tyre = "A"\n')
    (desk.folder / "as_loaded").mkdir()
    (desk.folder / "as_loaded" / "left.csv").write_text("of a command that was cancelled")
    with gathered(desk.folder):
        found = sorted(path.relative_to(desk.folder).as_posix() for path in (desk.folder / "as_loaded").rglob("*.*"))
        assert found == ["as_loaded/a.toml", "as_loaded/runs/rig.csv"]
        assert [one["name"] for one in desk.files()] == ["a.toml", "runs/rig.csv"]
        assert desk.file("as_loaded/a.toml") is not None  # but no address gives it out: it is of no result
    assert not (desk.folder / "as_loaded").exists()
    outside = desk.folder.parent / f"outside_{desk.token}.csv"
    outside.write_text("secret")
    try:
        name = f"../../{outside.name}"  # from where it is loaded this leads to nothing, from one folder below it does
        put(desk, "b.toml", f'recording = "{name}"\n'.encode())
        with (
            pytest.raises(InputError, match=r"b\.toml: .* is a file outside what was loaded"),
            gathered(desk.folder),
        ):
            pass
    finally:
        outside.unlink()
    assert not (desk.folder / "as_loaded").exists()


def test_a_file_system_without_links_is_served_by_copies(desk, monkeypatch):
    def no_link(source, target):
        raise OSError("not here")

    monkeypatch.setattr(os, "link", no_link)
    with gathered(desk.folder):
        assert (desk.folder / "as_loaded" / "runs" / "rig.csv").read_bytes() == b"clk\n1\n"


def test_a_fitted_tyre_is_put_on_the_bicycle_of_the_model_page(desk):
    maps = desk.folder / "tyre_fit" / "maps"
    maps.mkdir(parents=True)
    (maps / "A_flat.csv").write_text(
        "load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm\n"
        "300,4,100,60\n700,4,150,60\n300,6,90,70\n700,6,140,70\n"
    )
    (maps / "A_flat.toml").write_text('tyre = "A"\nsurface = "flat"\nsource = "made up for this test"\n')
    try:
        shown = (
            "bicycle=pista&effects.side_slip.cornering_stiffness=9&effects.steer_damper.damping=1&load.rear=400&at=6"
        )
        for given in (shown, "no address", None):
            state = parse_state(mounted(desk, "tyre_fit/maps/A_flat.csv", given))
            model = dict(state.model)
            assert shown_name(model["effects.relaxation_length.tyre.front"]) == "A_flat.csv"
            assert model["effects.relaxation_length.pressure_bar.rear"] == 5
        state = parse_state(mounted(desk, "tyre_fit/maps/A_flat.csv", shown))
        assert set(state.content["effects"]) == {"relaxation_length", "steer_damper"}
        assert (state.content["bicycle"], state.at, "load" in state.content) == ("pista", 6, False)
        assert TYRES.read(dict(state.model)["effects.relaxation_length.tyre.rear"], None).at(load=300, pressure=4e5)
        for name in ("tyre_fit/maps/B.csv", "runs/rig.csv", "tyre_fit/maps/../../runs/rig.csv", "/etc/passwd", None):
            with pytest.raises(InputError, match="there is no such tyre; fit it again"):
                mounted(desk, name, "")
    finally:
        TYRES.close()


def test_the_numbers_of_the_form_are_those_of_the_command():
    assert {one.name: one.usual for one in tyre_options()} == {
        "force_calibration": 0.3, "slip_calibration": 0.3, "gauge_calibration": 0.2, "repeatability": 1.0,
        "load_tolerance": 5.0, "wheel_radius": 0.34,
    }  # fmt: skip
    assert all(one.words.endswith((", %", ", m")) for one in tyre_options())


def test_tricks_with_a_fit_of_a_tyre_end_in_words(client):
    desk = f"/recording/{client.post('/recording/open', json={}, headers=HOME).get_json()['desk']}"

    def run(**asked):
        return client.post(f"{desk}/run", json={"kind": "tyre_fit"} | asked, headers=HOME)

    client.post(f"{desk}/file/runs/a.csv", data=b"t,x\n1,2\n", headers=HOME)
    assert run(folder="run").text == "unknown folder 'run'; did you mean 'runs'? known: runs"
    for folder in ("..", "/etc", "runs/..", "--help"):
        assert "unknown folder" in run(folder=folder).text
    assert run(map="../x.toml").text == "../x.toml: no such channel map"
    answer = client.post(f"{desk}/describe", json={"draft": "/etc/passwd"}, headers=HOME)
    assert (answer.status_code, answer.text) == (
        400,
        "/etc/passwd: there is no such draft; look at the recording again",
    )
    assert run(folder="runs").status_code == 202
    end = time.monotonic() + 120
    while (job := client.get(f"{desk}/state", headers=HOME).get_json()["job"])["state"] == "running":
        assert time.monotonic() < end
        time.sleep(0.05)
    assert job["state"] == "failed"
    assert "none of 1 recordings could be used" in job["message"]
    assert client.get(f"{desk}/out/as_loaded/runs/a.csv", headers=HOME).status_code == 404
