"""Faults put into source on purpose: which there are, that each is put where it says, and how tests judge them."""

import ast
import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studies.validations import mutation
from studies.validations._mutants import all_mutants, mutants
from studies.validations._mutation_callers import COMPILED, callers
from studies.validations._mutation_tests import LineTests, _by_lines, read_map, write_map
from studies.validations.mutation import judge
from tyre.base.errors import InputError

SOURCES = sorted((Path(__file__).parents[3] / "bicycle").rglob("*.py"))
TOY = '''"""Ein Fahrrad mit Umläuten."""
LIMIT = 4.0


def force(stiffness: float = 2.0, angle: "int | None" = 3) -> float:
    name = "ä" + str(angle)
    return -stiffness * angle + (len(name)
                                 - 1) / LIMIT
'''


INNER = "len(name)\n                                 - 1"


def changed(text):
    """What each fault of ``text`` makes of it."""
    return {(m.kind, m.line, m.before, m.after) for m in mutants("toy.py", text)}


def test_every_sign_number_and_term_is_a_fault_and_words_are_none():
    assert changed(TOY) == {
        ("number", 2, "4.0", "4.4"),
        ("number", 5, "2.0", "2.2"),
        ("number", 5, "3", "4"),
        ("minus", 7, "-stiffness", "(stiffness)"),
        ("sign", 7, "*", "/"),
        ("term", 7, "-stiffness * angle", "(-stiffness)"),
        ("term", 7, "-stiffness * angle", "(angle)"),
        ("sign", 7, "+", "-"),
        ("term", 7, TOY[TOY.index("-stiff") :].rstrip("\n"), "(-stiffness * angle)"),
        ("term", 7, TOY[TOY.index("-stiff") :].rstrip("\n"), f"(({INNER}) / LIMIT)"),
        ("sign", 8, "-", "+"),
        ("sign", 8, "/", "*"),
        ("term", 7, INNER, "(len(name))"),
        ("term", 7, INNER, "(-(1))"),
        ("term", 7, f"({INNER}) / LIMIT", f"({INNER})"),
        ("number", 8, "1", "2"),
    }  # fmt: skip


def test_a_fault_changes_the_program_and_leaves_the_lines_where_they_are():
    for mutant in mutants("toy.py", TOY):
        faulty = mutant.applied(TOY)
        assert ast.dump(ast.parse(faulty)) != ast.dump(ast.parse(TOY))
        assert "Umläuten" in faulty
        assert len(mutant.name.splitlines()) == 1


@settings(max_examples=30)
@given(st.sampled_from(SOURCES), st.randoms(use_true_random=False))
def test_every_fault_of_the_project_is_a_program(path, rng):
    text = path.read_text(encoding="utf-8")
    found = mutants("x.py", text)
    for mutant in rng.sample(found, min(3, len(found))):
        ast.parse(mutant.applied(text))


def test_a_fault_is_not_put_into_another_text():
    with pytest.raises(ValueError, match="toy.py:2: holds '5.0', expected '4.0'"):
        mutants("toy.py", TOY)[0].applied(TOY.replace("4.0", "5.0"))


def test_blocks_for_type_checkers_are_left_alone():
    assert changed("if TYPE_CHECKING:\n    x = 1\nelse:\n    pass\ny = 2\n") == {("number", 5, "2", "3")}


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A tree with one module and its tests, and which tests run which lines."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # it needs none of them, and each takes its time
    (tmp_path / "toy.py").write_text("def twice(x):\n    y = 2 * x\n    z = 7\n    return y\n")
    (tmp_path / "test_toy.py").write_text(
        "import toy\n\ndef test_four():\n    assert toy.twice(2) == 4\n\ndef test_sound():\n    pass\n"
    )
    names = ("test_toy.py::test_four", "test_toy.py::test_sound")
    lines = {"0": [0, 1], "2": [0], "3": [1]}
    return tmp_path, LineTests({names[0]: 0.1, names[1]: 0.0}, {"toy.py": lines}, names)


@pytest.mark.parametrize(
    ("place", "end", "count"),
    [((2, "number"), "killed", 1), ((3, "number"), "survived", 1)],
    ids=["killed", "survived"],
)
def test_tests_that_run_the_line_judge(toy, place, end, count):
    tree, tests = toy
    sound = (tree / "toy.py").read_text()
    mutant = next(m for m in all_mutants(tree, (".",)) if m.file == "toy.py" and (m.line, m.kind) == place)
    row = judge(mutant, tree, tests, longest=10.0)
    assert (row["end"], row["tests"]) == (end, count)
    assert (tree / "toy.py").read_text() == sound


def test_what_does_not_end_and_what_no_test_runs(toy, monkeypatch):
    tree, tests = toy
    (tree / "test_toy.py").write_text(
        "import time, toy\n\ndef test_four():\n    time.sleep(60 * (toy.twice(2) != 4))\n"
    )
    monkeypatch.setattr(mutation, "_SPARE", 4.0)
    mutant = next(m for m in all_mutants(tree, (".",)) if m.file == "toy.py" and (m.line, m.kind) == (2, "number"))
    assert judge(mutant, tree, tests, longest=0.1)["end"] == "killed by time"
    assert judge(mutant, tree, LineTests({}, {}, ()), longest=0.1)["end"] == "no test runs it"


def test_quickest_tests_come_first_and_lines_that_run_at_import_are_judged_by_all_of_the_file(toy):
    _, tests = toy
    assert tests.of_lines("toy.py", 1, 1) == ["test_toy.py::test_sound", "test_toy.py::test_four"]
    assert tests.of_lines("toy.py", 2, 2) == ["test_toy.py::test_four"]
    assert tests.of_lines("other.py", 2, 2) == []


@pytest.fixture
def compiled(tmp_path):
    """A tree in which a compiled file is called by another, and that by a module."""
    (tmp_path / "p").mkdir()
    (tmp_path / "p" / "inner_kernel.py").write_text("def one():\n    return 1\n")
    (tmp_path / "p" / "outer_kernel.py").write_text(
        "from p.inner_kernel import one\ndef two():\n    return one() + one()\n"
    )
    (tmp_path / "p" / "a.py").write_text("from p import outer_kernel\n\ndef f():\n    return outer_kernel.two()\n")
    (tmp_path / "p" / "b.py").write_text("def f():\n    from p.inner_kernel import one as first\n    return first()\n")
    (tmp_path / "p" / "c.py").write_text("one = 1\nprint(one)\n")
    return tmp_path


def test_compiled_code_is_judged_by_what_calls_it(compiled):
    assert callers(compiled, ["p"], "p/inner_kernel.py") == {("p/a.py", 4), ("p/b.py", 3)}
    assert callers(compiled, ["p"], "p/outer_kernel.py") == {("p/a.py", 4)}
    tests = LineTests(
        {"slow": 2.0, "quick": 1.0}, {"p/a.py": {"4": [0]}, "p/b.py": {"3": [1], "0": [0]}}, ("slow", "quick")
    )
    assert tests.of_places(callers(compiled, ["p"], "p/inner_kernel.py")) == ["quick", "slow"]
    assert tests.of_places({("p/a.py", 1)}) == []


def test_every_compiled_file_of_the_project_is_called_from_somewhere():
    top = Path(__file__).parents[3]
    files = [path.relative_to(top).as_posix() for path in SOURCES if path.name.endswith(COMPILED)]
    assert len(files) > 5
    assert all(callers(top, mutation.PARTS, file) for file in files)


def test_the_map_is_kept(toy, tmp_path):
    write_map(tmp_path / "tests.json", toy[1])
    assert read_map(tmp_path / "tests.json") == toy[1]


def test_contexts_of_coverage_become_tests_by_line(tmp_path):
    class Data:
        def measured_files(self):
            return [str(tmp_path / "bicycle" / "x.py")]

        def contexts_by_lineno(self, path):
            assert path.endswith("x.py")
            return {1: [""], 2: ["tests/a.py::t|run", "tests/a.py::t|setup"], 3: ["tests/a.py::s[a|b]|run"]}

    found = _by_lines(tmp_path, Data(), {})
    assert found.of_lines("bicycle/x.py", 2, 2) == ["tests/a.py::t"]
    assert set(found.of_lines("bicycle/x.py", 1, 1)) == {"tests/a.py::t", "tests/a.py::s[a|b]"}


def test_a_run_is_resumed_and_counts_by_part(tmp_path, monkeypatch):
    (tmp_path / "tests.json").write_text(json.dumps({"seconds": {}, "tests": {}, "names": []}))
    monkeypatch.setattr(mutation, "_copy", lambda top, tree: tree)
    monkeypatch.setattr(mutation, "PARTS", ("studies/uncertainty",))
    first = mutation.run(out=tmp_path, seed=5, mutants=6)
    assert first["all"] == {"no test runs it": 6}
    assert len(first["survivors"]) == 6
    again = mutation.run(out=tmp_path, seed=5, mutants=8)
    assert again["survivors"][:6] == first["survivors"]
    assert len((tmp_path / "mutants.jsonl").read_text().splitlines()) == 8


def test_without_tests_there_is_nothing_to_judge_by(tmp_path, monkeypatch):
    monkeypatch.setattr(mutation, "__file__", str(tmp_path / "a" / "b" / "mutation.py"))
    with pytest.raises(InputError, match="holds no tests; run it in a source tree"):
        mutation.run(out=tmp_path / "out", seed=1)
