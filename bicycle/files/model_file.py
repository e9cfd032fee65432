"""Model files: one TOML with a bicycle and a table per effect; values may come from its tyres, with a covariance."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bicycle.effect import Effect, effect_class
from bicycle.files.bicycle_file import bicycle_place, given_numbers, load_bicycle
from bicycle.files.checked_bicycle import checked_bicycle
from bicycle.files.stated_covariance import SECTION, stated_covariance
from bicycle.files.tyre_values import mounted_tyres, unused_offers, with_tyre_values
from bicycle.files.wheel_tyres import tyre_notes
from bicycle.model import Model
from bicycle.parameter_covariance import ParameterCovariance
from bicycle.parameter_key import ParameterKey
from bicycle.parameters import Bicycle, doubts_about
from tyre.base import schema
from tyre.base.checks import any_table, anything, flag, refused
from tyre.base.errors import InputError, is_number
from tyre.base.plausible import WAY_OUT, refuse_absurd
from tyre.base.toml_file import read_toml


def _bicycle_given(value: Any) -> Any:
    if not isinstance(value, str | Mapping):
        raise refused(value, "must be a name, a file or a table of parameters")
    return value


MODEL = schema.table(
    {
        schema.needed(
            "bicycle", "the key 'bicycle' is missing: give a packaged bicycle, a file, or a table of parameters"
        ): (_bicycle_given),
        schema.maybe("effects", {}): schema.tables_by_name,
        schema.maybe("description", ""): anything,
        schema.maybe(WAY_OUT, False): flag,
        schema.maybe(SECTION): any_table,
    }
)


def read_model(path: str | Path) -> Model:
    """Read a model file.

    Parameters
    ----------
    path : str or Path
        A TOML file.

    Raises
    ------
    InputError
        No such file, not TOML, an unknown key, or values that make no bicycle, effect or combination.
    """
    path = Path(path)
    content = read_toml(path, "model file")
    try:
        return build_model(content, folder=path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def build_model(content: Mapping[str, Any], *, folder: Path = Path()) -> Model:
    """Build a model from the content of a model file; files it names are relative to ``folder``.

    Values far outside their typical range are refused unless the content has ``allow_unusual = true``.

    Parameters
    ----------
    content : mapping
        As read from TOML: ``bicycle``, ``effects``, ``allow_unusual``, ``covariance``.
    folder : Path
        What file names are relative to.
    """
    given = schema.read(MODEL, content)
    allow = given[WAY_OUT]
    bicycle = _bicycle(given["bicycle"], folder, allow_unusual=allow)
    tables = given["effects"]
    tyres = mounted_tyres(tables, folder, bicycle)
    effects: list[Effect] = []
    covariance = ParameterCovariance()
    assumed: list[str] = []
    for identifier, table in tables.items():
        kind = effect_class(identifier)
        filled = with_tyre_values(kind, table, tyres, tables)
        covariance = covariance.and_also(filled.covariance)
        assumed += filled.assumed
        effects.append(kind(**filled.table))
        if not allow:
            refuse_absurd(effects[-1].doubts().values(), where="model file")
    notes = [] if tyres is None else [*tyre_notes(tyres.properties), *unused_offers(tyres, tables)]
    model = Model(bicycle, tuple(effects), tuple(notes), covariance.sd, tuple(assumed), covariance)
    if SECTION not in given:
        return model
    stated = stated_covariance(model, given[SECTION])
    return replace(model, sd=stated.sd, covariance=stated)


def allows_unusual(content: Mapping[str, Any]) -> bool:
    """Whether the ``content`` of a model file lets values far outside their typical range pass."""
    return bool(schema.read(flag, content.get(WAY_OUT, False), section=WAY_OUT))


def refuse_absurd_values(model: Model, values: Mapping[str, Iterable[float]]) -> None:
    """Refuse values of a model's parameters far outside the typical range.

    Parameters
    ----------
    model : Model
        Whose effects declare the ranges.
    values : mapping of str to iterable of float
        ``effect.name[.wheel]`` or key of the bicycle -> values, SI; other keys (speed, pressure, load) are left alone.

    Raises
    ------
    InputError
        The first such value.
    """
    declared = {f"{e.identifier}.{p.name}": p for e in model.effects for p in e.parameters}
    for key, given in values.items():
        parameter = declared.get(str(ParameterKey.parse(key).whole))
        numbers = [number for number in given if is_number(number) and number]
        for number in sorted({min(numbers), max(numbers), min(numbers, key=abs)}) if numbers else []:
            if parameter and not parameter.bounds[0] <= number <= parameter.bounds[1]:
                continue  # impossible: the effect says so in its own words
            doubts = [parameter.doubt(key, number)] if parameter else doubts_about({key: number})
            refuse_absurd([found for found in doubts if found], where="model file")


def _bicycle(given: Any, folder: Path, *, allow_unusual: bool) -> Bicycle:
    if isinstance(given, Mapping):
        numbers = given_numbers(given, place="bicycle of the model file")
        numbers.finish()
        return checked_bicycle(
            "bicycle of the model file",
            numbers.values,
            numbers.sd,
            "",
            "",
            tuple(numbers.notes),
            where="model file",
            allow_unusual=allow_unusual,
        )
    return load_bicycle(bicycle_place(given, folder), allow_unusual=allow_unusual)
