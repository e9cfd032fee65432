"""Hostile and clumsy requests to the page of recordings: 4xx and words, and the next request is answered."""

import io
import json
import time
import zipfile

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

pytest.importorskip("dash", reason="the page needs dash (extra explore)")

from bicycle.files.bicycle_file import load_bicycle, to_toml
from studies.explorer.recording.jobs import BUSY

HOME = {"Host": "127.0.0.1:8050"}


@pytest.fixture
def desk(client):
    """Address of an open desk; nothing runs at the end."""
    yield f"/recording/{client.post('/recording/open', json={}, headers=HOME).get_json()['desk']}"
    client.post("/recording/cancel", json={}, headers=HOME)


def post(client, path, body, **headers):
    return client.post(path, json=body, headers=HOME | headers)


def load(client, desk, name, content):
    return client.post(f"{desk}/file/{name}", data=content, headers=HOME)


def ended(client, desk):
    """The last computation, when it has ended."""
    end = time.monotonic() + 120
    while True:
        job = client.get(f"{desk}/state", headers=HOME).get_json()["job"]
        if job["state"] != "running":
            return job
        assert time.monotonic() < end, job
        time.sleep(0.05)


@pytest.mark.parametrize(
    "headers",
    [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Origin": "null"}, {"Sec-Fetch-Site": "cross-site"},
     {"Sec-Fetch-Site": "same-site"}],
)  # fmt: skip
def test_another_site_may_not_ask(client, desk, headers):
    for path in ("/recording/open", "/recording/cancel", f"{desk}/run", f"{desk}/file/a.csv"):
        answer = client.post(path, json={}, headers=HOME | headers)
        assert answer.status_code == 403
        assert answer.data.startswith(b"velotyre explore: ")
    assert client.get(f"{desk}/state", headers=HOME | headers).status_code == 403


def test_a_link_may_open_the_page_and_nothing_else(client, desk):
    link = HOME | {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert client.get("/recording", headers=link).status_code == 200
    assert client.get(f"{desk}/state", headers=link).status_code == 403


@pytest.mark.parametrize(
    "path",
    [
        "/recording/", "/recording/x", "/recording/x/state", "/recording/../etc/passwd",
        "/recording/x/out/look/../../../x", "/recording/x/result/look", "/recording/x/zip/look", "/recording/open",
        "/recording/a/b/c/d/e",
    ],
)  # fmt: skip
def test_no_path_leads_to_a_file(client, path):
    answer = client.get(path, headers=HOME)
    assert 400 <= answer.status_code < 500
    assert answer.mimetype == "text/plain"


def test_nothing_is_given_out_but_results(client, desk):
    load(client, desk, "a.csv", b"t,x\n1,2\n")
    for path in (
        "out/a.csv",
        "out/look/x.png",
        "out/look/..%2f..%2fa.csv",
        "out//etc/passwd",
        "result/etc",
        "zip/..",
        "result/look",
    ):
        answer = client.get(f"{desk}/{path}", headers=HOME)
        assert answer.status_code == 404, path
    assert client.get("/recording/another/state", headers=HOME).data == (
        b"the files of this page are no longer kept; load the page and the files again"
    )


def test_large_bodies_are_refused(client, desk):
    assert load(client, desk, "a.csv", b"x" * 32_000_001).status_code == 413
    assert post(client, f"{desk}/run", {"kind": "x" * 3_000_001}).status_code == 413
    assert client.post(f"{desk}/file/a.csv", headers=HOME).status_code == 411  # of no stated size
    answer = load(client, desk, "%2e%2e%2fa.csv", b"x")
    assert 400 <= answer.status_code < 500
    assert client.get(f"{desk}/state", headers=HOME).get_json()["files"] == []


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (b"null", "this is no request of the page"),
        (b"[1]", "this is no request of the page"),
        (b"[" * 100_000, "this is no request of the page"),
        (b"{}", "unknown computation ''; known: diagnosis, fit, look, tyre_fit"),
        (b'{"kind": 3}', "unknown computation ''"),
        (b'{"kind": "look"}', "choose a recording"),
        (b'{"kind": "look", "file": "--out=elsewhere"}', "must be the name of a file"),
        (b'{"kind": "look", "file": "/etc/passwd"}', "/etc/passwd: load it first"),
        (b'{"kind": "look", "file": "x", "more": 1}', "unknown key 'more'"),
        (b'{"kind": "fit", "runs": []}', "give the speed of each recording that is fitted, in m/s"),
        (b'{"kind": "fit", "runs": [{"file": "a", "speed": 1e9}]}', "must be a speed above 0 and up to 60 m/s"),
        (b'{"kind": "fit", "runs": [{"file": "a", "speed": NaN}]}', "must be a speed above 0 and up to 60 m/s"),
        (b'{"kind": "tyre_fit"}', "load the recordings of a tyre first"),
        (b'{"kind": "tyre_fit", "repeatability": -1}', "repeatability = -1"),
        (b'{"kind": "tyre_fit", "wheel_radius": NaN}', "wheel_radius = nan"),
        (b'{"kind": "tyre_fit", "out": "/tmp"}', "unknown key 'out'"),
        (b'{"kind": "diagnosis", "measurement": "/etc/passwd"}', "/etc/passwd: load it first"),
        (b'{"kind": "diagnosis", "measurement": "davis", "without": "x"}', "without = 'x' must be a list of effects"),
        (b'{"kind": "diagnosis", "measurement": "davis", "variants": 1}', "variants = 1 must be true or false"),
    ],
)
def test_what_no_page_asks_is_refused_in_words(client, desk, body, words):
    answer = client.post(f"{desk}/run", data=body, content_type="application/json", headers=HOME)
    assert answer.status_code == 400
    assert words in answer.text


def test_what_only_a_user_gets_wrong_is_refused_in_words(client, desk):
    load(client, desk, "a.csv", b"t,x\n1,2\n")

    def refused(body):
        answer = post(client, f"{desk}/run", body)
        assert answer.status_code == 400
        return answer.text

    run = {"file": "a.csv", "speed": 5}
    assert "unknown mode 'weav'; did you mean 'weave'?" in refused({"kind": "fit", "runs": [run], "modes": "weav"})
    assert refused({"kind": "look", "file": "a.csv", "map": "channels_of_the_page.toml"}) == (
        "channels_of_the_page.toml: fill in the table of channels first"
    )
    assert refused({"kind": "look", "file": "a.csv", "map": "../a.toml"}) == "../a.toml: no such channel map"
    assert "unknown file 'b.csv'" in refused({"kind": "look", "file": "b.csv"})
    rows = [{"channel": "lean", "column": "x"}, {"channel": "lean", "column": "t"}]
    assert post(client, f"{desk}/map", {"rows": rows}).text == "channels: lean is taken from two columns; keep one"
    assert post(client, f"{desk}/map", {"rows": "x"}).text == "channels: must be at most 200 rows"
    assert "sign = 7" in post(client, f"{desk}/map", {"rows": [rows[0] | {"sign": 7}]}).text
    assert post(client, f"{desk}/keep", {"name": "fit/x.csv"}).text == "there is no such file; compute it again"


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3), max_leaves=8,
)  # fmt: skip


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    verb=st.sampled_from(["run", "map", "keep", "remove"]),
    body=st.dictionaries(st.sampled_from(["kind", "file", "rows", "runs", "name", "measurement", "map"]), json_values),
)
def test_any_content_is_answered_without_a_fault(client, desk, verb, body):
    assert post(client, f"{desk}/{verb}", body).status_code in (200, 400)


def test_a_second_computation_is_told_to_wait_and_anyone_may_cancel(client, desk):
    other = f"/recording/{post(client, '/recording/open', {}).get_json()['desk']}"
    assert post(client, f"{desk}/run", {"kind": "diagnosis", "measurement": "synthetic_kicks"}).status_code == 202
    load(client, other, "a.csv", b"t,x\n1,2\n")
    answer = post(client, f"{other}/run", {"kind": "look", "file": "a.csv"})
    assert (answer.status_code, answer.text) == (409, BUSY)
    assert (
        load(client, desk, "b.csv", b"x").text == "a computation is reading these files; wait for its end, or cancel it"
    )
    assert client.get(f"{desk}/state", headers=HOME).get_json()["job"]["state"] == "running"
    assert post(client, "/recording/cancel", {}).status_code == 200
    assert ended(client, desk)["state"] == "cancelled"
    assert client.get(f"{desk}/result/diagnosis", headers=HOME).status_code == 404
    assert post(client, f"{other}/run", {"kind": "look", "file": "a.csv"}).status_code == 202
    assert ended(client, other)["state"] in ("done", "failed")


def test_a_measurement_reads_what_was_loaded_and_nothing_else(client, desk, tmp_path):
    """A bicycle lies there that the measurement could use; it is refused by name, and the library refuses the rest."""
    secret = tmp_path / "secret.toml"
    secret.write_text(to_toml(load_bicycle("pista")))
    text = "kind = 'modal'\nbicycle = '{}'\n[modal]\ntable = 'weave.csv'\n"
    answer = load(client, desk, "m.toml", text.format(secret).encode())
    assert answer.status_code == 400
    assert "is a file outside what was loaded" in answer.text
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as opened:
        opened.writestr("set/m.toml", text.format("secret.toml"))
    assert load(client, desk, "set.zip", packed.getvalue()).status_code == 200
    assert post(client, f"{desk}/run", {"kind": "diagnosis", "measurement": "set/m.toml"}).status_code == 202
    job = ended(client, desk)
    assert job["state"] == "failed"
    assert "secret.toml" in job["message"]
    assert json.dumps(job).count(str(tmp_path)) == 0
