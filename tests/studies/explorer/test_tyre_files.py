"""Tyre files that are dropped on the page: kept under their names, put on wheels, and nothing else is read."""

import time
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Barrier

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bicycle.model import read_model
from studies import explorer as site
from tests.shared.refusals import refuses
from tyre import read_tyre
from tyre.ground import InputError

TABLE = b"Fz [N],p [bar],C [N/deg],K [N/mm]\n400,4,100,60\n400,6,90,70\n700,4,150,62\n700,6,140,72\n"
MODEL = b'bicycle = "benchmark"\n[effects.relaxation_length]\ntyre = "fit/maps/mine.csv"\npressure_bar = 5\n'
MEASURED = b"load_N,pressure_bar,cornering_stiffness_N_per_deg,lateral_stiffness_N_per_mm\n400,4,100,60\n700,6,140,72\n"
SIDECAR = b'tyre = "Mine"\nsurface = "flat"\nsource = "made up for this test"\n'
TIR = Path(__file__).parents[3] / "docs" / "examples" / "tyres" / "example.tir"


@pytest.fixture(autouse=True)
def nothing_loaded():
    site.TYRES.close()
    yield
    site.TYRES.close()


def test_a_model_and_its_tyre_are_dropped_together(tmp_path):
    state, _ = site.with_files(site.State(), [("model.toml", MODEL), ("mine.csv", TABLE)])
    assert site.parse_state(state.address) == state
    name = dict(state.model)["effects.relaxation_length.tyre.rear"]
    assert site.shown_name(name) == "mine.csv"
    (tmp_path / "fit" / "maps").mkdir(parents=True)
    (tmp_path / "fit" / "maps" / "mine.csv").write_bytes(TABLE)
    (tmp_path / "model.toml").write_bytes(MODEL)
    model, found = read_model(tmp_path / "model.toml"), site.build(state)
    assert found.parameters == pytest.approx(dict(model.parameters), rel=1e-12)
    assert not any("velotyre_tyres" in note for note in site.compute_modes(state).notes)

    (tmp_path / "mine.csv").write_bytes(TABLE)  # and taken away
    (tmp_path / "kept.toml").write_text(site.model_toml(state))
    assert "# needs beside it, as they were loaded: mine.csv" in site.model_toml(state)
    assert tomllib.loads(site.model_toml(state))["effects"]["relaxation_length"]["tyre"]["rear"] == "mine.csv"
    assert read_model(tmp_path / "kept.toml").parameters == pytest.approx(dict(model.parameters), rel=1e-12)
    for text in (site.as_command(state), site.as_python(state)):
        assert "# needs beside it, as they were loaded: mine.csv" in text
        assert "velotyre_tyres" not in text
        assert "@" not in text.replace(state.address, "")


def test_a_tyre_alone_can_be_chosen_for_each_wheel_and_put_in_later():
    start = site.parse_state("effects.relaxation_length.tyre=Tyre1&effects.relaxation_length.pressure_bar=5")
    state, remarks = site.with_files(start, [("mine.csv", TABLE)])
    assert state == start
    assert remarks == ("mine.csv: it can be chosen under Tyres now, for each wheel",)
    (name,) = site.TYRES.names()
    options = [(one["value"], one["words"]) for one in site.controls(state)["wheels"][1]["tyres"]]
    assert options[-1] == (name, "mine.csv (loaded)")
    front = site.parse_state(start.address.replace("tyre.front=Tyre1", f"tyre.front={name}"))
    values = site.build(front).parameters
    assert values["relaxation_length.cornering_stiffness.rear"] == site.build(start).parameters[
        "relaxation_length.cornering_stiffness.rear"
    ]  # fmt: skip
    assert values["relaxation_length.cornering_stiffness.front"] != values[
        "relaxation_length.cornering_stiffness.rear"
    ]  # fmt: skip
    later, _ = site.with_files(start, [("model.toml", MODEL)])
    assert dict(later.model)["effects.relaxation_length.tyre.front"] == name


def test_a_table_takes_its_sidecar_along():
    files = [("mine.csv", MEASURED), ("mine.toml", SIDECAR), ("plain.csv", TABLE), ("t.tir", TIR.read_bytes())]
    site.with_files(site.State(), files)
    assert [site.shown_name(name) for name in site.TYRES.names()] == ["mine.csv", "plain.csv", "t.tir"]
    assert list(site.TYRES.content([site.TYRES.names()[0]])) == ["mine.csv", "mine.toml"]
    assert site.TYRES.read(site.TYRES.names()[0], None).at(load=400, pressure=4e5).tyre == "Mine"
    assert site.TYRES.find("somewhere/mine.toml") == site.TYRES.names()[0]
    assert site.TYRES.find("C:\\else\\t.tir") == site.TYRES.names()[2]
    assert site.TYRES.find("t.csv") is None


def test_two_contents_of_one_name_are_two_tyres():
    first, _ = site.with_files(site.State(), [("model.toml", MODEL), ("mine.csv", TABLE)])
    other = TABLE.replace(b"100,60", b"120,60")
    second, _ = site.with_files(site.State(), [("model.toml", MODEL), ("mine.csv", other)])
    stiff = [site.build(one).parameters["relaxation_length.cornering_stiffness.front"] for one in (first, second)]
    assert stiff[0] != stiff[1]
    assert len({one["words"] for one in site.controls(second)["wheels"][0]["tyres"][-2:]}) == 2
    again, _ = site.with_files(site.State(), [("model.toml", MODEL), ("mine.csv", TABLE)])
    assert again == first


@pytest.mark.parametrize("table", [TABLE, b"t,x\n1,2\n"], ids=["good", "bad"])
def test_several_users_drop_the_same_file_at_once(monkeypatch, table):
    together = Barrier(8)

    def slow(*arguments, **settings):  # as a reader is under load: all find that the file is not there yet
        time.sleep(0.02)
        return read_tyre(*arguments, **settings)

    def drop(_):
        together.wait()
        try:
            return site.TYRES.keep("mine.csv", {"mine.csv": table})
        except InputError as error:
            return str(error)

    monkeypatch.setattr("studies.explorer.tyre_files.read_tyre", slow)
    with ThreadPoolExecutor(8) as users:
        (answer,) = set(users.map(drop, range(8)))  # all get the same
    assert answer.startswith("mine.csv@") if table is TABLE else "mine.csv" in answer
    assert site.TYRES.names() == [answer] * (table is TABLE)


@pytest.mark.parametrize(("dropped", "words"), [
    ({"model.toml": MODEL},
     "model.toml: effect 'relaxation_length': names the tyre file 'fit/maps/mine.csv', which was not dropped; drop "
     "both together"),
    ({"model.toml": MODEL, "other.csv": TABLE}, "which was not dropped; drop both together"),
    ({"mine.toml": SIDECAR}, "mine.toml: describes the tyre table mine.csv; drop both together"),
    ({"mine.csv": b"t,x\n1,2\n"}, "mine.csv"),
    ({"mine.tir": b"nothing"}, "mine.tir"),
    ({"mine.mat": b"nothing"}, "mine.mat"),
    ({"mine.mat": TABLE}, "mine.mat"),  # on which scipy stumbles
    ({"mine.json": b"[" * 20000}, "mine.json"),
    ({"mine.toml": b'kind = "modal"'}, "mine.toml: kind = 'modal'; a tyre is a table without a kind"),
    ({".mine.csv": TABLE}, "cannot be loaded under this name"),
    ({"mine.csv": b"#" * 1_000_001}, "mine.csv: 1000001 bytes exceed the limit of 1000000 bytes for a tyre file"),
    ({"a.toml": MODEL, "b.toml": MODEL}, "a.toml and b.toml: drop one bicycle or model at a time, with its tyres"),
    ({"x/mine.csv": TABLE, "y/mine.csv": TABLE}, "mine.csv: two files of this name were dropped; rename one"),
    ({f"{k}.csv": TABLE for k in range(21)}, "21 files were dropped; at most 20 at once"),
])  # fmt: skip
def test_what_cannot_be_taken_is_refused_in_words(dropped, words):
    with pytest.raises(InputError) as refused:
        site.with_files(site.State(), list(dropped.items()))
    assert words in str(refused.value)
    assert "velotyre_tyres" not in str(refused.value)
    assert not [name for name in site.TYRES.names() if site.shown_name(name).startswith("mine")]


def test_an_address_with_a_tyre_that_is_not_here_says_what_to_drop():
    state, _ = site.with_files(site.State(), [("model.toml", MODEL), ("mine.csv", TABLE)])
    assert site.kept_here(state) == [
        "the address does not hold mine.csv: elsewhere, drop that on the page first; a saved page has it inside"
    ]
    assert site.kept_here(site.State()) == []
    site.TYRES.close()
    refuses(r"the tyre file 'mine\.csv' is not loaded here, or has another content; an ad", site.build, state)
    assert site.controls(state)["wheels"][0]["tyres"][-1]["words"] == "mine.csv (loaded, not here)"
    site.with_files(state, [("mine.csv", TABLE.replace(b"100", b"101"))])
    refuses("or has another content", site.build, state)
    site.with_files(state, [("mine.csv", TABLE)])
    site.build(state)


def test_a_saved_page_holds_the_tyre():
    state, _ = site.with_files(site.State(), [("model.toml", MODEL), ("mine.csv", MEASURED), ("mine.toml", SIDECAR)])
    import base64
    import gzip
    import json

    packed = site.saved_page(state, site.LIGHT).split('id="content">')[1].split("</script>")[0]
    content = json.loads(gzip.decompress(base64.b85decode(packed)))
    assert content["files"]["mine.csv"].encode() == MEASURED
    assert content["files"]["mine.toml"].encode() == SIDECAR
    assert "velotyre_tyres" not in json.dumps(content)
    assert site.kept_here(state)[0] in content["notes"]


SECRET = "secret_9d1f.csv"


@pytest.mark.parametrize("trick", [
    "{path}", "{path}@0123456789", "../{name}", "mine.csv@0000000000/../../{name}", "./{name}", "{name}",
    "~/{name}", "mine.csv@{digest}/../{name}", "file://{path}", "mine.csv@{digest}\\u0000", "..\\\\{name}",
])  # fmt: skip
def test_no_name_of_a_tyre_leads_to_a_file_that_was_not_loaded(trick, tmp_path, monkeypatch):
    (tmp_path / SECRET).write_bytes(TABLE)
    monkeypatch.chdir(tmp_path)
    site.with_files(site.State(), [("mine.csv", TABLE)])
    digest = site.TYRES.names()[0].partition("@")[2]
    name = trick.format(path=tmp_path / SECRET, name=SECRET, digest=digest)
    text = f'bicycle = "benchmark"\n[effects.relaxation_length]\ntyre = "{name}"\npressure_bar = 5\n'
    with pytest.raises(InputError):
        site.with_files(site.State(), [("model.toml", text.encode())])
    address = f"effects.relaxation_length.tyre.rear={name}&effects.relaxation_length.tyre.front=Tyre1"
    with pytest.raises(InputError):
        site.build(site.parse_state(f"{address}&effects.relaxation_length.pressure_bar=5"))


def test_a_name_with_a_folder_is_not_written():
    refuses("cannot be loaded under this name", site.TYRES.keep, "../mine.csv", {"../mine.csv": TABLE})
    assert site.TYRES.names() == []


@settings(max_examples=60)
@given(
    st.lists(
        st.tuples(
            st.sampled_from(["a.csv", "a.toml", "b.tir", "c.txt", "d.yaml", "e.json", "../g.csv", "h", ""]),
            st.binary(max_size=60) | st.sampled_from([TABLE, MODEL, MEASURED, SIDECAR]),
        ),
        max_size=4,
    )
)  # fmt: skip
@example([("f.mat", b"\0")])  # a process of its own reads it, which takes longer than all else
def test_whatever_is_dropped_is_taken_or_refused(dropped):
    try:
        state, _ = site.with_files(site.State(), dropped)
    except InputError as error:
        said = str(error)
    else:
        said = state.address
        assert site.parse_state(said) == state
    assert "velotyre_tyres" not in said
