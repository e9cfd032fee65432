"""Stubs of the package ``velotyre``, so that editors and type checkers know its names and every effect's parameters.

The package imports its names when they are asked for, which no checker can follow. ``python -m studies.door_stubs``
writes the stubs again from the same tables and declarations; a test compares.
"""

import math
from pathlib import Path

from bicycle.effect import Effect, Parameter, packaged_effects
from studies.velotyre import PLACES

FOLDER = Path(__file__).parent / "velotyre"
HEAD = "# Written by python -m studies.door_stubs from the door's table and the declarations of the effects.\n\n"


def stubs() -> dict[str, str]:
    """File name -> content of every stub."""
    return {"__init__.pyi": _door(), "effects.pyi": _effects()}


def _door() -> str:
    classes = sorted(effect.__name__ for effect in packaged_effects().values())
    places = {module: sorted(names, key=_order) for module, names in PLACES.items()}
    lines = [_import(module, places[module]) for module in sorted(places)]
    names = sorted([*classes, *(name for names in places.values() for name in names), "effects"], key=_order)
    return "".join([
        HEAD, *lines, "\nfrom . import effects\n", _import(".effects", classes),
        "\nPLACES: dict[str, tuple[str, ...]]\n\n__all__ = [\n",
        *(f'    "{name}",\n' for name in names), "]\n",
    ])  # fmt: skip


def _import(module: str, names: list[str]) -> str:
    line = f"from {module} import {', '.join(names)}\n"
    return line if len(line) <= 121 else f"from {module} import (\n" + "".join(f"    {n},\n" for n in names) + ")\n"


def _effects() -> str:
    head = f"{HEAD}from bicycle.effect import Effect, PerWheel, PerWheelValue\n"
    return head + "".join(f"\n{_stub(effect)}" for effect in packaged_effects().values())


def _stub(effect: type[Effect]) -> str:
    lines = (effect.__doc__ or "").split("\n")
    text = [lines[0], *(f"    {line}" if line else "" for line in lines[1:])]
    body = [f'    """{text[0]}', *text[1:]]
    body = [f'{body[0]}"""'] if len(body) == 1 else [*body, '    """']
    body += [""]
    body += [f"    {p.name}: {'PerWheel' if p.per_wheel else 'float'}" for p in effect.parameters]
    arguments = [_argument(p) for p in sorted(effect.parameters, key=lambda p: p.default is not None)]
    if arguments:
        body += ["    def __init__(", "        self,", "        *,", *arguments, "    ) -> None: ..."]
    else:
        body += ["    def __init__(self) -> None: ..."]
    return f"class {effect.__name__}(Effect):\n" + "\n".join(body) + "\n"


def _argument(p: Parameter) -> str:
    kind = "PerWheelValue" if p.per_wheel else "float"
    if p.default is None:
        return f"        {p.name}: {kind},"
    known = isinstance(p.default, float) and math.isfinite(p.default)
    return f"        {p.name}: {kind} = {p.default!r}," if known else f"        {p.name}: {kind} = ...,"


def _order(name: str) -> tuple[bool, str]:
    return not name[0].isupper(), name


def main() -> None:
    """Write every stub beside the package."""
    for name, text in stubs().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
