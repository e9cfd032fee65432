"""Bicycles of canonical matrices: published numbers, the same bicycle by its parameters, and what is refused."""

import numpy as np
import pytest

from bicycle import Model, critical_speeds, load_bicycle, modes
from bicycle.files import holds_matrices
from bicycle.model import read_matrices
from tyre.ground import InputError

JBIKE6 = """% canonical form M q'' + v C1 q' + (g K0 + v^2 K2) q = f, q = (lean, steer); synthetic
M0 = [84.2452, 2.148196245; 2.148196245, 0.1806343419];
C1 = [0, 34.29309543; -0.414545201, 1.379001166];
K0 = [-79.986, -2.290064277
      -2.290064277, -0.6986038858];
K2 = [0 73.26630268; 0 2.182843181];
g = 9.81;
"""
BENCHMARK = """
M = [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]]
C1 = [[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]]
K0 = [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]]
K2 = [[0, 76.59734589573222], [0, 2.65431523794604]]
"""


def written(folder, text, name="mine.toml"):
    file = folder / name
    file.write_text(text)
    return file


def test_matrices_of_matlab_give_the_speeds_and_roots_of_another_program(tmp_path):
    model = read_matrices(written(tmp_path, JBIKE6, "mck.m"))
    speeds = {one.mode: one.speed for one in critical_speeds(model)}
    assert speeds == pytest.approx({"weave": 5.046825, "capsize": 8.539013}, abs=5e-7)
    found = modes(model, [6.0])
    assert found.branch("castering")[0, 0] == pytest.approx(-21.8068, abs=5e-5)
    assert found.branch("weave")[0, 0] == pytest.approx(-1.0837 + 4.1373j, abs=8e-5)
    assert found.branch("capsize")[0, 0] == pytest.approx(-0.5833, abs=5e-5)


def test_published_matrices_are_the_published_bicycle(tmp_path):
    """Meijaard et al. (2007): matrices and eigenvalues of the benchmark."""
    model, whole = read_matrices(written(tmp_path, BENCHMARK)), Model(load_bicycle("benchmark")).linear_model()
    assert model.eigenvalues(5.0)[0] == pytest.approx(-14.07838969279822, rel=1e-12)
    speeds = [2.0, 4.0, 5.0, 6.5, 9.0, 30.0]
    np.testing.assert_allclose(
        np.sort_complex(model.eigenvalues(speeds)), np.sort_complex(whole.eigenvalues(speeds)), atol=1e-9
    )
    assert modes(model, speeds).names == modes(whole, speeds).names
    names = [[one.mode, round(one.speed, 6)] for one in critical_speeds(model)]
    assert names == [["weave", 4.292383], ["capsize", 6.024262]]


def test_a_stiffness_that_holds_g_is_seen(tmp_path):
    folded = "K0 = [[-794.1195, -25.5012603213124], [-25.5012603213124, -7.88032281779043]]"
    text = "\n".join(folded if line.startswith("K0") else line for line in BENCHMARK.splitlines())
    with pytest.raises(InputError, match=r"belong to a wheelbase of 10\.4 m .* give g = 1 if K0 holds g already"):
        read_matrices(written(tmp_path, text))
    model = read_matrices(written(tmp_path, text + "\ng = 1\n"))
    assert [round(one.speed, 6) for one in critical_speeds(model)] == [4.292383, 6.024262]


@pytest.mark.parametrize(("old", "new", "words"), [
    ("C1 = [[0, 33.8", "C1 = [[33.8", "C1 = .* must be two rows of two numbers, lean first"),
    ("[[80.81722, 2.31941332208709]", "[[80.81722, 2.4]", r"M is not symmetric \(2.4 and 2.31941\)"),
    ("0.29784188199686", "-0.3", "M is not positive definite"),
    ("[[0, 76.59734589573222]", "[[0, -76.59734589573222]", "belong to a wheelbase of -1.06 m"),
    ("K2 = [[0, 76", "G = 3\nK2 = [[0, 76", "unknown key 'G'"),
    ("[[-80.95", "[[nan", "holds nan, which must be a finite number"),
    ("M = ", "M1 = ", "unknown key 'M1'"),
])  # fmt: skip
def test_matrices_that_are_no_bicycle_are_refused(tmp_path, old, new, words):
    file = written(tmp_path, BENCHMARK.replace(old, new))
    assert holds_matrices(file)
    with pytest.raises(InputError, match=words):
        read_matrices(file)
