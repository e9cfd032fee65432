"""Stubs of the package ``velotyre``, so that editors and type checkers know its names and every effect's parameters.

The package imports its names when they are asked for, which no checker can follow.
``python -m studies.door.door_stubs`` writes the stubs again from the same tables and declarations; a test compares.
"""

import math
from pathlib import Path

from bicycle.effects.effect import Effect, Parameter
from bicycle.effects.effect_registry import packaged_effects
from studies.velotyre import PLACES

FOLDER = Path(__file__).parents[1] / "velotyre"
HEAD = "# Written by python -m studies.door.door_stubs from the table of names and the declarations of the effects.\n\n"


def stubs() -> dict[str, str]:
    """File name -> content of every stub."""
    effects = packaged_effects().values()
    classes = sorted(effect.__name__ for effect in effects)
    places = {module: sorted(PLACES[module], key=_order) for module in sorted(PLACES)}
    names = sorted([*classes, *(name for names in places.values() for name in names), "effects"], key=_order)
    door = [
        HEAD,
        *(_import(module, mine) for module, mine in places.items()),
        "\nfrom . import effects\n",
        _import(".effects", classes),
        "\nPLACES: dict[str, tuple[str, ...]]\n\n__all__ = [\n",
        *(f'    "{name}",\n' for name in names),
        "]\n",
    ]
    head = [HEAD, _import("bicycle.effects.effect", ["Effect", "PerWheel", "PerWheelValue"])]
    return {
        "__init__.pyi": "".join(door),
        "effects.pyi": "".join([*head, *(f"\n{_stub(effect)}" for effect in effects)]),
    }


def _import(module: str, names: list[str]) -> str:
    line = f"from {module} import {', '.join(names)}\n"
    return line if len(line) <= 121 else f"from {module} import (\n" + "".join(f"    {n},\n" for n in names) + ")\n"


def _stub(effect: type[Effect]) -> str:
    first, *more = (effect.__doc__ or "").split("\n")
    text = [f'    """{first}', *(f"    {line}" if line else "" for line in more)]
    text = [f'{text[0]}"""'] if len(text) == 1 else [*text, '    """']
    fields = [f"    {p.name}: {'PerWheel' if p.per_wheel else 'float'}" for p in effect.parameters]
    arguments = [_argument(p) for p in sorted(effect.parameters, key=lambda p: p.default is not None)]
    init = ["    def __init__(self) -> None: ..."]
    if arguments:
        init = ["    def __init__(", "        self,", "        *,", *arguments, "    ) -> None: ..."]
    return "\n".join([f"class {effect.__name__}(Effect):", *text, "", *fields, *init]) + "\n"


def _argument(p: Parameter) -> str:
    kind = "PerWheelValue" if p.per_wheel else "float"
    if p.default is None:
        return f"        {p.name}: {kind},"
    is_finite = isinstance(p.default, float) and math.isfinite(p.default)
    return f"        {p.name}: {kind} = {repr(p.default) if is_finite else '...'},"


def _order(name: str) -> tuple[bool, str]:
    return not name[0].isupper(), name


if __name__ == "__main__":
    for file, content in stubs().items():
        (FOLDER / file).write_text(content, encoding="utf-8")
