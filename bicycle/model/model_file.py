"""Model files: a bicycle, its effects, its measured tyres and its covariance."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from bicycle.effects.effect import Effect
from bicycle.effects.effect_registry import effect_class
from bicycle.files.bicycle_files import bicycle_place, load_bicycle
from bicycle.files.bicycle_numbers import given_numbers
from bicycle.model.default_sd import MODEL_FILE
from bicycle.model.effect_numbers import effect_covariance, plain_effects
from bicycle.model.model import Model
from bicycle.model.rider_in_model import with_rider_body
from bicycle.model.wheel_tyres import mounted_tyres, tyre_notes, unused_offers, with_tyre_values
from bicycle.parameters.bicycle import UNUSED, Bicycle, doubts_about, of_kind
from bicycle.parameters.parameter_covariance import ParameterCovariance, ParameterKey, read_covariance
from tyre.ground import schema
from tyre.ground.errors import InputError, is_number
from tyre.ground.files import data_root, read_toml
from tyre.ground.schema import any_table, anything, flag, refusal
from tyre.measured.plausible import WAY_OUT, refuse_absurd

SECTION = "covariance"


def stated_covariance(model: Model, content: Mapping[str, Any]) -> ParameterCovariance:
    """The covariance that a model file states."""
    where, names = f"[{SECTION}]", [key for key in model.parameters if key not in UNUSED]
    covariance = read_covariance(content, names, where=where, origin=MODEL_FILE)
    for name in covariance.names:
        if name in model.tied:
            raise InputError(f"{where}: {name} equals {model.tied[name]} of the bicycle and follows it; remove it")
        if name in model.bicycle.sd:
            raise InputError(f"{where}: the bicycle states an sd of {name} already; keep one of them")
        if name in model.covariance.of_file:
            raise InputError(f"{where}: [effects] state an sd of {name} already; keep one of them")
        if name in model.sd:
            raise InputError(f"{where}: the measured tyre states an sd of {name} already; give its numbers instead")
    return covariance


def _check_bicycle_key(value: Any) -> Any:
    if not isinstance(value, str | Mapping):
        raise refusal(value, "must be a name, a file or a table of parameters")
    return value


MODEL = schema.table(
    {
        schema.needed(
            "bicycle", "the key 'bicycle' is missing: give a packaged bicycle, a file, or a table of parameters"
        ): (_check_bicycle_key),
        schema.maybe("effects", {}): schema.tables_by_name,
        schema.maybe("description", ""): anything,
        schema.maybe(WAY_OUT, False): flag,
        schema.maybe(SECTION): any_table,
    }
)


def available_models() -> tuple[str, ...]:
    """Names of the packaged models, which others published, sorted."""
    folder = data_root().joinpath("models")
    return tuple(sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml")))


def model_content(path: str | Path) -> dict[str, Any]:
    """Content of a model file, or of a packaged model by its name."""
    packaged = str(path) in available_models() and not Path(path).is_file()
    file = data_root().joinpath("models", f"{path}.toml") if packaged else Path(path)
    return dict(read_toml(file, "model file"))


def read_model(path: str | Path) -> Model:
    """Read a model file, or a packaged model.

    Parameters
    ----------
    path : str or Path
        A TOML file, or a name of :func:`available_models`.

    Raises
    ------
    InputError
        No such file, not TOML, an unknown key, or an impossible bicycle, effect or combination.
    """
    content = model_content(path)
    try:
        return build_model(content, folder=Path(path).parent)
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
    model_tables = schema.read(MODEL, content)
    allow = model_tables[WAY_OUT]
    bicycle = _bicycle(model_tables["bicycle"], folder, allow_unusual=allow)
    tables, sd = plain_effects(model_tables["effects"])
    tyres = mounted_tyres(tables, folder, bicycle)
    effects: list[Effect] = []
    covariance = ParameterCovariance()
    assumed: list[str] = []
    for identifier, table in tables.items():
        kind = effect_class(identifier)
        seated = with_rider_body(kind, table, bicycle, folder)
        filled, law, without_sd = with_tyre_values(kind, seated, tyres, tables)
        covariance = covariance.and_also(law)
        assumed += without_sd
        effects.append(kind(**filled))
        if not allow:
            refuse_absurd(effects[-1].doubts(of_kind(bicycle.kind)[1]).values(), where="model file")
    notes = [] if tyres is None else [*tyre_notes(tyres.properties), *unused_offers(tyres, tables)]
    model = Model(bicycle, tuple(effects), tuple(notes), covariance.sd, tuple(assumed), covariance, unusual=allow)
    if sd:
        model = _with_stated(model, effect_covariance(sd, model.parameters, effects))
    if SECTION in model_tables:
        model = _with_stated(model, stated_covariance(model, model_tables[SECTION]))
    return model


def _with_stated(model: Model, stated: ParameterCovariance) -> Model:
    """The model with a covariance that its file states."""
    if not model.sd:  # no tyre states any: all that is stated is the file's
        return replace(model, sd=stated.sd, covariance=replace(stated, of_file=stated.names))
    return replace(model, sd={**model.sd, **stated.sd}, covariance=model.covariance.with_file(stated))


def allows_unusual(content: Mapping[str, Any]) -> bool:
    """True if the ``content`` of a model file lets values far outside their typical range pass."""
    return bool(schema.read(flag, content.get(WAY_OUT, False), section=WAY_OUT))


def refuse_absurd_values(model: Model, values: Mapping[str, Iterable[float]]) -> None:
    """Refuse values of a model's parameters far outside the typical range."""
    declared = {f"{e.identifier}.{p.name}": p for e in model.effects for p in e.parameters}
    for key, column in values.items():
        parameter = declared.get(str(ParameterKey.parse(key).whole))
        numbers = [number for number in column if is_number(number) and number]
        if not numbers:
            continue
        for number in sorted({min(numbers), max(numbers), min(numbers, key=abs)}):
            if parameter and not parameter.bounds[0] <= number <= parameter.bounds[1]:
                continue  # impossible: the effect says so in its own words
            kind = model.bicycle.kind
            doubts = (
                [parameter.doubt(key, number, of_kind(kind)[1])] if parameter else doubts_about({key: number}, kind)
            )
            refuse_absurd([doubt for doubt in doubts if doubt], where="model file")


def _bicycle(value: Any, folder: Path, *, allow_unusual: bool) -> Bicycle:
    if isinstance(value, Mapping):
        place = "bicycle of the model file"
        return given_numbers(value, place=place).bicycle(place, "model file", allow_unusual=allow_unusual)
    return load_bicycle(bicycle_place(value, folder), allow_unusual=allow_unusual)
