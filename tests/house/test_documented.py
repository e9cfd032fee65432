"""Every function that a door exports says what its arguments are, numbers with unit or shape.

An exported function, or a public method of an exported class, documents each of its arguments by an entry in the
numpydoc section Parameters, or by a sentence that holds its name in double backticks. If its annotation carries
numbers, this entry or sentence holds a unit (``N/rad``, "no unit"), a shape (``(n, 2)``) or a word that says why there
is neither ("number of", "share", "0 to 1") or where it is said ("as in", ``:func:``); a name that ends in its unit
(``start_hz``) has said it. A docstring may leave all of it to another one: "Arguments as :func:`...`", and a method
what a base class says.
"""

import inspect
import re
from itertools import chain

import pytest

import bicycle
import tyre
import velotyre

NUMBERS = re.compile(r"\b(float|int|complex|Array|ArrayLike|NDArray|ndarray)\b")
NO_NUMBERS = re.compile(r"Callable\[\[.*?\], [^\]]*\]|random\.\w*Generator|Literal\[[^\]]*\]")
UNIT = re.compile(
    r"""(?<![\w'])(
        (k|m|M)?(m|g|s|N|Pa|Hz|bar|rad|deg|J|W|K|V)(\^-?\d)?(?![\w'])  # a unit alone or the first of a product
        | 1/\w | % | per\ ?cent | dB | SI | (no|any|same|own)\ units? | units? | dimensionless
        | shape | scalar | \([\w, .*+]*,[\w, .*+]*\)  # (n,), (..., n, n)
        | -?\d+(\.\d+)?\ (to|or)\ -?\d | [Aa]s\ (in|of|that|for|what)\b | :(func|meth|class|attr):`
        | (?i:ratio | relative | shares? | factors? | fractions? | quantile | probability | exponent | numbers?
            | counts? | samples? | entries | how\ many | index | indices | places? | seed | bytes | rows? | columns?
            | lines? | inch(es)?)\b | \{\d[\d, ]*\}
    )""",
    re.VERBOSE,
)
ELSEWHERE = re.compile(r"(Parameters|Arguments|arguments)[^.]* as (in )?:(func|meth):`")
NAME_WITH_UNIT = re.compile(r"^relative_|_(m|mm|s|n|bar|pa|hz|deg|rad|kg|m_s|n_rad|n_m|n_m_rad|1_s|rad_s|percent)$")
SECTION = re.compile(r"^(Parameters|Other Parameters)\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", re.MULTILINE | re.DOTALL)


def mentions(text, name):
    """What a docstring says of an argument: its entry in a numpydoc section, and sentences with it in backticks."""
    found = []
    for entry in chain(*(re.split(r"^(?=\S)", section, flags=re.M) for _, section in SECTION.findall(text))):
        heads, _, kind = entry.partition(" : ")
        if name in [head.strip().lstrip("*") for head in heads.partition("\n")[0].split(",")]:
            found.append(kind or entry.partition("\n")[2])
    sentences = re.split(r"(?<=[.;])\s", SECTION.sub("", text))
    named = re.compile(rf"``\*{{0,2}}{re.escape(name)}``")
    return found + [named.sub("", sentence) for sentence in sentences if named.search(sentence)]


def lacks(text, name, annotation):
    """What a docstring leaves out: the argument itself, its unit or shape, or nothing."""
    said = mentions(text, name)
    if ELSEWHERE.search(text):
        return ""
    if not said:
        return "not mentioned"
    numeric = not annotation or NUMBERS.search(NO_NUMBERS.sub("", annotation))
    told = NAME_WITH_UNIT.search(name) or UNIT.fullmatch(name) or any(UNIT.search(one) for one in said)
    return "" if told or not numeric else "no unit or shape"


def functions():
    """Name, function and docstrings (of bases, too) of what the doors export and their classes' public methods."""
    for door, names in ((velotyre, velotyre.HOME), (tyre, tyre.__all__), (bicycle, bicycle.__all__)):
        for name in names:
            found = getattr(door, name)
            if inspect.isfunction(found):
                yield name, found, found.__doc__ or ""
            elif inspect.isclass(found):
                for key, method in vars(found).items():
                    method = getattr(method, "__func__", method)
                    if inspect.isfunction(method) and (key[0] != "_" or key == "__call__"):
                        docs = [getattr(base, key).__doc__ or "" for base in found.__mro__ if hasattr(base, key)]
                        yield f"{name}.{key}", method, inspect.cleandoc("\n\n".join(map(inspect.cleandoc, docs)))


def test_every_argument_is_documented():
    missing, count, own_types = {}, 0, velotyre.HOME.keys() | set(tyre.__all__) | set(bicycle.__all__)
    for name, function, text in functions():
        for argument in inspect.signature(function).parameters.values():
            annotation = "" if argument.annotation is argument.empty else inspect.formatannotation(argument.annotation)
            speaks_for_itself = annotation.rpartition(".")[2] in own_types and function.__module__.startswith("studies")
            if argument.name[0] != "_" and argument.name not in ("self", "cls") and not speaks_for_itself:
                count += 1
                if found := lacks(inspect.cleandoc(text), argument.name, annotation):
                    missing.setdefault(name, []).append(f"{argument.name} ({found})")
    assert count > 150
    assert missing == {}, "document these arguments, with unit or shape where they are numbers"


DOCSTRING = """Lateral force of a tyre at ``slip`` and ``load``; ``label`` goes with it.

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


@pytest.mark.parametrize(("name", "annotation", "left_out"), [
    ("trail", "float | None", ""), ("wheel", "str", ""), ("wheel", "Sequence[float]", "no unit or shape"),
    ("grid", "Array", ""), ("others", "float", "no unit or shape"), ("slip", "ArrayLike", "no unit or shape"),
    ("label", "str", ""), ("label", "", "no unit or shape"), ("slip", "Callable[[float], int]", ""),
    ("wear", "float", "no unit or shape"),  # the s of "tyre's" is no second
    ("limit", "float", ""), ("tyre", "Tyre", "not mentioned"), ("Added", "str", "not mentioned"),
])  # fmt: skip
def test_what_a_docstring_lacks(name, annotation, left_out):
    assert lacks(DOCSTRING, name, annotation) == left_out


@pytest.mark.parametrize("text", [
    "``x`` in N", "m/s, as ``x``", "shape (n,) of ``x``", "how many ``x``", "``x`` (n, 2)", "``x`` without units",
    "``x`` from 0 to 1", "``x`` as in :func:`f`", "Arguments as :func:`f`.",
])  # fmt: skip
def test_units_and_shapes_are_found(text):
    assert lacks(text, "x", "float") == ""
    assert lacks(f"Force in N. Of ``y`` {text}.", "y", "float") in ("", "no unit or shape")
