"""Read and write bicycles: packaged or own TOML files, and the flat ``key: value`` YAML of neighbouring projects."""

from collections.abc import Iterable, Mapping
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

from bicycle.files.bicycle_table import ROW, is_bicycle_table, one_of_table, split_row
from bicycle.files.checked_bicycle import checked_bicycle
from bicycle.files.flat_bicycle import plain_text, read_flat_text, read_flat_yaml, yaml_text
from bicycle.files.given_numbers import GivenNumbers
from bicycle.parameters import Bicycle
from tyre.base.errors import InputError, unknown
from tyre.base.paths import data_root
from tyre.base.plausible import WAY_OUT
from tyre.base.sheet import ENDINGS
from tyre.base.toml_file import read_toml


def available_bicycles() -> tuple[str, ...]:
    """Names of the packaged bicycles, sorted."""
    return tuple(sorted(f.name.removesuffix(".toml") for f in _folder().iterdir() if f.name.endswith(".toml")))


def load_bicycle(name_or_path: str | Path, *, allow_unusual: bool = False) -> Bicycle:
    """A packaged bicycle by name, one of a file, or one of a table of bicycles (``bicycles.csv#NAME``).

    A TOML file has ``description``, ``source``, a table ``[values]`` with Meijaard's keys (SI, lam in rad) and
    optionally ``[sd]`` and ``[units]``. A YAML or text file is flat, one ``key: value`` a line. Values may be text such
    as ``0.375 +/- 0.026``, ``0.375(26)`` or ``18.3 deg`` (:mod:`tyre.base.measured_number`).
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
    if is_bicycle_table(str(name_or_path)):
        return one_of_table(str(name_or_path), allow_unusual=allow_unusual)
    if path.suffix.lower() in WRITERS:
        if not path.is_file():
            raise InputError(f"{path}: no such bicycle file; packaged bicycles: {', '.join(available_bicycles())}")
        return (parse_toml if path.suffix.lower() == ".toml" else parse_flat)(path, allow_unusual=allow_unusual)
    if str(name_or_path) not in available_bicycles():
        endings = ", ".join([*WRITERS, *ENDINGS])
        raise InputError(f"{unknown('bicycle', name_or_path, available_bicycles())}; or give a file ({endings})")
    return parse_toml(_folder().joinpath(f"{name_or_path}.toml"))


def bicycle_place(text: str, folder: Path) -> str:
    """What :func:`load_bicycle` is given for a bicycle named in a file: its own file may be relative to ``folder``.

    Parameters
    ----------
    text : str
        Name, file, or ``FILE#NAME``.
    folder : Path
        Of the file that names it.
    """
    path, row = split_row(text)
    if not (folder / path).is_file():
        return text
    return (folder / path).resolve().as_posix() + (f"{ROW}{row}" if row else "")


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
        needed("values", missing): any_table, maybe("sd", {}): any_table, maybe("units", {}): any_table,
        maybe(WAY_OUT, False): flag,
    }  # fmt: skip
    given = read_toml(path, "bicycle file")
    if "bicycle" in given and "values" not in given:
        what = "its table [bicycle]" if isinstance(given["bicycle"], Mapping) else f"bicycle = {given['bicycle']!r}"
        added = given.get("effects") or {}
        torque = " (a measurement file without residual_torque)" if "residual_torque" in added else ""
        effects = f" and its [effects.NAME]{torque}" if added else ""
        raise InputError(
            f"{path}: is a model file, not a bicycle file; write {what}{effects} into the file that names it, in place "
            "of the name"
        )
    content = read(table(declared), given, where=str(path))
    try:
        numbers = given_numbers(content["values"], content["sd"], content["units"])
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    return _named(path, numbers, content, allow_unusual=allow_unusual or content[WAY_OUT])


def given_numbers(
    values: Mapping[str, Any], sd: Mapping[str, Any] | None = None, units: Mapping[str, Any] | None = None, *,
    place: str = "[values]",
) -> GivenNumbers:  # fmt: skip
    """Numbers of the tables of a TOML file, each a number or text such as ``"18.3(2) deg"``.

    Parameters
    ----------
    values, sd : mapping
        By key, in ``units``, else SI and lam in rad.
    units : mapping, optional
        By key, or by ``length``, ``angle``, ``mass``, ``inertia``.
    place : str
        Of the values in the file, for messages.
    """
    numbers = GivenNumbers(units or {})
    for key, value in values.items():
        numbers.add(key, value, where=place)
    for key, value in (sd or {}).items():
        numbers.add_sd(key, value, where="[sd]")
    return numbers


def parse_flat(path: Path, *, allow_unusual: bool = False) -> Bicycle:
    """Read a flat text or YAML file, as neighbouring projects write them.

    What they store beside the parameters is left out: a speed ``v``, as the warnings say, and what symmetry makes
    superfluous (``yB``, ``yH``, ``IRzz``, ``IFzz``), as they say where the values are not symmetric.

    Parameters
    ----------
    path : Path
        ``.yml``, ``.yaml`` or ``.txt``.
    allow_unusual : bool, optional
        Take values far outside what bicycles have.
    """
    found = (read_flat_text if path.suffix.lower() == ".txt" else read_flat_yaml)(path)
    sd = found.numbers.sd.values()
    if sd and not any(sd):  # their way to say that it is not known
        found.notes.append(
            f"{path}: every standard deviation is 0, so its values count as exact; take +/-0 out where it is not known"
        )
    allow = allow_unusual or found.allow_unusual
    return _named(path, found.numbers, found.words, found.notes, allow_unusual=allow)


def to_toml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """Text of a TOML file of ``bicycle`` that :func:`load_bicycle` reads back exactly.

    Parameters
    ----------
    bicycle : Bicycle
    allow_unusual : bool, optional
        The file is to say that its values are meant.
    """
    import tomli_w

    content: dict[str, Any] = {WAY_OUT: True} if allow_unusual else {}
    content |= {"description": bicycle.description, "source": bicycle.source}
    content["values"] = dict(bicycle.values)
    if bicycle.sd:
        content["sd"] = dict(bicycle.sd)
    return tomli_w.dumps(content)


def to_yaml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """The same as flat ``key: value`` YAML, the neighbouring projects' form, with ``sd`` and the words below.

    Parameters
    ----------
    bicycle : Bicycle
    allow_unusual : bool, optional
        The file is to say that its values are meant.
    """
    return yaml_text(bicycle.values, bicycle.sd, _words(bicycle, allow_unusual=allow_unusual))


def to_text(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """The same as ``key = value+/-sd`` lines, the neighbouring projects' form, with the words in comments.

    Parameters
    ----------
    bicycle : Bicycle
    allow_unusual : bool, optional
        The file is to say that its values are meant.
    """
    return plain_text(bicycle.values, bicycle.sd, _words(bicycle, allow_unusual=allow_unusual))


WRITERS = {".toml": to_toml, ".yml": to_yaml, ".yaml": to_yaml, ".txt": to_text}
"""How a bicycle is written, by the ending of its file."""


def _words(bicycle: Bicycle, *, allow_unusual: bool) -> dict[str, Any]:
    return {"description": bicycle.description, "source": bicycle.source, WAY_OUT: allow_unusual}


def _folder() -> Traversable:
    return data_root().joinpath("bicycles")


def _named(
    path: Traversable,
    numbers: GivenNumbers,
    words: Mapping[str, Any],
    notes: Iterable[str] = (),
    *,
    allow_unusual: bool,
) -> Bicycle:
    numbers.finish()
    try:
        return checked_bicycle(
            path.name.rsplit(".", 1)[0], numbers.values, numbers.sd, str(words.get("description", "")),
            str(words.get("source", "")), (*notes, *numbers.notes), where="bicycle file", allow_unusual=allow_unusual,
        )  # fmt: skip
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
