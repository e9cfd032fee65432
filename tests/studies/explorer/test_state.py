"""States and addresses: each the other's inverse; what the controls, the exports and the loader make of them."""

import json
import subprocess
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bicycle import load_bicycle, read_model, registry
from bicycle.files import available_bicycles, to_text, to_toml, to_yaml
from bicycle.model import build_model
from studies import explorer as site
from studies.cli import main
from studies.model_space import typical_values
from tyre.ground import InputError

TYRES = (
    "bicycle=benchmark&effects.relaxation_length.tyre=Tyre1&effects.relaxation_length.pressure_bar.rear=5.5"
    "&effects.relaxation_length.pressure_bar.front=4&slow=2&fast=12&at=7"
)
numbers = st.floats(0.01, 50.0)


@settings(max_examples=80)
@given(
    damping=numbers, pressure=numbers, ends=st.tuples(numbers, numbers, numbers).map(sorted), name=st.text(max_size=20),
    bicycle=st.sampled_from(available_bicycles()), posture=st.sampled_from(["upright", "hoods", "drops"]),
)  # fmt: skip
def test_an_address_says_its_state_exactly(damping, pressure, ends, name, bicycle, posture):
    slow, at, fast = ends
    if slow == fast or any(ord(letter) < 32 for letter in name):
        return
    model = {
        "bicycle": bicycle, "effects.steer_damper.damping": damping, "effects.side_slip.tyre.rear": "Tyre1",
        "effects.side_slip.tyre.front": "A & B=c%+é", "effects.side_slip.pressure_bar.rear": pressure,
        "effects.side_slip.pressure_bar.front": 4.0, "allow_unusual": True,
    }  # fmt: skip
    model = tuple(sorted(model.items()))
    state = site.State(model, name, "charlie", posture, slow, fast, at, "weave", ("bicycle=pista",))
    assert site.parse_state(state.address) == state
    assert site.parse_state(f"#{state.address}") == state
    assert "\n" not in state.address
    assert " " not in state.address


def test_the_empty_address_is_the_benchmark():
    assert site.parse_state("") == site.State()
    assert site.State().content == {"bicycle": "benchmark"}


def test_one_number_for_both_wheels_becomes_two():
    state = site.parse_state("effects.pneumatic_trail.trail=0.02&effects.side_slip.cornering_stiffness=5000")
    assert state.content["effects"] == {
        "pneumatic_trail": {"trail": {"rear": 0.02, "front": 0.02}},
        "side_slip": {"cornering_stiffness": {"rear": 5000.0, "front": 5000.0}},
    }


@pytest.mark.parametrize("identifier", registry())
def test_every_effect_has_a_switch_and_a_field_for_each_parameter(identifier):
    """Switched on by the page, an effect has all its parameters as fields, with unit and typical range."""
    effect, bicycle = registry()[identifier], load_bicycle("benchmark")
    address = "&".join(f"{key}={value}" for key, value in site.starts(effect, bicycle).items())
    html = site.controls_html(site.parse_state(address))["model"]
    for parameter in effect.parameters:
        low, high = parameter.typical
        assert f"typical {low:g} .. {high:g}" in html
        for entry in parameter.entries():
            assert html.count(f'data-key="effects.{identifier}.{entry}"') == 2  # slider and number
    if effect.slot != "contact law":
        assert f'id="s-effects.{identifier}" checked' in html


def test_every_effect_that_is_switched_on_makes_a_model():
    """On a bicycle with tyres; what an effect needs besides is said by the library."""
    bicycle = load_bicycle("benchmark")
    fitting = [effect for effect in registry().values() if typical_values(effect, bicycle) is not None]
    alone = [
        one for one in registry().values() if not {"motor command", "rider torque", "seated rider"} & set(one.requires)
    ]
    assert len(fitting) >= len(alone) - 1  # no typical rider who leans leaves a possible frame of the benchmark
    for effect in fitting:
        law = {} if effect.slot == "contact law" else site.law_options("no_slip", None, measured=False)[0]["edit"].put
        for name in effect.requires:
            law = dict(law) | {"effects.steer_assist.gain": "5", "effects.steer_assist.fade_speed": "5",
                               "effects.steer_assist.lean_gain": "0"} if name == "motor command" else law  # fmt: skip
        pairs = dict(law) | site.starts(effect, bicycle)
        assert effect.identifier in [e.identifier for e in site.build(site.parse_state(_joined(pairs))).effects]


def _joined(pairs):
    return "&".join(f"{key}={value}" for key, value in pairs.items())


def test_hands_and_rider_stand_with_the_rider():
    shown = site.controls(site.parse_state("bicycle=pista&rider=charlie&posture=drops&effects.rider_arms.damping=2"))
    hands = next(panel for panel in shown["rider_effects"] if panel["id"] == "rider_arms")
    assert (hands["words"], hands["on"]) == ("hands on the handlebar (rider arms)", True)
    assert [one["value"] for one in shown["riders"] if one["chosen"]] == ["charlie"]
    assert [one["value"] for one in shown["postures"] if one["chosen"]] == ["drops"]


def test_pressure_and_load_are_marked_outside_what_was_measured():
    """Tyre1 was measured from 340 to 490 N and from 3.5 to 7.5 bar (its table)."""
    shown = site.controls(site.parse_state(TYRES.replace("front=4", "front=9")))
    rear, front = shown["wheels"]
    assert (rear["pressure_bar"]["words"], rear["load_bar"]["words"]) == ("3.5 .. 7.5", "340 .. 490")
    assert (rear["pressure_bar"]["outside"], front["pressure_bar"]["outside"]) == (False, True)
    assert (rear["load_bar"]["outside"], front["load_bar"]["outside"]) == (True, True)
    html = site.controls_html(site.parse_state(TYRES.replace("front=4", "front=9")))["model"]
    assert html.count("now outside") == 3
    with pytest.raises(InputError, match="front wheel: 19 bar is more than one range width outside the 3.5-7.5 bar"):
        site.build(site.parse_state(TYRES.replace("front=4", "front=19")))


def test_a_script_in_a_name_is_text():
    values = load_bicycle("pista").values
    state = site.parse_state(
        _joined({f"bicycle.{k}": repr(v) for k, v in values.items()}) + "&name=<script>alert(1)</script>"
    )
    html = site.controls_html(state)["model"]
    assert "<script" not in html
    assert "&lt;script&gt;" in html
    figure = site.modes_figure(site.compute_modes(state), {"<b onclick=x>": site.compute_modes(state)}, site.LIGHT)
    assert not any("<b onclick" in trace["name"] for trace in figure["data"])


@pytest.mark.parametrize(
    "state",
    [
        "", TYRES, TYRES + "&effects.relaxation_length.surface=drum", TYRES + "&effects.steer_damper.damping=0.5",
        "bicycle=pista&effects.no_slip=on",
    ],
)  # fmt: skip
def test_command_and_python_compute_the_same(state, tmp_path, monkeypatch):
    """What is copied is run by shell and interpreter; both give the eigenvalues of the state matrix.

    What the shell hands to the command, a line each, is run here.
    """
    state = site.parse_state(state)
    linear = site.build(state).linear_model()
    text = f"velotyre() {{ printf '%s\\n' \"$@\"; }}\n{site.as_command(state)} --json found.json"
    said = subprocess.run(["bash", "-c", text], check=True, cwd=tmp_path, capture_output=True, text=True).stdout
    monkeypatch.chdir(tmp_path)
    main(said.removesuffix("\n").split("\n"))
    found = json.loads((tmp_path / "found.json").read_text())
    assert found["speeds_m_s"] == pytest.approx(np.linspace(state.slow, state.fast, 60).tolist(), rel=1e-9)
    last = np.sort_complex([complex(*z) for z in found["eigenvalues"][-1]])
    assert last == pytest.approx(
        np.sort_complex(np.linalg.eigvals(linear.state_matrix(state.fast))), rel=1e-8, abs=1e-8
    )
    said = {}
    exec(site.as_python(state).replace("import velotyre as vt", "import studies.velotyre as vt"), said)
    assert said["found"].eigenvalues[-1] == pytest.approx(last, rel=1e-8, abs=1e-8)
    (tmp_path / "kept.toml").write_text(site.model_toml(state))
    assert read_model(tmp_path / "kept.toml") == build_model(site.model_content(state))


@pytest.mark.parametrize(("ending", "write"), [(".toml", to_toml), (".yml", to_yaml), (".txt", to_text)])
def test_a_bicycle_that_is_dropped_keeps_the_effects_and_its_sd(ending, write):
    bicycle = load_bicycle("fisher")
    state, _ = site.with_file(site.parse_state(TYRES), f"C:\\mine\\my bike{ending}", write(bicycle).encode())
    assert state.name == "my_bike"
    assert site.build(site.parse_state("bicycle=fisher")).bicycle.sd == pytest.approx(dict(bicycle.sd))
    own = site.bicycle_or_none(state)
    assert dict(own.values) == pytest.approx(dict(bicycle.values))
    assert dict(own.sd) == pytest.approx(dict(bicycle.sd))
    assert set(state.content["effects"]) == {"relaxation_length"}
    assert site.parse_state(state.address) == state


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [
        ("a.exe", "", "a.exe: drop a bicycle or a model file (.toml, .yml, .yaml, .txt)"),
        ("a", "", "a: drop a bicycle or a model file"),
        ("../../a.toml", "x = ", "a.toml: "),
        ("a.toml", "", "a.toml: bicycle 'a': missing w, c, lam, g,"),
        ("a.toml", "w = 1", "a.toml: the key 'bicycle' of a model file, or [values] of a bicycle file, is missing"),
        ("a.toml", 'bicycle = "x.toml"', "a.toml: unknown bicycle 'x.toml'; known: "),
        ("a.toml", 'bicycle = "pista"\n[effects.x]\ny = [1]', "a.toml: effects.x.y = [1] must be a number, a text or"),
        ("a.toml", 'bicycle = "pista"\nstrange = 1', "a.toml: unknown key 'strange'"),
        ("a.toml", 'bicycle = "pista"\neffects = 3', "a.toml: effects = 3 must be a table: write [effects]"),
        ("a.toml", f'bicycle = "pista"\n[effects.x]\ny = {10**400}', "a.toml: effects.x.y = 1000"),
        ("a.txt", "w = 1", "a.txt: "),
        ("a.yml", "- 1", "a.yml: "),
        (
            "a.toml",
            "#" * 1_000_001,
            "a.toml: 1000001 bytes exceed the limit of 1000000 bytes for a bicycle or model file",
        ),
    ],
)
def test_a_file_that_is_none_is_refused_by_its_own_name(name, text, words):
    with pytest.raises(InputError) as error:
        site.with_file(site.State(), name, text.encode())
    assert str(error.value).startswith(words)
    assert "/tmp" not in str(error.value)


def test_the_model_of_the_command_line(tmp_path):
    (tmp_path / "mine.toml").write_text(to_toml(load_bicycle("pista")))
    (tmp_path / "model.toml").write_text(
        'bicycle = "mine.toml"\n[effects.steer_damper]\ndamping = 1\n'
        '[covariance]\nparameters = ["steer_damper.damping"]\nmatrix = [[0.01]]\n'
    )
    state = site.start_state(str(tmp_path / "model.toml"))
    assert state.name == "mine"
    assert site.parse_state(state.address) == state
    assert site.build(state).sd == {"steer_damper.damping": pytest.approx(0.1)}
    assert site.start_state("pista").content["bicycle"] == "pista"
    start = site.start_state(None)  # a rider on a measured tyre, the front flexible, up to 30 m/s
    assert (start.content["bicycle"], start.slow, start.fast) == ("pista_charlie_drops", 1.0, 30.0)
    assert {"relaxation_length", "front_compliance"} < set(start.content["effects"])
    assert "wobble" in [c.mode for c in site.compute_modes(start).critical]
    assert site.start_state("pista").fast == 10
    with pytest.raises(InputError, match="unknown bicycle or model 'pisto'; did you mean 'pista'"):
        site.start_state("pisto")


@pytest.mark.parametrize("damping", [12, 30])
def test_a_model_whose_wobble_becomes_unstable_is_shown_up_to_30_m_s(tmp_path, damping):
    """At 30 N m s/rad its wobble is unstable from 8.5 to 27.7 m/s; at 12, from 2.8 to beyond 30 m/s."""
    model = (
        'bicycle = "pista_charlie_drops"\n[effects.relaxation_length]\ntyre = "Tyre1"\npressure_bar = 5.5\n'
        f"[effects.front_compliance]\nstiffness = 4000\ndamping = {damping}\njoint_x = 0.86\njoint_z = -0.65\n"
    )
    (tmp_path / "soft.toml").write_text(model)
    state = site.start_state(str(tmp_path / "soft.toml"))
    wobble = [c.speed for c in site.compute_modes(state).critical if c.mode == "wobble"]
    assert wobble == pytest.approx([8.512689, 27.743905] if damping == 30 else [2.849701])  # velotyre critical
    assert state.fast == site.with_file(site.State(), "soft.toml", model.encode())[0].fast == 30
    farther = site.parse_state("fast=50")
    assert site.with_file(farther, "soft.toml", model.encode())[0].fast == 50


def test_a_label_below_zero_is_under_its_bar():
    names = {name: np.array([[complex(-ratio, 1)]]) for name, ratio in (("weave", 0.4), ("wobble", -0.05))}
    modes = SimpleNamespace(
        speeds=np.array([10.0]), branches=names, frequency=lambda name: np.array([0.16]),
        damping_ratio=lambda name: -names[name][0].real,
    )  # fmt: skip
    at = SimpleNamespace(named=modes, sd={"weave": 0.02, "wobble": 7e-5}, uncertain=("c",))
    figure = site.damping_figure(at, site.LIGHT)
    labels, (low, _) = figure["data"][-1], figure["layout"]["yaxis"]["range"]
    assert labels["text"] == ["0.40<br>± 0.02", "-0.05000<br>± 0.00007"]
    assert labels["textposition"] == ["top center", "bottom center"]
    assert low < labels["y"][1] < -0.05 - 7e-5


def test_a_rider_is_part_of_the_model_that_is_saved():
    pytest.importorskip("yeadon", reason="a rider needs yeadon")
    state = site.parse_state("bicycle=pista&rider=charlie&posture=drops")
    saved = tomllib.loads(site.model_toml(state))
    assert build_model(saved).bicycle["mB"] == pytest.approx(4.49 + 78.75, rel=1e-3)  # frame, and rider as measured
    with pytest.raises(InputError, match="it carries a rider already"):
        site.build(site.parse_state("bicycle=benchmark&rider=charlie"))


def test_figures_at_one_speed():
    state = site.parse_state(TYRES)
    at = site.at_speed(state)
    assert isinstance(at, site.AtSpeed)
    figure = site.damping_figure(at, site.LIGHT)
    assert figure["data"][0]["error_y"]["visible"]
    exact = site.damping_figure(site.at_speed(site.State()), site.LIGHT)  # nothing is stated
    assert not exact["data"][0]["error_y"]["visible"]
    (labels,) = [one for one in figure["data"] if one.get("mode") == "text"]
    bars = [one for one in figure["data"] if one["type"] == "bar"]
    low, high = figure["layout"]["yaxis"]["range"]
    for bar, end, text in zip(bars, labels["y"], labels["text"], strict=True):
        (ratio,), (sd,) = bar["y"], bar["error_y"]["array"]
        assert ratio + sd < end < high - 0.12 * (high - low)  # beyond the error bar, with room for two lines
        value, _, uncertainty = text.partition("<br>± ")
        assert (float(value), float(uncertainty)) == (pytest.approx(ratio, abs=sd), pytest.approx(sd, rel=0.5))
    top = site.sensitivity_figure(site.ranking(state), site.DARK)
    sizes = [abs(x) for x in top["data"][0]["x"]]
    assert sizes == sorted(sizes)
    beside, full = top["data"][0]["y"], top["data"][0]["customdata"]
    assert [line.replace("<br>", "") for line in beside] == full
    assert max(len(part) for line in beside for part in line.split("<br>")) <= 28  # the bars keep their room
    assert "relaxation_length.<br>cornering_stiffness.rear" in beside
    motion = site.mode_motion(state, at)
    assert motion["mode"] == "weave"
    assert all(len(frames) == site.FRAMES for view in motion["views"] for frames in view["paths"].values())
    assert [row[1] for row in motion["table"]["rows"]][:3].count(1.0) == 1  # the largest angle

    def refused():
        raise InputError("no <b> here")

    words = site.figure_or_words("damping", refused, site.LIGHT)["layout"]
    assert "&lt;b&gt;" in words["annotations"][0]["text"]
    assert words["meta"]["rows"] == [["no <b> here"]]


def test_amplitudes_over_speed():
    front = {"stiffness": 4000, "damping": 12, "joint_x": 0.86, "joint_z": -0.65}
    text = "&".join([TYRES, *(f"effects.front_compliance.{key}={value}" for key, value in front.items())])
    found = site.amplitudes(site.parse_state(text.replace("benchmark", "pista_charlie_drops")))
    assert [one.mode for one in found] == ["wobble"]
    figure = site.amplitude_figure(found, 20.0, site.LIGHT)
    names = {curve["name"] for curve in figure["data"]}
    assert names == {one.mode.replace("_", " ") for one in found} != set()
    for one, (whole, lasting) in zip(found, zip(*2 * [iter(figure["data"])], strict=True), strict=True):
        assert whole["y"] == one.amplitude.tolist()
        assert [y is not None for y in lasting["y"]] == (one.lasting | (one.amplitude == 0)).tolist()
    assert len(figure["layout"]["meta"]["rows"]) == sum(len(one.speed) for one in found)
    assert site.amplitude_figure((), 20.0, site.DARK)["layout"]["title"]["text"] == "No limit cycle up to 20 m/s"
    words = site.figure_or_words(
        "amplitude", lambda: site.amplitude_figure(site.amplitudes(site.State()), 20.0, site.LIGHT), site.LIGHT
    )["layout"]
    assert "nonlinear tyres need the effect" in words["annotations"][0]["text"]


def test_pointing_at_a_curve_tells_frequency_damping_and_time():
    """Weave of the benchmark at 5 m/s (Meijaard et al. 2007, table 2): -0.77534 + 4.46487i 1/s."""
    state = site.parse_state("slow=5&fast=6&at=5")
    curves = site.modes_figure(site.compute_modes(state), {"pin 1: x": site.compute_modes(state)}, site.LIGHT)["data"]
    weave = next(curve for curve in curves if curve["name"] == "weave")
    assert weave["text"][0] == (
        "<b>weave</b> at 5 m/s<br>0.7106 Hz, damping ratio 0.1711<br>halves in 0.894 s"
    )  # 4.46487 / 2 pi; 0.77534 / |z|; ln 2 / 0.77534
    pinned = [curve for curve in curves if curve["name"] == "weave, pin 1: x"]
    assert pinned[0]["y"] == weave["y"]
    assert pinned[0]["line"]["dash"] == weave["line"]["dash"]
    looks = {(c["line"]["dash"], c["marker"]["symbol"]) for c in curves if c["showlegend"] and not c["meta"]["pin"]}
    assert len(looks) == 3  # told apart without colour


def test_a_saved_page_with_all_that_can_be_pinned_stays_below_two_megabytes():
    pins = "&".join(f"pin=bicycle%3D{name}" for name in ("pista", "rigid", "benchmark", "browser"))
    page = site.saved_page(site.parse_state(f"{TYRES}&{pins}"), site.LIGHT)
    assert 400_000 < len(page.encode()) < 2_000_000
    assert "https://" not in page.split('<script type="text/plain"')[0]
