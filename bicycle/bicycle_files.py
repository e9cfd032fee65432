"""Bicycles as files: TOML, JSON, flat text, MATLAB or YAML as neighbouring projects write them, and tables of many."""

import json
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import numpy as np

from bicycle import parameters
from bicycle.parameter_covariance import ParameterCovariance, read_covariance
from bicycle.parameters import ALIASES, HEAD_ANGLE, KINDS, UNITS, UNUSED, Bicycle
from bicycle.rider_body import RigidBody, as_rear_frame, join, rear_frame
from tyre import schema
from tyre.arrays import Array
from tyre.errors import InputError, is_number, nearest, refuse_unknown, shown, unknown
from tyre.files import data_root, read_toml, refuse_deep
from tyre.measured_number import MeasuredNumber, key_value_lines, measured_number, written
from tyre.plausible import WAY_OUT
from tyre.sheet import ENDINGS, Sheet, read_sheet, split_unit
from tyre.units import factor_to_si, is_unit

LEFT_OUT = {"v": "", "yB": "", "yH": "", "IRzz": "IRxx", "IFzz": "IFxx"}  # key -> the key whose value it must have
KEYS = (*UNITS, *UNUSED)
WORDS = ("description", "source", "kind")
GROUPS = {"length": "m", "angle": "rad", "mass": "kg", "inertia": "kg m^2"}
"""Names under which a file states the unit of all parameters of one sort."""

NOT_USED = {
    "v": "{where}: the speed v = {number:g} m/s is not a property of the bicycle and is not used",
    "yB": "{where}: {key} = {number:g} is not used: the bicycle is taken as symmetric",
    "IRzz": "{where}: {key} = {number:g} is not used: a wheel is symmetric about its axle, so {twin} is taken",
}
NOT_USED |= {"yH": NOT_USED["yB"], "IFzz": NOT_USED["IRzz"]}
PI = re.compile(r"(?P<sign>-?)(?:(?P<times>[\d.]+)\s*\*?\s*)?pi(?:\s*/\s*(?P<over>[\d.]+))?")
PENDULUM = re.compile(r"T[ct][A-Z]\w*\d")  # period of a compound or torsional pendulum, named as BicycleParameters does

BODY = schema.table(
    {
        schema.needed("mass"): schema.number(above=0, most=300, says="must be a mass in kg, up to 300"),
        schema.needed("place"): schema.list_of(
            schema.number(), "must be [m before the rear contact, m above the ground]", least=2, most=2
        ),
        schema.maybe("size", [0.0, 0.0, 0.0]): schema.list_of(
            schema.number(least=0), "must be [length, width, height] in m", least=3, most=3
        ),
        schema.maybe("name", ""): schema.text(),
        schema.maybe("on", "frame"): schema.text("must be 'frame' or 'front'", allowed=("frame", "front")),
    }
)
BODIES = schema.list_of(BODY, "must be tables: write [[bodies]] with mass, place and size", strict=False)
"""Luggage, a child seat, a battery: boxes that are fixed to the rear frame, or turn with the front one."""


def si_unit(key: str) -> str:
    """The SI unit of a ``key`` of a bicycle file, also of one that is left out."""
    return "m/s" if key == "v" else "m" if key in ("yB", "yH") else UNITS.get(key, "kg m^2")


@dataclass
class GivenNumbers:
    """Content of a file: numbers, one :meth:`add` each, in its order, and the words beside them."""

    # unit of what is written without one, by key or by a name of :data:`GROUPS`; else SI
    units: Mapping[str, str] = field(default_factory=dict)
    values: dict[str, Any] = field(default_factory=dict)  # SI, lam in rad
    sd: dict[str, Any] = field(default_factory=dict)  # SI, lam in rad
    notes: list[str] = field(default_factory=list)  # what is not used
    words: dict[str, str] = field(default_factory=dict)  # of :data:`WORDS`
    allow_unusual: bool = False  # the file lets values pass that are far from those of other bicycles
    covariance: ParameterCovariance = field(default_factory=ParameterCovariance)
    bodies: list[Mapping[str, Any]] = field(default_factory=list)  # as :data:`BODIES` has them
    _left_out: dict[str, tuple[str, float]] = field(default_factory=dict)
    _others: list[str] = field(default_factory=list)  # keys that are not those of a bicycle

    def __post_init__(self) -> None:
        refuse_unknown("key of units:", self.units, [*KEYS, *GROUPS])
        for key, unit in self.units.items():
            if not isinstance(unit, str):
                raise InputError(f'units: {key} = {shown(unit)} must be a unit in quotes, such as "mm"')
            factor_to_si(unit, GROUPS.get(key) or si_unit(key), where=f"units: {key}")

    def add(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add the value of a parameter."""
        if key == HEAD_ANGLE:
            angle = self._number("lam", value, where, unit or "deg")
            self.sd |= {} if angle.sd is None else {"lam": angle.sd}
            key, value, unit = "lam", math.pi / 2 - angle.value, "rad"
        key = ALIASES.get(key, key)
        if key in self.values or key in self._left_out or key in self._others:
            raise InputError(f"{where}: {key} is given twice; keep one")
        if key not in KEYS and key not in LEFT_OUT:
            self._others.append(key)
            return
        number = self._number(key, value, where, unit)
        if key in LEFT_OUT:
            self._left_out[key] = (where, number.value)
            return
        self.values[key] = number.value
        if number.sd is not None:
            self.sd[key] = number.sd

    def add_sd(self, key: str, value: Any, *, where: str, unit: str = "") -> None:
        """Add a standard deviation that stands by itself."""
        key, unit = ("lam", unit or "deg") if key == HEAD_ANGLE else (ALIASES.get(key, key), unit)
        if key in self.sd:
            raise InputError(f"{where}: the standard deviation of {key} is given twice; keep one")
        if key in LEFT_OUT or key in self._others:
            return
        refuse_unknown("key", [key], KEYS, where=f"{where}: standard deviation")
        number = self._number(key, value, where, unit)
        if number.sd is not None:
            raise InputError(
                f"{where}: the standard deviation of {key} = {value!r} has one of its own; give one number"
            )
        self.sd[key] = number.value

    def add_word(self, key: str, value: Any, *, where: str) -> None:
        """Add a text of :data:`WORDS`, or the flag that lets unusual values pass."""
        text = str(value) if key in ("description", "source") else str(value).strip()
        if key == "kind":
            refuse_unknown("kind of vehicle", [text], KINDS, where=where)
        if key != WAY_OUT:
            self.words[key] = text
        elif text.lower() not in ("true", "false"):
            raise InputError(f"{where}: {WAY_OUT} = {shown(value)} must be true or false")
        else:
            self.allow_unusual = text.lower() == "true"

    def bicycle(self, name: str, kind: str, *, place: str = "", allow_unusual: bool = False) -> Bicycle:
        """The bicycle of a ``kind`` of file; ``place`` begins an error."""
        allow, notes = allow_unusual or self.allow_unusual, list(self.notes)
        vehicle = self.words.get("kind", "bicycle")
        for key, (where, number) in self._left_out.items():
            twin = LEFT_OUT[key]
            if key == "v" or number != self.values.get(twin, 0.0):  # else symmetry gives its value
                notes.append(NOT_USED[key].format(where=where, key=key, number=number, twin=twin))
        begin = f"{place}: " if place else ""
        if self._others:
            notes.append(f"{begin}not used, as the lateral motion does not hold them: {', '.join(self._others)}")
        try:
            self._refuse_incomplete()
            if not allow:
                way = f"write {WAY_OUT} = true at the top of the {kind}"
                parameters.refuse_unlikely(self.values, self.sd, way, vehicle)
            for wheel in "RF":  # a skate: without mass and spin the size of a wheel has no effect
                parts = (f"r{wheel}", f"m{wheel}", f"I{wheel}xx", f"I{wheel}yy")
                if not any(self.values.get(key, 1.0) for key in parts):
                    notes.append(f"{begin}r{wheel} = 0 m: a wheel that is nothing; 0.3 m is taken, of no effect")
                    self.values[f"r{wheel}"] = 0.3
            if self.bodies and set(UNITS) <= set(self.values):
                self._load()
            return Bicycle(
                name, self.values, self.sd, notes=tuple(notes), covariance=self.covariance, unusual=allow, **self.words
            )
        except InputError as error:
            # a centre of mass in cm is a wheel without load, so an error names the unusual number too
            doubts = [one for one in parameters.doubts_about(self.values, vehicle) if one.explained]
            causes = [one.text for one in doubts if f"{one.key} = " not in str(error)]
            remedy = [parameters.NAME_THE_UNIT] if doubts and parameters.NAME_THE_UNIT not in str(error) else []
            raise InputError(begin + "; ".join([str(error), *causes[:1], *remedy])) from error

    def _refuse_incomplete(self) -> None:
        """Refuse a file without all parameters, with the keys it has in their place, or named for what it is."""
        missing = [key for key in UNITS if key not in self.values]
        periods = [key for key in self._others if PENDULUM.fullmatch(key)]
        if missing and periods:
            raise InputError(
                f"holds raw measurements (periods of pendulums {', '.join(periods[:3])}, ...), not the parameters that "
                f"follow from them ({', '.join(missing[:3])}, ...); give the file that BicycleParameters computes of it"
            )
        near = {other: nearest(other, missing, cutoff=0.75) for other in self._others}
        hints = [f"did you mean {key!r} by {other!r}?" for other, key in near.items() if key]
        if missing and self._others:
            raise InputError("; ".join([
                f"missing {', '.join(missing)}", *hints, f"not known: {', '.join(self._others)}",
                f"give every parameter ({', '.join(UNITS)})",
            ]))  # fmt: skip

    def _load(self) -> None:
        """Join the bodies to the frames: values, and their standard deviations to first order."""
        carried: dict[str, list[RigidBody]] = {"B": [], "H": []}
        for one in self.bodies:
            (x, height), (length, width, tall) = one["place"], one["size"]
            squares = np.array([width**2 + tall**2, length**2 + tall**2, length**2 + width**2])
            box = RigidBody(one["mass"], np.array([x, 0.0, -height]), np.diag(one["mass"] / 12 * squares))
            carried["H" if one["on"] == "front" else "B"].append(box)

        def loaded(values: Mapping[str, float]) -> dict[str, float]:
            found = dict(values)
            for part, boxes in carried.items():
                found |= as_rear_frame(join([rear_frame(values, part), *boxes]), part) if boxes else {}
            return found

        def slopes(names: Sequence[str]) -> Array:
            columns = []
            for name in names:
                more, less = (loaded({**self.values, name: self.values[name] + step}) for step in (1e-4, -1e-4))
                columns.append([(more[key] - less[key]) / 2e-4 for key in names])
            return np.array(columns).T

        own = {key: sd for key, sd in self.sd.items() if key in UNITS}
        if own:
            variances = slopes(list(own)) ** 2 @ np.array(list(own.values())) ** 2
            self.sd |= dict(zip(own, np.sqrt(variances).tolist(), strict=True))
        if self.covariance.names:
            j = slopes(self.covariance.names)
            self.covariance = replace(self.covariance, matrix=j @ self.covariance.matrix @ j.T)
        self.values = loaded(self.values)

    def _number(self, key: str, value: Any, where: str, unit: str) -> MeasuredNumber:
        si = si_unit(key)
        unit = unit or self.units.get(key) or next((u for n, u in self.units.items() if GROUPS.get(n) == si), si)
        if isinstance(value, str):
            match = PI.fullmatch(value.strip())
            if match is None:
                return measured_number(value, where=where, key=key, si=si, unit=unit)
            sign, times, over = match.group("sign", "times", "over")
            try:
                value = float(f"{sign}1") * float(times or 1) * math.pi / float(over or 1)
            except (ValueError, ZeroDivisionError):
                raise InputError(f"{where}: {key} = {value!r} is not a number; write for example pi/10") from None
        if unit == si or not is_number(value) or value - value != 0:
            return MeasuredNumber(value)  # the bicycle itself refuses what is no finite number
        return MeasuredNumber(float(Fraction(float(value)) * factor_to_si(unit, si, where=where)))


def read_flat_text(path: Path | Traversable) -> GivenNumbers:
    """Read ``key = value+/-sd`` lines with the comments ``# description: ...`` and ``# source: ...``.

    A ``.m`` file of MATLAB assigns the fields of a struct: ``P.w = 1.02; % m``.
    """
    found = GivenNumbers()
    for where, key, text in key_value_lines(path):
        key = re.sub(r"^[A-Za-z]\w*\.(?=[A-Za-z]\w*$)", "", key)
        if key == WAY_OUT:
            found.add_word(key, text, where=where)
        else:
            found.add(key, text.rstrip("; "), where=where)
    for line in path.read_bytes().decode("utf-8-sig", errors="replace").split("\n"):
        mark, _, text = line.strip().partition(":")
        word = mark.lstrip("#%").strip()
        text = _unquoted(text.strip())
        comment = word == "kind" and text not in KINDS
        if mark[:1] in ("#", "%") and word in WORDS and word not in found.words and not comment:
            found.words[word] = text
    return found


def read_mapping(path: Path | Traversable) -> GivenNumbers:
    """Read TOML, JSON or YAML: parameters below ``values``, with ``sd`` and ``units`` beside, or at the top."""
    ending = path.name.lower().rpartition(".")[2]
    if ending in ("yml", "yaml"):
        top = _yaml(path)
    else:
        content = read_toml(path, "bicycle file") if ending == "toml" else _json(path)
        _refuse_model_file(content, path)
        top = _placed(content, str(path))
    tables = {name: top.pop(name) for name in ("values", "sd", "units", "covariance") if name in top}
    for name, (_, value) in tables.items():
        if not isinstance(value, Mapping):
            raise InputError(f"{path}: {name} = {shown(value)} must be a table: write [{name}] and the keys below it")
    bodies = schema.read(BODIES, top.pop("bodies", ("", []))[1], where=str(path), section="bodies")
    words = [key for key in (*WORDS, WAY_OUT) if key in top]
    parameterization = top.get("parameterization", ("", "benchmark"))
    if str(parameterization[1]).strip().lower() not in ("benchmark", "meijaard2007"):
        raise InputError(
            f"{parameterization[0]}: parameterization = {parameterization[1]!r} is another set of parameters than the "
            f"one used here ({', '.join(KEYS)}); write the bicycle out in these (benchmark, meijaard2007)"
        )
    try:
        found = GivenNumbers({key: text for key, (_, text) in tables.get("units", ("", {}))[1].items()})
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
    found.bodies = bodies
    for key in words:
        found.add_word(key, top[key][1], where=top.pop(key)[0])
    for key, (where, value) in (tables["values"][1] if "values" in tables else top).items():
        if isinstance(value, Mapping | list):
            raise InputError(f"{where}: expected one 'key: value' a line, found a nested value {key}")
        found.add(key, value, where=where)
    if "values" in tables:
        top.pop("parameterization", None)
        for key, (where, value) in top.items():
            text = "{...}" if isinstance(value, Mapping) else shown(value)
            found.notes.append(f"{where}: {key} = {text} is not used")
    for key, (where, value) in tables.get("sd", ("", {}))[1].items():
        found.add_sd(key, value, where=where)
    if "covariance" in tables:
        plain = {key: value for key, (_, value) in tables["covariance"][1].items()}
        found.covariance = read_covariance(plain, found.values, where=f"{path}: [covariance]")
        for key in set(found.covariance.names) & set(found.sd):
            raise InputError(f"{path}: [covariance]: {key} has an sd in [sd] already; keep one of them")
    return found


def _placed(content: Mapping[str, Any], where: str) -> dict[str, tuple[str, Any]]:
    """Key -> place and value, of tables likewise."""
    return {
        key: (where, _placed(value, f"{where}: [{key}]") if isinstance(value, Mapping) else value)
        for key, value in content.items()
    }


def _json(path: Path | Traversable) -> Mapping[str, Any]:
    try:
        content = json.loads(path.read_bytes().decode("utf-8-sig", errors="replace"))
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: not a JSON file: {error}") from error
    if not isinstance(refuse_deep(content, str(path)), Mapping):
        raise InputError(f'{path}: expected an object such as {{"w": 1.02, ...}}')
    return content


def _refuse_model_file(given: Mapping[str, Any], path: Path | Traversable) -> None:
    if "bicycle" not in given or "values" in given:
        return
    what = "its table [bicycle]" if isinstance(given["bicycle"], Mapping) else f"bicycle = {given['bicycle']!r}"
    added = given.get("effects") or {}
    torque = " (a measurement file without residual_torque)" if "residual_torque" in added else ""
    effects = f" and its [effects.NAME]{torque}" if added else ""
    raise InputError(
        f"{path}: is a model file, not a bicycle file; write {what}{effects} into the file that names it, in place "
        "of the name"
    )


def _yaml(path: Path | Traversable) -> dict[str, tuple[str, Any]]:
    """Key -> place and text of a YAML file, of tables likewise; numbers stay text, as they may be written 1.02(3)."""
    import yaml

    try:
        node = yaml.compose(path.read_bytes().decode("utf-8-sig", errors="replace"), Loader=yaml.SafeLoader)
    except yaml.YAMLError as error:
        raise InputError(f"{path}: not a YAML file: {' '.join(str(error).split())}") from error
    if not isinstance(node, yaml.MappingNode):
        raise InputError(f"{path}: expected one 'key: value' a line, for example 'w: 1.02'")

    def entries(node: Any) -> dict[str, tuple[str, Any]]:
        found: dict[str, tuple[str, Any]] = {}
        for key_node, value in node.value:
            where, key = f"{path}, line {key_node.start_mark.line + 1}", key_node.value
            if not isinstance(key_node, yaml.ScalarNode) or isinstance(value, yaml.SequenceNode):
                raise InputError(f"{where}: expected one 'key: value' a line, found a nested value")
            if key in found:
                raise InputError(f"{where}: {key} is given twice; keep one")
            found[key] = (where, entries(value) if isinstance(value, yaml.MappingNode) else value.value)
        return found

    return entries(node)


def _unquoted(text: str) -> str:
    try:
        return str(json.loads(text)) if text.startswith('"') else text
    except ValueError:
        return text


ROW = "#"  # bicycles.csv#NAME is one of the bicycles
SD = "_sd"


def is_bicycle_table(text: str) -> bool:
    """True if ``text`` names a table of bicycles, or one of its rows."""
    return any(Path(name).suffix.lower() in ENDINGS for name in (text, text.rpartition(ROW)[0]))


def split_row(text: str) -> tuple[Path, str]:
    """The file of a table and the name of the row, empty where none is named (``FILE#NAME``)."""
    file, mark, name = text.rpartition(ROW)
    if mark and Path(file).suffix.lower() in ENDINGS and not Path(text).is_file():
        return Path(file), name
    return Path(text), ""


def read_bicycles(path: Path, *, allow_unusual: bool = False) -> list[Bicycle]:
    """Read all bicycles of a table, in its order."""
    sheet = read_sheet(path, kind="bicycles")
    columns = [_column(name, sheet) for name in sheet.header]
    keys = [key for key, _ in columns]
    if twice := [key for key in keys if keys.count(key) > 1]:
        raise InputError(f"{path}: two columns are of {twice[0]}; keep one")
    missing = [key for key in ("name", *UNITS) if key not in keys]
    if missing:
        raise InputError(f"{path}: the column {', '.join(missing)} is missing; a row needs a name and every parameter")
    found: dict[str, Bicycle] = {}
    for place, cells in sheet.rows:
        row = dict(zip(keys, zip(cells, (unit for _, unit in columns), sheet.header, strict=True), strict=True))
        one = _row_bicycle(f"{path}, {place}", row, allow_unusual=allow_unusual)
        if one.name in found:
            raise InputError(f"{path}, {place}, column 'name': {one.name!r} is there already; give each its own name")
        found[one.name] = one
    return list(found.values())


def _column(name: str, sheet: Sheet) -> tuple[str, str]:
    """The key of a column, with ``_sd`` for a standard deviation, and its unit (empty: SI)."""
    words, known = ("name", *WORDS, WAY_OUT), (*KEYS, *LEFT_OUT)
    allowed = {*words, *known, *(key + SD for key in known)}
    base, unit = split_unit(name)
    for alias in [alias for alias in ALIASES if base == alias or base.startswith(f"{alias}_")]:
        base = ALIASES[alias] + base.removeprefix(alias)
    if base not in allowed and not unit:
        start, _, end = base.partition("_")
        with_sd = end == "sd" or end.startswith("sd_")
        key, rest = (start + SD, end[3:]) if with_sd else (start, end)
        base, unit = (key, rest) if key in allowed and is_unit(rest) else (base, unit)
    if base not in allowed:
        raise InputError(f"{sheet.path}: {unknown('column', name, [*words, *KEYS])}; KEY_sd is a standard deviation")
    if unit and base in words:
        raise InputError(f"{sheet.path}: the column {name!r} has no unit")
    if unit:
        factor_to_si(unit, si_unit(base.removesuffix(SD)), where=f"{sheet.path}, column {name!r}")
    return base, unit


def _row_bicycle(place: str, row: dict[str, tuple[Any, str, str]], *, allow_unusual: bool) -> Bicycle:
    words = {key: str(row.pop(key)[0]) for key in ("name", *WORDS, WAY_OUT) if key in row}
    name, flag = words.pop("name"), words.pop(WAY_OUT, "")
    if not name or ROW in name:
        raise InputError(f"{place}, column 'name': {name!r} must be a name without {ROW!r}")
    numbers = GivenNumbers(words=words)
    if flag:
        numbers.add_word(WAY_OUT, flag, where=place)
    for key, (cell, unit, column) in sorted(row.items(), key=lambda item: item[0].endswith(SD)):
        where, of = f"{place} ({name}), column {column!r}", key.removesuffix(SD)
        if cell == "" and key in UNITS:
            raise InputError(f"{where}: the cell is empty; every bicycle needs {key} ({si_unit(key)})")
        if cell == "":
            continue
        if key.endswith(SD):
            numbers.add_sd(of, cell, where=where, unit=unit or row[of][1] if of in row else unit)
        else:
            numbers.add(key, cell, where=where, unit=unit)
    return numbers.bicycle(name, "table (a column of its own)", place=f"{place} ({name})", allow_unusual=allow_unusual)


def available_bicycles() -> tuple[str, ...]:
    """Names of the packaged bicycles, sorted."""
    folder = data_root().joinpath("bicycles")
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def load_bicycle(name_or_path: str | Path, *, allow_unusual: bool = False) -> Bicycle:
    """A packaged bicycle by name, one of a file, or one of a table of bicycles (``bicycles.csv#NAME``).

    A TOML file has ``description``, ``source``, a table ``[values]`` with Meijaard's keys (SI, lam in rad) and
    optionally ``[sd]`` and ``[units]``. A YAML or text file is flat, one ``key: value`` a line. Values may be text such
    as ``0.375 +/- 0.026``, ``0.375(26)`` or ``18.3 deg`` (:mod:`tyre.measured_number`).
    Values far outside what bicycles have are refused unless ``allow_unusual``, here or in the file, is true.

    Parameters
    ----------
    name_or_path : str or Path
    allow_unusual : bool, optional

    Raises
    ------
    InputError
        No such bicycle or file, unreadable text, or a parameter set that is not a bicycle.
    """
    path, text = Path(name_or_path), str(name_or_path)
    if is_bicycle_table(text):
        return _one_of_table(text, allow_unusual=allow_unusual)
    if path.suffix.lower() in READERS:
        if not path.is_file():
            raise InputError(f"{path}: no such bicycle file; packaged bicycles: {', '.join(available_bicycles())}")
        return _one_of_file(path, allow_unusual=allow_unusual)
    if text not in available_bicycles():
        endings = ", ".join([*READERS, *ENDINGS])
        raise InputError(f"{unknown('bicycle', name_or_path, available_bicycles())}; or give a file ({endings})")
    return _one_of_file(data_root().joinpath("bicycles", f"{text}.toml"))


def _one_of_file(path: Path | Traversable, *, allow_unusual: bool = False) -> Bicycle:
    stem, _, ending = path.name.rpartition(".")
    found = READERS[f".{ending.lower()}"](path)
    if found.sd and not any(found.sd.values()):  # their way to say that it is not known
        found.notes.append(
            f"{path}: every standard deviation is 0, so its values count as exact; take +/-0 out where it is not known"
        )
    return found.bicycle(stem, "bicycle file", place=str(path), allow_unusual=allow_unusual)


def _one_of_table(text: str, *, allow_unusual: bool) -> Bicycle:
    """The bicycle ``FILE#NAME``, or the only one of ``FILE``."""
    path, name = split_row(text)
    found = {one.name: one for one in read_bicycles(path, allow_unusual=allow_unusual)}
    if not name and len(found) > 1:
        raise InputError(
            f"{path}: the table has {len(found)} bicycles ({', '.join(list(found)[:4])}{', ...' * (len(found) > 4)}); "
            f"name one of them: {path.name}{ROW}{next(iter(found))}"
        )
    if name and name not in found:
        raise InputError(f"{path}: {unknown('bicycle', name, found)}")
    return found[name] if name else next(iter(found.values()))


def bicycle_place(text: str, folder: Path) -> str:
    """Argument of :func:`load_bicycle` for a bicycle named in a file: its own file may be relative to ``folder``."""
    path, row = split_row(text)
    if not (folder / path).is_file():
        return text
    return (folder / path).resolve().as_posix() + (f"{ROW}{row}" if row else "")


def given_numbers(
    values: Mapping[str, Any], sd: Mapping[str, Any] | None = None, units: Mapping[str, Any] | None = None, *,
    place: str = "[values]",
) -> GivenNumbers:  # fmt: skip
    """Numbers of the tables of a TOML file, each a number or text such as ``"18.3(2) deg"``."""
    numbers = GivenNumbers(units or {})
    for key, value in values.items():
        (numbers.add_word if key in WORDS else numbers.add)(key, value, where=place)
    for key, value in (sd or {}).items():
        numbers.add_sd(key, value, where="[sd]")
    return numbers


def _words(bicycle: Bicycle) -> dict[str, str]:
    return {key: text for key in WORDS if (text := getattr(bicycle, key)) and (key, text) != ("kind", "bicycle")}


def to_toml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """Text of a TOML file of ``bicycle`` that :func:`load_bicycle` reads back exactly."""
    import tomli_w

    content: dict[str, Any] = {WAY_OUT: True} if allow_unusual else {}
    content |= {"description": "", "source": ""} | _words(bicycle) | {"values": dict(bicycle.values)}
    names, spread = bicycle.covariance.names, bicycle.covariance.matrix
    sd = {key: value for key, value in bicycle.sd.items() if key not in names}
    content |= {"sd": sd} if sd else {}
    content |= {"covariance": {"parameters": list(names), "matrix": spread.tolist()}} if names else {}
    return tomli_w.dumps(content)


def to_yaml(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """Flat ``key: value`` YAML, the neighbouring projects' form: first the numbers, then words and ``sd``."""
    import yaml

    content: dict[str, Any] = dict(bicycle.values) | _words(bicycle) | ({WAY_OUT: True} if allow_unusual else {})
    content |= {"sd": dict(bicycle.sd)} if bicycle.sd else {}
    return str(yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=2**31 - 1))


def to_text(bicycle: Bicycle, *, allow_unusual: bool = False) -> str:
    """``key = value+/-sd`` lines, the neighbouring projects' form, with the words in comments."""
    lines = []
    for key, text in _words(bicycle).items():
        plain = text.isprintable() and text == text.strip() and not text.startswith('"')
        lines += [f"# {key}: {text if plain else json.dumps(text)}\n"]
    lines += [f"{WAY_OUT} = true\n"] if allow_unusual else []
    return "".join([*lines, *(f"{key} = {written(x, bicycle.sd.get(key))}\n" for key, x in bicycle.values.items())])


READERS: Mapping[str, Callable[[Any], GivenNumbers]] = (
    dict.fromkeys((".toml", ".json", ".yml", ".yaml"), read_mapping) | dict.fromkeys((".txt", ".m"), read_flat_text)
)  # fmt: skip
"""Reader of a bicycle by the ending of its file."""

WRITERS = {".toml": to_toml, ".yml": to_yaml, ".yaml": to_yaml, ".txt": to_text}
"""Writer of a bicycle by the ending of its file."""
