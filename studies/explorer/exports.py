"""What is taken away from the page: the model as TOML, eigenvalues as CSV, the same as command and as Python."""

import shlex
from collections.abc import Mapping
from pprint import pformat
from typing import Any

from bicycle.effect.registry import outside_origins
from studies.explorer.computed import POINTS, computed
from studies.explorer.flat_keys import written
from studies.explorer.models import model_content
from studies.explorer.state import State
from studies.explorer.tyre_files import TYRES, tyre_names
from studies.model_argument import LAWS
from tyre.base.files import slug

FILE = "model.toml"
END = "END_OF_MODEL"


def file_stem(state: State) -> str:
    """A name for files of a state, without ending.

    Parameters
    ----------
    state : State
    """
    given = state.content["bicycle"]
    return slug(given if isinstance(given, str) else state.name or "own")


def model_toml(state: State) -> str:
    """The model file of a state, its rider part of the bicycle.

    Parameters
    ----------
    state : State
    """
    import tomli_w

    needs = "".join(f"# {line}\n" for line in needed_files(state))
    return f"# made by velotyre explore, {state.alone().address}\n{needs}" + tomli_w.dumps(_content(state))


def needed_files(state: State) -> list[str]:
    """What must be said of tyre files that were loaded; empty where the model names none.

    Parameters
    ----------
    state : State
    """
    files = list(TYRES.content(tyre_names(state.content)))
    return [f"needs beside it, as they were loaded: {', '.join(files)}"] if files else []


def _content(state: State) -> dict[str, Any]:
    return TYRES.portable(model_content(state))


def eigenvalues_csv(state: State) -> str:
    """A row per speed, mode and root, as ``velotyre modes --csv`` writes it.

    Parameters
    ----------
    state : State
    """
    return str(computed(state).named.to_dataframe().to_csv(index=False, lineterminator="\n"))


def as_command(state: State) -> str:
    """A command that computes the same; where no options say the model, it is written to a file first.

    Parameters
    ----------
    state : State
    """
    content = _content(state)
    step = (state.fast - state.slow) / (POINTS - 1)
    speeds = f"{written(state.slow)}:{written(state.fast)}:{written(step)} --max-speed {written(state.fast)}"
    own = "".join(f" --effects {shlex.quote(str(origin.file))}" for origin in outside_origins() if origin.file)
    short = _options(content)
    if short is not None:
        needs = "".join(f"# {line}\n" for line in needed_files(state))
        return f"{needs}velotyre{own} modes {short} --speeds {speeds}"
    return f"cat > {FILE} <<'{END}'\n{model_toml(state)}{END}\nvelotyre{own} modes {FILE} --speeds {speeds}"


def as_python(state: State) -> str:
    """Lines of Python that compute the same.

    Parameters
    ----------
    state : State
    """
    own = [f"vt.load_effects({str(origin.file)!r})" for origin in outside_origins() if origin.file]
    return "\n".join(
        [
            "import numpy as np",
            "import velotyre as vt",
            "",
            *own,
            *(f"# {line}" for line in needed_files(state)),
            f"model = vt.build_model({pformat(_content(state), sort_dicts=False, width=100)})",
            f"found = vt.modes(model, np.linspace({state.slow!r}, {state.fast!r}, {POINTS}))",
            f"critical = vt.critical_speeds(model, max_speed={state.fast!r})",
            "print(found, *critical, sep='\\n')",
            "",
        ]
    )


def _options(content: Mapping[str, Any]) -> str | None:
    """MODEL and the options of its tyre, where they say the whole model."""
    bicycle, effects = content["bicycle"], dict(content.get("effects", {}))
    if not isinstance(bicycle, str) or set(content) - {"bicycle", "effects"}:
        return None
    if not effects or effects == {"no_slip": {}}:
        return bicycle
    table = dict(effects.pop(LAWS[0], {}))
    tyre, surface, bar = (table.pop(key, {}) for key in ("tyre", "surface", "pressure_bar"))
    extrapolate = table.pop("extrapolate", False)
    alike = all(len(set(one.values())) == 1 for one in (tyre, *([surface] if surface else [])))
    if effects or table or not tyre or not alike or set(bar) != {"rear", "front"}:
        return None
    pressure = f"{written(bar['rear'])},{written(bar['front'])}".removesuffix(f",{written(bar['rear'])}")
    where = f" --surface {shlex.quote(surface['rear'])}" if surface else ""
    return f"{bicycle} --tyre {shlex.quote(tyre['rear'])} --pressure {pressure}{where}" + " --extrapolate" * extrapolate
