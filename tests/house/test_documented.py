"""Every function that a door exports says what its arguments are, numbers with unit or shape.

The rule. An exported function, or a public method of an exported class, documents each of its arguments

- by an entry in the numpydoc section Parameters, or by a sentence that holds its name in double backticks;
- and if its annotation carries numbers (or it has none), this entry or sentence holds a unit (``N/rad``, "no unit"), a
  shape (``(n, 2)``) or a word that says why there is neither ("number of", "share", "index", "0 to 1") or where it is
  said ("as in", ``:func:``). A name that ends in its unit (``start_hz``) has said it.

A docstring may leave all of it to another one: "Arguments as :func:`...`". A method may take over what a base class in
the house says of the same argument.
"""

from pathlib import Path

import pytest
from docstrings import Argument, arguments, mentions, own_types, undocumented
from house_imports import modules

import bicycle
import tyre
import velotyre

EXPORTED = {
    f"{found.__module__}.{name}"
    for door, names in ((velotyre, velotyre.HOME), (tyre, tyre.__all__), (bicycle, bicycle.__all__))
    for name in names
    if hasattr(found := getattr(door, name), "__module__")
}


def test_every_argument_is_documented():
    missing = {
        function: names
        for function, names in undocumented(modules(Path(__file__).parents[2])).items()
        if any(function == name or function.startswith(f"{name}.") for name in EXPORTED)
    }
    assert missing == {}, "document these arguments, with unit or shape where they are numbers"


# The checker itself.

DOCSTRING = """Side force of a tyre at ``slip`` and ``load``; ``label`` goes with it.

The tyre's ``wear`` is ignored.

Parameters
----------
stiffness, trail : float
    N/rad and m, not those of ``slip``.
wheel : str
grid : ndarray, shape (n, 2)
*others : float
    Added.

Returns
-------
float
    In N, at most ``limit``.
"""


@pytest.mark.parametrize(
    ("name", "annotation", "lacks"),
    [
        ("stiffness", "float", ""),
        ("trail", "float | None", ""),
        ("wheel", "str", ""),
        ("wheel", "Sequence[float]", "no unit or shape"),
        ("grid", "Array", ""),
        ("others", "float", "no unit or shape"),
        ("slip", "ArrayLike", "no unit or shape"),
        ("label", "str", ""),
        ("label", "", "no unit or shape"),
        ("wear", "float", "no unit or shape"),  # the s of "tyre's" is no second
        ("limit", "float", ""),
        ("tyre", "Tyre", "not mentioned"),
        ("Added", "str", "not mentioned"),
    ],
)
def test_what_a_docstring_lacks(name, annotation, lacks):
    assert Argument("side_force", name, annotation, DOCSTRING).lacks == lacks


def test_numbers_are_known_by_the_annotation():
    numeric = ["", "float", "int | None", "Mapping[str, Array]", "tuple[float, float]", "NDArray[np.bool_]", "complex"]
    other = ["str", "np.random.Generator", "Callable[[float], int]", "Model", "Literal['float']", "bool"]
    assert [kind for kind in numeric if not Argument("f", "x", kind, "").numeric] == []
    assert [kind for kind in other if Argument("f", "x", kind, "").numeric] == []


@pytest.mark.parametrize(
    "text",
    [
        "``x`` in N", "m/s, as ``x``", "shape (n,) of ``x``", "how many ``x``", "``x`` (n, 2)", "``x`` without units",
        "``x`` from 0 to 1", "``x`` as in :func:`f`", "Arguments as :func:`f`.",
    ],
)  # fmt: skip
def test_units_and_shapes_are_found(text):
    assert Argument("f", "x", "float", text).lacks == ""


def test_a_unit_in_another_sentence_does_not_count():
    assert mentions("Force in N. Of ``x`` nothing is said.", "x") == ["Of  nothing is said."]
    assert Argument("f", "x", "float", "Force in N. Of ``x`` nothing is said.").lacks == "no unit or shape"
    assert Argument("f", "x_m_s", "float", "Force in N. Of ``x_m_s`` nothing is said.").lacks == ""
    assert Argument("f", "seed", "int", "Of ``seed`` nothing is said.").lacks == ""


def test_public_functions_methods_and_their_arguments_are_found():
    source = """
def force(slip, /, load: float, *rest, unit="N", _cache=None, **named): ...
def _hidden(x): ...
class Tyre(Base):
    def __call__(self, slip): ...
    def __eq__(self, other): ...
    @staticmethod
    def of(name: str): ...
    @classmethod
    def load(cls, path): ...
class _Hidden:
    def force(self, slip): ...
@click.command()
def show(path): ...
"""
    assert [(a.function.removeprefix("tyre."), a.name) for a in arguments("tyre", source)] == [
        ("force", "slip"), ("force", "load"), ("force", "unit"), ("force", "rest"), ("force", "named"),
        ("Tyre.__call__", "slip"), ("Tyre.of", "name"), ("Tyre.load", "path"),
    ]  # fmt: skip
    assert own_types("class Tyre: ...\nArray = NDArray[float]\nTyres: TypeAlias = list[Tyre]\nLIMIT = 3\nN = 4") == {
        "Tyre", "Array", "Tyres",
    }  # fmt: skip


def test_base_classes_and_types_of_the_house_speak_for_themselves(tmp_path):
    sources = {
        "library": 'class Law:\n    def of(self, model: Model):\n        """Act on ``model``."""\ndef f(law: Law): ...',
        "programs": "class Slip(Law):\n    def of(self, model): ...\ndef f(law: Law, n: int): ...\ndef g(x: str): ...",
        "_private": "def f(x): ...",
    }
    for name, source in sources.items():
        (tmp_path / f"{name}.py").write_text(source)
    files = {name: tmp_path / f"{name.rpartition('.')[2]}.py" for name in ("library", "studies.programs", "_private")}
    assert undocumented(files) == {
        "library.f": "law (not mentioned)",
        "studies.programs.f": "n (not mentioned)",
        "studies.programs.g": "x (not mentioned)",
    }
