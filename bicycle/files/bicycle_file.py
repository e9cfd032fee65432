"""Read and write bicycles: packaged or own TOML files, and the flat ``key: value`` YAML of neighbouring projects."""

from collections.abc import Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from bicycle.parameters import UNITS, UNUSED, Bicycle, doubts_about
from tyre.base.errors import InputError, unknown
from tyre.base.key_value import finite
from tyre.base.paths import data_root
from tyre.base.plausible import WAY_OUT, refuse_absurd
from tyre.base.toml_file import read_toml

LEFT_OUT = {"v": "", "yB": "", "yH": "", "IRzz": "IRxx", "IFzz": "IFxx"}  # key -> the key whose value it must have


def available_bicycles() -> tuple[str, ...]:
    """Names of the packaged bicycles, sorted."""
    return tuple(sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml")))


def load_bicycle(name_or_path: str | Path, *, allow_unusual: bool = False) -> Bicycle:
    """A packaged bicycle by name, or one from a ``.toml``, ``.yml``, ``.yaml`` or ``.txt`` file.

    A TOML file has ``description``, ``source``, a table ``[values]`` with Meijaard's keys (SI, lam in rad) and
    optionally ``[sd]``. A YAML or text file is flat, one ``key: value`` a line; ``value +/- sd`` is understood.
    Values far outside what bicycles have (other units?) are refused unless ``allow_unusual``, here or in the file, is
    true.

    Parameters
    ----------
    name_or_path : str or Path
    allow_unusual : bool, optional

    Raises
    ------
    InputError
        No such bicycle or file, unreadable text, or a parameter set that is not a bicycle.
    """
    path = Path(name_or_path)
    if path.suffix.lower() in (".toml", ".yml", ".yaml", ".txt"):
        if not path.is_file():
            raise InputError(f"{path}: no such bicycle file; packaged bicycles: {', '.join(available_bicycles())}")
        return (parse_toml if path.suffix.lower() == ".toml" else parse_flat)(path, allow_unusual=allow_unusual)
    if str(name_or_path) not in available_bicycles():
        raise InputError(f"{unknown('bicycle', name_or_path, available_bicycles())}; or give a .toml or .yaml file")
    return parse_toml(_folder().joinpath(f"{name_or_path}.toml"))


def parse_toml(path: Traversable, *, allow_unusual: bool = False) -> Bicycle:
    """Read one TOML bicycle file.

    Parameters
    ----------
    path : Traversable
    allow_unusual : bool, optional
        Take values far outside what bicycles have; the file may say the same.
    """
    from tyre.base.checks import any_table, anything, flag
    from tyre.base.schema import maybe, needed, read, table

    missing = "the table [values] with the bicycle's parameters is missing"
    declared = {maybe(key, ""): anything for key in ("description", "source")} | {
        needed("values", missing): any_table, maybe("sd", {}): any_table, maybe(WAY_OUT, False): flag,
    }  # fmt: skip
    content = read(table(declared), read_toml(path, "bicycle file"), where=str(path))
    allow = allow_unusual or content[WAY_OUT]
    return _named(path, content["values"], content["sd"], content, allow_unusual=allow)


def parse_flat(path: Path, *, allow_unusual: bool = False) -> Bicycle:
    """Read ``key: value`` or ``key = value`` lines; ``value +/- sd`` gives a standard deviation too.

    What the neighbouring projects store beside the parameters is left out: a speed ``v``, as the warnings say, and what
    symmetry makes superfluous (``yB``, ``yH``, ``IRzz``, ``IFzz``), as they say where the values are not symmetric.

    Parameters
    ----------
    path : Path
        ``.yml``, ``.yaml`` or ``.txt``.
    allow_unusual : bool, optional
        Take values far outside what bicycles have.
    """
    import yaml

    text = path.read_text(encoding="utf-8-sig", errors="replace")
    if path.suffix.lower() == ".txt":
        text = text.replace("=", ": ")
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not a YAML file: {' '.join(str(error).split())}") from error
    if isinstance(node, yaml.MappingNode) and [key.value for key, _ in node.value] == ["values"]:
        node = node.value[0][1]  # the nested form of the same projects
    if not isinstance(node, yaml.MappingNode):
        raise InputError(f"{path}: expected one 'key: value' a line, for example 'w: 1.02'")
    values: dict[str, float] = {}
    sd: dict[str, float] = {}
    left_out: dict[str, tuple[str, float]] = {}
    for key_node, value_node in node.value:
        where = f"{path}, line {key_node.start_mark.line + 1}"
        if not isinstance(key_node, yaml.ScalarNode) or not isinstance(value_node, yaml.ScalarNode):
            raise InputError(f"{where}: expected one 'key: value' a line, found a nested value")
        key = key_node.value
        if key in values:
            raise InputError(f"{where}: {key} is given twice; keep one")
        number, _, spread = str(value_node.value).replace("+/-", "±").partition("±")
        if key in LEFT_OUT:
            left_out[key] = (where, finite(number, where=where, key=key))
            continue
        if key == WAY_OUT and number.strip() in ("true", "false"):
            allow_unusual = allow_unusual or number.strip() == "true"
            continue
        if key not in UNITS and key not in UNUSED:
            raise InputError(f"{where}: {unknown('key', key, [*UNITS, *UNUSED])}")
        values[key] = finite(number, where=where, key=key)
        if spread:
            sd[key] = finite(spread, where=where, key=key)
    notes = [note for key, (where, number) in left_out.items() if (note := _left_out(where, key, number, values))]
    return _named(path, values, sd, {}, tuple(notes), allow_unusual=allow_unusual)


def to_toml(bicycle: Bicycle) -> str:
    """Text of a TOML file of ``bicycle`` that :func:`load_bicycle` reads back exactly."""
    import tomli_w

    content: dict[str, Any] = {"description": bicycle.description, "source": bicycle.source}
    content["values"] = dict(bicycle.values)
    if bicycle.sd:
        content["sd"] = dict(bicycle.sd)
    return tomli_w.dumps(content)


def to_yaml(bicycle: Bicycle) -> str:
    """The numbers of ``bicycle`` as flat ``key: value`` YAML (the neighbouring projects' form), sds left out."""
    return "".join(f"{key}: {value!r}\n" for key, value in bicycle.values.items())


def _folder() -> Traversable:
    return data_root().joinpath("bicycles")


def _left_out(where: str, key: str, number: float, values: Mapping[str, float]) -> str:
    """What to tell of a key that is not used; nothing where the symmetry of bicycle and wheels gives its value."""
    if key == "v":
        return f"{where}: the speed v = {number:g} m/s is not a property of the bicycle and is not used"
    twin = LEFT_OUT[key]
    if number == values.get(twin, 0.0):
        return ""
    why = f"a wheel is symmetric about its axle, so {twin} is taken" if twin else "the bicycle is taken as symmetric"
    return f"{where}: {key} = {number:g} is not used: {why}"


def _named(
    path: Traversable,
    values: Mapping[str, Any],
    sd: Mapping[str, Any],
    extra: Mapping[str, Any],
    notes: tuple[str, ...] = (),
    *,
    allow_unusual: bool,
) -> Bicycle:
    try:
        return checked_bicycle(
            path.name.rsplit(".", 1)[0], values, sd, str(extra.get("description", "")), str(extra.get("source", "")),
            notes, where="bicycle file", allow_unusual=allow_unusual,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def checked_bicycle(name: str, values: Mapping[str, Any], *further: Any, where: str, allow_unusual: bool) -> Bicycle:
    """A bicycle whose numbers come from a file: in wrong units it is refused (``further`` as of :class:`Bicycle`).

    Parameters
    ----------
    name : str
    values : mapping
        Meijaard's keys; SI, lam in rad.
    *further : object
        The remaining fields of :class:`Bicycle`, in their order.
    where : str
        What the message calls the file that may allow unusual values.
    allow_unusual : bool
        Take values far outside what bicycles have.
    """
    doubts = doubts_about(values)
    if not allow_unusual:
        refuse_absurd(doubts, where=where)
    try:
        return Bicycle(name, values, *further)
    except InputError as error:  # a centre of mass in cm is a wheel without load: name the cause too
        causes = [one.text for one in doubts if one.explained and one.text.split(" = ")[0] + " = " not in str(error)]
        raise InputError("; ".join([str(error), *causes[:1]])) from error
