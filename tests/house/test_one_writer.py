"""Every file of velotyre is written by tyre/files.py, so that none is ever half written."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
WRITERS = {"write_text", "write_bytes", "savefig", "to_csv", "to_json", "saving"}
OWN = (
    "tyre/files.py",
    "studies/sweep/",  # parts with their own digests
    "studies/explorer/uploads.py",  # a dropped file, in a temporary folder
    "studies/diagnosis/measurement_file.py",  # unpacks into a temporary folder
    "studies/door_stubs.py",  # of the source itself
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


def guarded(node, found, *, inside=False):
    """Calls that write, outside of every ``with replacing(..)``."""
    if isinstance(node, ast.With):
        inside = inside or any(
            getattr(item.context_expr, "func", None) is not None
            and getattr(item.context_expr.func, "id", "") == "replacing"
            for item in node.items
        )
    if isinstance(node, ast.Call) and not inside and writes(node):
        found.append(node.lineno)
    for child in ast.iter_child_nodes(node):
        guarded(child, found, inside=inside)
    return found


def lines_that_write(text):
    """Numbers of the lines of a program that write a file; a text without any such word is not parsed."""
    words = ("open(", *WRITERS)
    return guarded(ast.parse(text), []) if any(word in text for word in words) else []


def test_every_file_goes_through_one_writer():
    here = [
        f"{file.relative_to(ROOT)}:{line}"
        for top in ("tyre", "bicycle", "studies")
        for file in sorted((ROOT / top).rglob("*.py"))
        if not file.relative_to(ROOT).as_posix().startswith(OWN)
        for line in lines_that_write(file.read_text(encoding="utf-8"))
    ]
    assert here == []


@pytest.mark.parametrize(
    ("code", "lines"),
    [
        ("path.write_text(x)", [1]),
        ("write_text(path, x)", []),
        ("frame.to_csv(path)", [1]),
        ("frame.to_csv(index=False)", []),
        ("open(path, 'w')\nopen(path)\npath.open('wb')\npath.open('a')", [1, 3]),
        ("with replacing(t) as part:\n    figure.savefig(part)\nfigure.savefig(t)", [3]),
        ("with replacing(t) as part, part.open('w') as file:\n    pass", []),
    ],
)
def test_the_rule_sees_what_writes(code, lines):
    assert lines_that_write(code) == lines
