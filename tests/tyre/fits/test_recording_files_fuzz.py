"""Mutated recordings and property files: InputError or a sound result; `validate damaged-inputs` tries many more."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tyre.fits import read_recording, write_csv, write_tydex
from tyre.ground import InputError
from tyre.laws import fit_mf52, fit_mf61, parse_tir, write_tir
from tyre.recordings import Condition, LateralStiffnessTest, RigRun, preflight

FUZZ = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
SNIPPETS = st.one_of(
    st.text(max_size=6),
    st.sampled_from(
        ["**", "**END", "\n", "\r", "\0", ",", ";", "NOTAVAIL", "nan", "inf", "-inf", "1e400", "1e-400", "-",
         "deg", "rad", "=", "[", "'", "$", "!", "99999999999999999999", "0", "\t", " " * 12, "°", "é", "\ufeff", "\x85",
         "\x0b"]
    ),
)  # fmt: skip
# where (as a share of the text), how much is cut, what is put in its place
MUTATIONS = st.lists(st.tuples(st.floats(0.0, 1.0), st.integers(0, 12), SNIPPETS), min_size=1, max_size=4)


def mutate(text, mutations):
    for place, cut, snippet in mutations:
        start = int(place * len(text))
        text = text[:start] + snippet + text[start + cut :]
    return text


def check(recording):
    """A recording that was read must be whole: equal lengths, finite condition, and a verdict of the pre-flight."""
    lengths = {len(value) for value in vars(recording).values() if isinstance(value, np.ndarray)}
    assert len(lengths) == 1
    assert recording.condition.load > 0.0
    assert recording.condition.pressure > 0.0
    assert preflight(recording).present or preflight(recording).problems


@pytest.fixture
def recordings():
    t = np.arange(12) / 10.0
    slip = np.deg2rad(4.0) * np.sin(np.pi * t)
    condition = Condition("Tyre", 400.0, 5.5e5, "drum", 1.3, "rim", 2.6, 22.0)
    run = RigRun(condition, "ISO", t, slip, 6300.0 * slip, 400.0 + t, -110.0 * slip, speed=2.6 + 0 * t)
    pull = LateralStiffnessTest(condition, "ISO", 50.0 * t, 1e-3 * t, 1e-4 * t, time=t)
    return {"run": run, "pull": pull}


@pytest.mark.parametrize("name", ["run", "pull"])
@FUZZ
@given(mutations=MUTATIONS)
def test_mutated_tydex(tmp_path, recordings, name, mutations):
    path = tmp_path / "a.tdx"
    write_tydex(recordings[name], path)
    path.write_text(mutate(path.read_text(), mutations), encoding="utf-8", newline="", errors="surrogatepass")
    try:
        check(read_recording(path))
        message = str(path)
    except InputError as error:
        message = str(error)
    assert str(path) in message


@pytest.mark.parametrize("name", ["run", "pull"])
@pytest.mark.parametrize("suffix", [".csv", ".toml"])
@FUZZ
@given(mutations=MUTATIONS)
def test_mutated_csv_or_sidecar(tmp_path, recordings, name, suffix, mutations):
    path = tmp_path / "a.csv"
    write_csv(recordings[name], path)
    changed = path.with_suffix(suffix)
    text = mutate(changed.read_text(), mutations)
    changed.write_text(text, encoding="utf-8", newline="", errors="surrogatepass")
    try:
        check(read_recording(path))
        message = str(tmp_path)
    except InputError as error:
        message = str(error)
    assert str(tmp_path) in message


@FUZZ
@given(raw=st.binary(max_size=200), suffix=st.sampled_from([".csv", ".toml", ".tdx"]))
def test_arbitrary_bytes(tmp_path, recordings, raw, suffix):
    write_csv(recordings["run"], tmp_path / "a.csv")
    path = (tmp_path / "a").with_suffix(suffix)
    path.write_bytes(raw)
    with pytest.raises(InputError):
        read_recording(path)


@pytest.mark.parametrize("version", [52, 61])
@FUZZ
@given(mutations=MUTATIONS)
def test_mutated_tir(tmp_path, version, mutations):
    common = {"load": [300.0, 500.0], "cornering_stiffness": [5e3, 7e3], "lateral_stiffness": [5e4, 5.4e4]}
    if version == 61:
        model = fit_mf61(pressure=[3e5, 7e5], **common)
    else:
        model = fit_mf52(pressure=5.5e5, unloaded_radius=0.33, **common)
    path = tmp_path / "a.tir"
    write_tir(model, path, tyre="T", surface="flat", unloaded_radius=0.33)
    text = mutate(path.read_text(), mutations)
    try:
        found = parse_tir(text, source="a.tir").at(load=400.0, pressure=5.5e5)
    except InputError as error:
        found, message = None, str(error)
    if found is None:
        assert "a.tir" in message
    else:
        length = found.cornering_stiffness / found.lateral_stiffness
        assert found.relaxation_length == pytest.approx(length, nan_ok=True)
        assert np.isnan(length) == any("holds no lateral stiffness" in note for note in found.notes)
        assert 0.0 < found.cornering_stiffness < np.inf
