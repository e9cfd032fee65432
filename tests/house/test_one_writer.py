"""Every file of velotyre is written by tyre/ground/files.py, so that none is ever half written."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WRITERS = {"write_text", "write_bytes", "savefig", "to_csv", "to_json", "saving"}
OWN = (
    "tyre/ground/files.py",
    "studies/sweep/",  # parts with their own digests
    "studies/explorer/uploads.py",  # a dropped file, in a temporary folder
    "studies/diagnosis/measurement_file.py",  # unpacks into a temporary folder
    "studies/door/door_stubs.py",  # of the source itself
)


def writes(call):
    """Whether a call writes a file by itself: a method that takes a path, or open(.., "w")."""
    name = getattr(call.func, "attr", getattr(call.func, "id", ""))
    if name == "to_csv":
        return bool(call.args)
    if name == "open":
        modes = [a.value for a in (*call.args, *(k.value for k in call.keywords)) if isinstance(a, ast.Constant)]
        return any(str(mode) in ("w", "wb", "x") for mode in modes)  # "a": lines are added to what is complete
    return name in WRITERS and isinstance(call.func, ast.Attribute)


def lines_that_write(program, *, inside=False):
    """Lines of the calls that write, outside of every ``with replacing(..)``."""
    if isinstance(program, ast.With):
        inside = inside or any("replacing(" in ast.unparse(item.context_expr) for item in program.items)
    own = [program.lineno] if isinstance(program, ast.Call) and not inside and writes(program) else []
    return own + [line for child in ast.iter_child_nodes(program) for line in lines_that_write(child, inside=inside)]


def test_every_file_goes_through_one_writer():
    here = [
        f"{file.relative_to(ROOT)}:{line}"
        for top in ("tyre", "bicycle", "studies")
        for file in sorted((ROOT / top).rglob("*.py"))
        if not file.relative_to(ROOT).as_posix().startswith(OWN)
        if any(word in (text := file.read_text(encoding="utf-8")) for word in ("open(", *WRITERS))
        for line in lines_that_write(ast.parse(text))
    ]
    assert here == []


@pytest.mark.parametrize(("code", "lines"), [
    ("path.write_text(x)", [1]),
    ("write_text(path, x)", []),
    ("frame.to_csv(path)", [1]),
    ("frame.to_csv(index=False)", []),
    ("open(path, 'w')\nopen(path)\npath.open('wb')\npath.open('a')", [1, 3]),
    ("with replacing(t) as part:\n    figure.savefig(part)\nfigure.savefig(t)", [3]),
    ("with replacing(t) as part, part.open('w') as file:\n    pass", []),
])  # fmt: skip
def test_the_rule_sees_what_writes(code, lines):
    assert sorted(lines_that_write(ast.parse(code))) == lines
