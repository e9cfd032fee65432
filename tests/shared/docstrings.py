"""Which arguments of the house's public functions their docstrings leave out; see tests/house/test_documented.py."""

import ast
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

NUMBERS = re.compile(r"\b(float|int|complex|Array|ArrayLike|NDArray|Complex|ndarray|Places)\b")
"""In an annotation: the argument carries numbers, which mean nothing without unit or shape."""

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
"""A unit, a shape, a range of plain numbers, a word that says why there is none, or where it is said."""

ELSEWHERE = re.compile(r"(Parameters|Arguments|arguments)[^.]* as (in )?:(func|meth):`")
"""The docstring of another function, which is named, says what the arguments are."""

NAME_WITH_UNIT = re.compile(
    r"^relative_|_(m|mm|s|n|bar|pa|hz|deg|rad|kg|m_s|n_rad|n_m|n_m_s|n_m_rad|1_s|rad_s|percent)$"
)

CONTAINERS = {"None", "Sequence", "Iterable", "Iterator", "list", "tuple", "dict", "set", "Mapping", "str", "type"}

SECTION = re.compile(r"^(Parameters|Other Parameters)\n-+\n(.*?)(?=^\w[\w ]*\n-+\n|\Z)", re.MULTILINE | re.DOTALL)


@dataclass(frozen=True)
class Argument:
    """An argument of a public function, as its source says it."""

    function: str
    name: str
    annotation: str
    docstring: str
    bases: tuple[str, ...] = ()

    @property
    def numeric(self) -> bool:
        """Whether the annotation (or the lack of one) says that it carries numbers."""
        kind = re.sub(r"Callable\[\[[^\]]*\], [^\]]*\]|random\.Generator|Literal\[[^\]]*\]", "", self.annotation)
        return not self.annotation or bool(NUMBERS.search(kind))

    @property
    def lacks(self) -> str:
        """What the docstring leaves out: the argument itself, its unit or shape, or nothing."""
        texts = mentions(self.docstring, self.name)
        if ELSEWHERE.search(self.docstring):
            return ""
        if not texts:
            return "not mentioned"
        told = NAME_WITH_UNIT.search(self.name) or UNIT.fullmatch(self.name) or any(UNIT.search(text) for text in texts)
        return "" if told or not self.numeric else "no unit or shape"

    def is_of(self, types: set[str]) -> bool:
        """Whether the annotation names nothing but these types, one or several of them."""
        named = set(re.findall(r"[A-Za-z_]+", self.annotation)) - CONTAINERS
        return bool(named) and named <= types and not self.numeric


def mentions(docstring: str, name: str) -> list[str]:
    """What a docstring says of an argument: its entry in a numpydoc section, and sentences with it in backticks."""
    found = []
    for _, section in SECTION.findall(docstring):
        for entry in re.split(r"^(?=\S)", section, flags=re.MULTILINE):
            first, _, rest = entry.partition("\n")
            heads, _, kind = first.partition(" : ")
            if name in [head.strip().lstrip("*") for head in heads.split(",")]:
                found.append(f"{kind} {rest}")
    for sentence in re.split(r"(?<=[.;])\s", SECTION.sub("", docstring)):
        if re.search(rf"``\*{{0,2}}{re.escape(name)}``", sentence):
            found.append(sentence.replace(f"``{name}``", ""))
    return found


def arguments(module: str, source: str) -> list[Argument]:
    """Every argument of the public functions of a module and of the public methods of its public classes."""
    return list(_of(module, ast.parse(source).body))


def own_types(source: str) -> set[str]:
    """Names of the classes of a module and of its aliases of types (capitalised, not constants)."""
    types = set()
    for node in ast.parse(source).body:
        if isinstance(node, ast.ClassDef):
            types.add(node.name)
        elif isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            types |= {t.id for t in targets if isinstance(t, ast.Name) and re.match(r"[A-Z]\w*[a-z]", t.id)}
    return types


def undocumented(files: Mapping[str, Path], programs: str = "studies") -> dict[str, str]:
    """Function -> the arguments that it leaves out, over every module whose own and whose folders' names are public.

    Functions of the package ``programs`` may leave out arguments of the house's own types.
    """
    sources = {module: file.read_text(encoding="utf-8") for module, file in files.items()}
    types = set().union(*(own_types(source) for source in sources.values()))
    public = [module for module in sources if not any(part.startswith("_") for part in module.split("."))]
    every = [argument for module in public for argument in arguments(module, sources[module])]
    inherited = {(*a.function.split(".")[-2:], a.name) for a in every if not a.lacks}
    left: dict[str, list[str]] = {}
    for a in every:
        excused = a.function.startswith(f"{programs}.") and a.is_of(types)
        taken_over = any((base, a.function.rpartition(".")[2], a.name) in inherited for base in a.bases)
        if a.lacks and not excused and not taken_over:
            left.setdefault(a.function, []).append(f"{a.name} ({a.lacks})")
    return {function: ", ".join(names) for function, names in sorted(left.items())}


def _of(where: str, body: list[ast.stmt], bases: tuple[str, ...] | None = None) -> Iterator[Argument]:
    for node in body:
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            yield from _of(f"{where}.{node.name}", node.body, tuple(ast.unparse(base) for base in node.bases))
        elif isinstance(node, ast.FunctionDef) and not (node.name.startswith("_") and node.name != "__call__"):
            decorators = {ast.unparse(decorator).partition("(")[0] for decorator in node.decorator_list}
            if not decorators & {"click.command", "overload"}:
                bound = bases is not None and "staticmethod" not in decorators
                yield from _arguments_of(f"{where}.{node.name}", node, bases or (), bound=bound)


def _arguments_of(where: str, node: ast.FunctionDef, bases: tuple[str, ...], *, bound: bool) -> Iterator[Argument]:
    every = node.args
    given = [*every.posonlyargs, *every.args][bound:] + every.kwonlyargs
    given += [extra for extra in (every.vararg, every.kwarg) if extra]
    for argument in given:
        if not argument.arg.startswith("_"):
            annotation = ast.unparse(argument.annotation) if argument.annotation else ""
            yield Argument(where, argument.arg, annotation, ast.get_docstring(node) or "", bases)
