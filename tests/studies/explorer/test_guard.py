"""Hostile requests: other names and origins, paths, sizes and contents that no page sends end in 4xx or in words."""

import json
import sys

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bicycle.files import load_bicycle, to_toml

HOME = {"Host": "127.0.0.1:8050"}
ALONG = "along.data"


def question(state, name="along"):
    """A request of the page for its figures along speed."""
    asked = {"n": 1, "text": state, "theme": "light"}
    return {
        "output": f"{name}.data", "outputs": {"id": name, "property": "data"},
        "inputs": [{"id": f"ask-{name}", "property": "data", "value": asked}], "changedPropIds": [f"ask-{name}.data"],
    }  # fmt: skip


def ask(client, body, **headers):
    return client.post("/_dash-update-component", json=body, headers=HOME | headers)


def shown(client, state):
    answer = ask(client, question(state))
    assert answer.status_code == 200, answer.data[:300]
    return answer.get_json()["response"]["along"]["data"]["shown"]


def test_the_page_asks_and_is_answered(client):
    assert shown(client, "bicycle=benchmark")["name"] == "benchmark, no slip"
    assert client.get("/", headers=HOME).status_code == 200


@pytest.mark.parametrize(("headers", "code"), [
    ({"Host": "evil.example"}, 403), ({"Host": "127.0.0.1"}, 403),  # DNS rebinding: another name that points here
    *(({"Origin": f"http{site}"}, 403) for site in ("://evil.example", "s://127.0.0.1:8050", "://127.0.0.1:9999")),
    ({"Origin": "null"}, 403), ({"Sec-Fetch-Site": "cross-site"}, 403), ({"Sec-Fetch-Site": "same-site"}, 403),
    ({"Origin": "http://127.0.0.1:8050", "Sec-Fetch-Site": "same-origin"}, 200),
    ({"Host": "localhost:8050", "Origin": "http://localhost:8050"}, 200),
])  # fmt: skip
def test_only_its_own_page_may_ask(client, headers, code):
    answer = ask(client, question("bicycle=benchmark"), **headers)
    assert answer.status_code == code
    if code == 403:
        assert answer.data.startswith(b"velotyre explore: ")


def test_a_link_may_open_the_page_but_nothing_else(client):
    link = HOME | {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}
    assert client.get("/", headers=link).status_code == 200
    assert client.get("/_dash-layout", headers=link).status_code == 403
    assert client.get("/", headers=link | {"Sec-Fetch-Mode": "no-cors"}).status_code == 403


@pytest.mark.parametrize("path", [
    "/etc/passwd", "/../../etc/passwd", "/assets/../app.py", "/assets/%2e%2e/app.py", "/assets/..%2fapp.py",
    "/assets//etc/passwd", "/static/x", "/_reload-hash", "/_dash-component-suites/dash/../../os.py",
    "/_dash-component-suites/os/os.py", "/_dash-component-suites/dash/dash.py", "/_mcp", "/x" * 2000, "/assets/\0",
])  # fmt: skip
def test_no_path_leads_to_a_file(client, path):
    answer = client.get(path, headers=HOME)
    assert 400 <= answer.status_code < 500
    assert b"root:" not in answer.data
    assert b"import " not in answer.data


@pytest.mark.parametrize("method", ["put", "delete", "patch", "post", "options"])
def test_the_page_is_only_read(client, method):
    assert getattr(client, method)("/", headers=HOME).status_code == 405


def test_a_body_of_ten_megabytes_is_refused(client):
    body = json.dumps(question("x" * 10_000_000))
    answer = client.post("/_dash-update-component", data=body, content_type="application/json", headers=HOME)
    assert answer.status_code == 413


@pytest.mark.parametrize("body", [
    b"", b"{", b"[]", b"null", b"7", b'"x"', b"{}", b"[" * 100_000, b'{"output": 3}', b'{"output": "nothing.data"}',
    json.dumps({"output": ALONG}).encode(),
    json.dumps(question("a") | {"outputs": []}).encode(),
    json.dumps(question("a") | {"outputs": {"id": [], "property": {}}}).encode(),
    json.dumps(question("a") | {"inputs": []}).encode(),
    json.dumps(question("a") | {"inputs": "ask-along"}).encode(),
    json.dumps(question("a") | {"changedPropIds": [[1]]}).encode(),
    json.dumps(question([[[[[[[[[["deep"]]]]]]]]]])).encode(),
    json.dumps(question(list(range(100_000)))).encode(),
])  # fmt: skip
def test_what_no_page_sends_is_refused(client, body):
    answer = client.post("/_dash-update-component", data=body, content_type="application/json", headers=HOME)
    assert answer.status_code == 400
    assert answer.data == b"velotyre explore: this is no request of the page\n"


@pytest.mark.parametrize(("state", "words"), [
    (None, "address: must be text of at most 60000 letters; start again with an empty one"),
    (7, "address: must be text"),
    ("x" * 70_000, "address: must be text of at most 60000 letters"),
    ("nonsense", "address: 'nonsense' is not key=value; correct it or start with an empty address"),
    ("evil=1", "address: unknown key 'evil'; known: allow_unusual, at, bicycle"),
    ("slow=1e999", "address: slow = '1e999' must be a finite number"),
    ("slow=nan", "address: slow = 'nan' must be a finite number"),
    ("fast=1e300", "address: fast = 1e+300 must be a speed above 0 and up to 60 m/s"),
    ("slow=5&fast=4&at=4", "address: speeds from 5 to 4 m/s with 4 m/s chosen; the first must be below the second"),
    ("at=20", "address: speeds from 1 to 10 m/s with 20 m/s chosen"),
    ("bicycle=/etc/passwd", "unknown bicycle '/etc/passwd'; known: balanceassistv1, "),
    ("bicycle=../benchmark.toml", "unknown bicycle '../benchmark.toml'; "),
    ("bicycle=pista&bicycle=rigid", "address: bicycle is given twice; keep one"),
    ("bicycle=pista&bicycle.w=1", "address: bicycle.w is given in addition to bicycle; keep one"),
    ("bicycle.w=1", "missing c, lam, g, "),
    ("rider=../../etc/passwd&bicycle=pista", "unknown rider '../../etc/passwd'; known: charlie, jason"),
    ("name=" + "x" * 81, "must be one line of at most 80 letters"),
    ("name=a%0Ab", "must be one line of at most 80 letters"),
    ("posture=standing", "address: posture = 'standing' must be upright, hoods or drops"),
    ("effects.side_slip.tyre=/etc/passwd.csv&effects.side_slip.pressure_bar=5", "tyre file '/etc/passwd.csv', whi"),
    ("effects.steer_damper.damping=1e308", "the model"),
    ("effects.nothing.x=1", "unknown effect 'nothing'; "),
    ("effects.steer_damper=3", "address: effects.steer_damper = '3' is not a key and value of a model file"),
    ("effects.steer_damper.damping.rear.x=3", "is not a key and value of a model file"),
    ("effects.steer_damper.damping=1&effects.steer_damper.damping.rear=3", "keep one"),
    ("covariance=%5B", "address: covariance = '[' must be a table as JSON"),
    ("covariance=" + "%5B" * 5000, "must be a table as JSON"),
    ("allow_unusual=perhaps", "address: allow_unusual = 'perhaps' is not a key and value of a model file"),
    ("pin=pin%3Dbicycle%253Dpista", "address: what is pinned cannot pin others; unpin it"),
    ("&".join(["pin=bicycle%3Dpista"] * 5), "address: 5 curves are pinned; at most 4, unpin some"),
])  # fmt: skip
def test_a_state_that_makes_no_model_is_refused_in_words(client, state, words):
    assert words in shown(client, state)["message"]


@pytest.mark.parametrize(("axes", "words"), [
    ("", "stability chart: choose both axes"),
    ("x=speed", "stability chart: choose both axes"),
    ("x=speed&y=speed", "both axes are speed; give two different ones"),
    ("x=speed&y=nothing", "unknown parameter 'nothing'"),
    ("x=speed%3D1:1e999&y=c", "the range must be finite, LOW below HIGH"),
    ("x=speed%3D-1e300:1e300&y=c", "speed"),
    ("x=speed&y=c%3D__import__", "axis 'c=__import__'"),
    ("x=speed&y=" + "c" * 100, "must be one line of at most 80 letters"),
])  # fmt: skip
def test_a_chart_that_cannot_be_drawn_is_refused_in_words(client, axes, words):
    answer = ask(client, question(f"bicycle=benchmark&{axes}", "chart"))
    assert answer.status_code == 200
    assert words in answer.get_json()["response"]["chart"]["data"]["message"]


OPENED: list[str] = []
sys.addaudithook(lambda event, args: OPENED.append(str(args[0])) if event == "open" else None)


def test_no_file_that_is_neither_packaged_nor_loaded_is_opened(client, tmp_path):
    """Files that would make a bicycle or tyre stand there and are named; none of them is opened."""
    secret = tmp_path / "secret.toml"
    secret.write_text(to_toml(load_bicycle("pista")))
    (tmp_path / "secret.csv").write_text("name,w\nx,1\n")
    OPENED.clear()
    for state in (
        f"bicycle={secret}", f"bicycle={tmp_path}/secret.csv%23x", f"effects.side_slip.tyre.rear={secret}",
        f"effects.relaxation_length.tyre={tmp_path}/secret.csv&effects.relaxation_length.pressure_bar=5",
        f"bicycle=pista&rider={secret}", f"bicycle.w={secret}", f"bicycle=pista&pin=bicycle%3D{secret}",
    ):  # fmt: skip
        assert shown(client, state)["message"]
    assert load_bicycle(secret)["w"] > 0
    assert [path for path in OPENED if "secret" in path] == [str(secret)]  # by this test itself


json_values = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3), max_leaves=8,
)  # fmt: skip


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(value=json_values, key=st.sampled_from(["output", "outputs", "inputs", "state", "changedPropIds", "parsed"]))
def test_any_content_is_answered_without_a_fault(client, value, key):
    answer = ask(client, question("bicycle=pista", "chart") | {key: value})  # whose axes are not chosen: in words
    assert answer.status_code in (200, 400)
