"""Read a measurement file: the data, the bicycle that was measured, and how well that bicycle is known.

kind = "modal"                      # or another one; "rig" and "tyre_tables" are of a tyre
bicycle = "kooijman2008"            # a name, a file, or a table of parameters
[effects.NAME]                      # effects of the base model, as in a model file
[uncertainty]                       # 1-sigma of bicycle and effect parameters, 0 fixes one
[candidates.NAME]                   # known parameters of a candidate: they are not fitted
[modal]                             # the table of the kind
table = "weave.csv"
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib.resources.abc import Traversable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from bicycle.effects.effect_registry import effect_class
from bicycle.model.model import Model
from bicycle.model.model_file import build_model, read_model
from bicycle.parameters.bicycle import Bicycle
from bicycle.stability.named_modes import modes
from studies.diagnosis import (
    bench,
    frequency_response,
    hands,
    histories,
    modal,
    ride_spectra,
    rig_recordings,
    standing,
    tyre_tables,
)
from studies.diagnosis.candidates import check_known, nuisances
from studies.diagnosis.modal import EIGENVALUE
from studies.diagnosis.modal_sd import SD
from studies.inference.kind import Kind
from studies.reporting.markdown_text import make_environment
from tyre.ground.errors import InputError, unknown
from tyre.ground.files import data_root, read_toml, refuse_without_ending
from tyre.ground.schema import Table, any_table, anything, by_name, list_of, maybe, needed, read, table, text
from tyre.measured.plausible import WAY_OUT

PARTS = "write [[part]] with name, kind and the table of that kind, two or more"

if TYPE_CHECKING:
    import pandas as pd

# import registers their kinds
KNOWN = (modal, histories, frequency_response, bench, ride_spectra, rig_recordings, standing, hands, tyre_tables)
MODEL_KEYS = ("bicycle", "effects", WAY_OUT)
MODEL = "model"


def kinds() -> tuple[str, ...]:
    """Kinds that a measurement file may have."""
    return tuple(sorted(Kind.top))


def top_keys(kind: type[Kind] | None) -> Table:
    """Keys of a file of this ``kind``; without one those of a bicycle."""
    words = text("must be words in quotes")
    names = ", ".join(map(repr, kinds()))
    allowed = f"is not allowed; write one of {names}"
    keys: dict[Any, Any] = {
        needed("kind", f"kind is missing; write kind = one of {names}"): text(allowed, allowed=Kind.top),
        maybe("description", ""): words,
        maybe("source", ""): words,
    }
    if kind is not None and not kind.of_bicycle:
        return table(keys | {maybe(kind.table): anything})
    keys |= dict.fromkeys(map(maybe, MODEL_KEYS), anything)
    keys[maybe(MODEL)] = text("must be a model file in quotes", blank=False)
    keys |= {maybe("uncertainty", {}): any_table, maybe("candidates", {}): any_table}
    keys |= dict.fromkeys(map(maybe, _tables()), any_table)
    keys[maybe("part")] = list_of(any_table, f"must be tables: {PARTS}", least=1)
    keys[maybe("common")] = list_of(text("must be an effect in quotes"), "must be a list of effects", least=1)
    return table(keys)


def _tables() -> dict[str, None]:
    """Tables that kinds of a bicycle are read from."""
    all_kinds = (*Kind.top.values(), *Kind.part.values())
    return dict.fromkeys(kind.table for kind in all_kinds if kind.of_bicycle and not kind.whole)


def read_measurement(path: str | Path) -> Kind:
    """Read the file at ``path`` and the tables it names; a packaged one is given by its name.

    Raises
    ------
    InputError
        Anything missing, unknown, out of range or not finite, with file, row or key and the remedy.
    """
    with packaged_measurement(path) as file:
        content = read_toml(file, "measurement file")
        try:
            return _read(content, file)
        except InputError as error:
            raise InputError(f"{file}: {error}") from error


def _read(content: Mapping[str, Any], path: Path) -> Kind:
    """Kind of measurement that the ``content`` of the file at ``path`` describes."""
    tables = read(top_keys(Kind.top.get(str(content.get("kind")))), content)
    kind = Kind.top[tables["kind"]]
    common: dict[str, Any] = {"name": path.stem, "description": tables["description"], "source": tables["source"]}
    if kind.of_bicycle:
        model = _base_model(tables, path.parent)
        stated_values = _check_candidates(tables["candidates"], model)
        common |= {"model": model, "uncertainty": flat_uncertainty(tables["uncertainty"]), "known": stated_values}
        nuisances(model, common["uncertainty"])  # complains here, where the file is known
    if kind.whole:
        return kind.read(tables, path.parent, common)
    if "part" in tables:
        raise InputError(f"kind is {kind.kind!r} but [[part]] belongs to kind = 'joint'")
    return read_kind(kind, tables, path.parent, common)


def _base_model(tables: Mapping[str, Any], folder: Path) -> Model:
    """Base model of a file: another file that holds it, or a bicycle with effects."""
    model_tables = {key: tables[key] for key in MODEL_KEYS if key in tables}
    if MODEL not in tables:
        return build_model(model_tables, folder=folder)
    if model_tables:
        raise InputError(f"{MODEL} and {', '.join(model_tables)} both give the base model; keep one")
    return read_model(folder / tables[MODEL])


def read_kind(kind: type[Kind], tables: Mapping[str, Any], folder: Path, common: Mapping[str, Any]) -> Kind:
    """A measurement of one kind from the table of that name, which must be the only one."""
    if kind.table not in tables:
        remedy = f"; {kind.missing}" if kind.missing else ""
        raise InputError(f"kind is {kind.kind!r} but the table [{kind.table}] is missing{remedy}")
    for foreign in _tables():
        if foreign in tables and foreign != kind.table:
            raise InputError(f"kind is {kind.kind!r} but the table [{foreign}] does not belong here")
    return kind.read(tables[kind.table], folder, common)


def flat_uncertainty(nested: Mapping[str, Any], prefix: str = "") -> dict[str, float]:
    """Dotted keys of a nested table ``[uncertainty]``."""
    flat: dict[str, float] = {}
    for key, value in nested.items():
        if isinstance(value, Mapping) and not value:
            raise InputError(
                f"[uncertainty.{prefix}{key}] is empty; write the 1-sigma of its parameters or take it out"
            )
        if isinstance(value, Mapping):
            flat |= flat_uncertainty(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = value
    return flat


def _check_candidates(candidates: Mapping[str, Any], model: Model) -> dict[str, Mapping[str, Any]]:
    """Refuse stated values of effects that cannot be candidates; the values by effect and parameter, SI."""
    present = [effect.identifier for effect in model.effects]
    for identifier, parameters in candidates.items():
        try:
            effect = effect_class(identifier)
        except InputError as error:
            raise InputError(f"[candidates.{identifier}]: {error}") from error
        if identifier in present:
            raise InputError(f"[candidates.{identifier}]: the base model contains it already; take one of them out")
        names = [p.name for p in effect.parameters]
        read(by_name(anything, names, kind="parameter"), parameters, section=f"candidates.{identifier}")
        check_known(effect, parameters)
    return dict(candidates)


# ---- packaged measurements ----


def available_measurements() -> tuple[str, ...]:
    """Names of the packaged measurements, sorted."""
    files = (data_root() / "measured").iterdir()
    return tuple(sorted(file.name.removesuffix(".toml") for file in files if file.name.endswith(".toml")))


@contextmanager
def packaged_measurement(name_or_path: str | Path) -> Iterator[Path]:
    """Give the file of a measurement for as long as it is read: ``name_or_path`` itself, or that of a packaged name."""
    path = Path(name_or_path)
    name = str(name_or_path)
    if path.suffix or path.is_file() or "/" in name:
        yield path
        return
    if name not in available_measurements():
        refuse_without_ending("measurement", name)
        raise InputError(
            f"{unknown('measurement', name, available_measurements())}; or give a measurement file (.toml)"
        )
    root = data_root()
    if isinstance(root, Path):
        yield root / "measured" / f"{name}.toml"
        return
    with TemporaryDirectory() as folder:  # a package inside a zip file: a measurement names its tables beside it
        _unpack(root, Path(folder))
        yield Path(folder) / "measured" / f"{name}.toml"


def _unpack(folder: Traversable, target: Path) -> None:
    """Copy a packaged ``folder`` and all below it to a ``target`` folder."""
    for item in folder.iterdir():
        if item.is_dir():
            (target / item.name).mkdir()
            _unpack(item, target / item.name)
        else:
            (target / item.name).write_bytes(item.read_bytes())


# ---- an example: velotyre new m.toml --kind measurement ----


def example_measurement(bicycle: Bicycle, *, file: str, table: str) -> "tuple[str, pd.DataFrame]":
    """Text of a measurement file, and its table: the weave of a ``bicycle`` that rolls without slip, with noise."""
    import pandas as pd

    speeds, count, noise = np.arange(2.0, 15.0, 0.5), 8, 0.02  # m/s; rows; share of |eigenvalue|
    roots = modes(Model(bicycle).linear_model(), speeds).branches.get("weave", np.full((len(speeds), 1), np.nan))[:, 0]
    measurable = (roots.imag > 0) & (roots.real < 0.5) & (-roots.real < 0.5 * np.abs(roots))  # 1/s; damping ratio
    places = np.flatnonzero(measurable)
    if len(places) < count:
        raise InputError(
            f"--bicycle {bicycle.name}: its weave can be measured at {len(places)} of {len(speeds)} speeds from "
            f"{speeds[0]:g} to {speeds[-1]:g} m/s only, too few for an example; take another bicycle"
        )
    rng = np.random.default_rng(3)
    rows = []
    for k in places[np.linspace(0, len(places) - 1, count).round().astype(int)]:
        sd = noise * abs(roots[k])
        real, imag = roots[k].real + sd * rng.standard_normal(), roots[k].imag + sd * rng.standard_normal()
        rows.append([speeds[k], "weave", *(round(x, 4) for x in (real, imag, sd, sd))])
    words = {"file": file, "bicycle": bicycle.name, "table": table, "percent": f"{100 * noise:g}"}
    templates = make_environment("studies.diagnosis", escaped=False, keep_trailing_newline=True)
    text = templates.get_template("example.toml.j2").render(**words)
    return text, pd.DataFrame(rows, columns=["speed_m_s", "mode", *EIGENVALUE, *SD])
