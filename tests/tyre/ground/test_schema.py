"""Declared tables: what is given back, and in which words all else is refused."""

import math

import numpy as np
import pytest

from tests.shared.refusals import refuses
from tyre.ground import (
    InputError,
    by_name,
    flag,
    list_of,
    maybe,
    name_in,
    needed,
    number,
    read,
    table,
    text,
    whole_number,
)

INNER = table({needed("load_N"): number(above=0), maybe("shape"): number(least=1, most=2, outside="is no shape")})
TOP = table({
    needed("tyre", "tyre is missing; give its name"): text(blank=False), needed("speed_m_s"): number(),
    maybe("kind", "flat"): text("must be flat or drum", allowed=("flat", "drum")),
    maybe("samples", 1): whole_number(least=1, most=9), maybe("synthetic", False): flag,
    maybe("mode"): name_in("mode", ("weave", "wobble")), maybe("inner"): INNER,
    maybe("speeds"): list_of(number(), "must be a list of speeds", least=1),
    maybe("rows"): list_of(INNER, "must be tables", strict=False),
    maybe("noise", {}): by_name(number(least=0), ("lean", "steer"), kind="channel"),
})  # fmt: skip
GOOD = {"tyre": "T", "speed_m_s": 3}


def test_values_come_back_with_defaults_and_floats():
    given = read(TOP, GOOD | {"inner": {"load_N": 400}, "rows": [{"load_N": 1}]})
    assert given == {
        "tyre": "T", "speed_m_s": 3.0, "kind": "flat", "samples": 1, "synthetic": False, "noise": {},
        "inner": {"load_N": 400.0}, "rows": [{"load_N": 1.0}],
    }  # fmt: skip
    assert isinstance(given["speed_m_s"], float)
    assert read(TOP, GOOD | {"speed_m_s": np.float64(2.5)})["speed_m_s"] == 2.5
    assert TOP.keys[:2] == ("tyre", "speed_m_s")


@pytest.mark.parametrize(("change", "words"), [
    ({"tire": 1}, "f.toml: [rig]: unknown key 'tire'; did you mean 'tyre'? known: inner, kind, mode, noise"),
    ({"tyre": 3}, "f.toml: [rig]: tyre = 3 must be text in quotes"),
    ({"tyre": " "}, "f.toml: [rig]: tyre is empty"),
    ({"tyre": "a\0b"}, "f.toml: [rig]: tyre holds a NUL character; delete it"),
    ({"speed_m_s": "3"}, "f.toml: [rig]: speed_m_s = '3' must be a finite number"),
    ({"speed_m_s": True}, "f.toml: [rig]: speed_m_s = True must be a finite number"),
    ({"speed_m_s": math.inf}, "f.toml: [rig]: speed_m_s = inf must be a finite number"),
    ({"speed_m_s": math.nan}, "f.toml: [rig]: speed_m_s = nan must be a finite number"),
    ({"speed_m_s": 10**400}, "f.toml: [rig]: speed_m_s = 1" + 56 * "0" + "... must be a finite number"),
    ({"kind": "road"}, "f.toml: [rig]: kind = 'road' must be flat or drum"),
    ({"samples": 10}, "f.toml: [rig]: samples = 10 must be a whole number from 1 to 9"),
    ({"samples": True}, "f.toml: [rig]: samples = True must be a whole number from 1 to 9"),
    ({"synthetic": 1}, "f.toml: [rig]: synthetic = 1 must be true or false"),
    ({"mode": "weve"}, "f.toml: [rig]: unknown mode 'weve'; did you mean 'weave'? known: weave, wobble"),
    ({"speeds": []}, "f.toml: [rig]: speeds = [] must be a list of speeds"),
    ({"speeds": [1, "2"]}, "f.toml: [rig]: speeds = [1, '2'] must be a list of speeds"),
    ({"rows": [{"load_N": 1}, {"load_N": 0}]}, "f.toml: [[rig.rows]] number 2: load_N = 0 must be a finite"),
    ({"rows": [1]}, "f.toml: [[rig.rows]] number 1: 1 must be a table"),
    ({"inner": 3}, "f.toml: [rig]: inner = 3 must be a table: write [rig.inner] and the keys below it"),
    ({"inner": {}}, "f.toml: [rig.inner]: load_N is missing"),
    ({"inner": {"load_N": 1, "shape": 3.0}}, "f.toml: [rig.inner]: shape = 3 is no shape"),
    ({"inner": {"load_N": 1, "shape": "a"}}, "f.toml: [rig.inner]: shape = 'a' must be a finite number"),
    ({"noise": {"yaw": 1}}, "f.toml: [rig.noise]: unknown channel 'yaw'; known: lean, steer"),
    ({"noise": {"lean": -1}}, "f.toml: [rig.noise]: lean = -1 must be a finite number from 0"),
])  # fmt: skip
def test_words(change, words):
    with pytest.raises(InputError) as refusal:
        read(TOP, GOOD | change, where="f.toml", section="rig")
    assert str(refusal.value).startswith(words)


def test_the_first_mistake_is_told_unknown_keys_before_all_and_missing_ones_as_declared():
    refuses("^unknown key 'tire'", read, TOP, {"samples": 0, "inner": {"lod": 1}, "tire": "T"})
    refuses("^samples = 0", read, TOP, {"samples": 0})
    refuses("^tyre is missing; give its name$", read, TOP, {})
    refuses("^speed_m_s is missing$", read, TOP, {"tyre": "T"})


def test_keys_may_be_named_with_their_table():
    for change, words in (
        ({"inner": {"load_N": -1}}, "a.inner.load_N = -1 must be"),
        ({"inner": {}}, "a.inner: load_N is missing"),
        ({"inner": 1}, r"a.inner = 1 must be a table: write \[a.inner\]"),
    ):
        refuses(f"^{words}", read, TOP, GOOD | change, section="a", dotted=True)
