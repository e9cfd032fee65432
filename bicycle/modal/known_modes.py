"""Every mode that has a name: those of each model and those that the effects declare."""

from collections.abc import Iterable, Mapping

from bicycle.derivation.declarations import BASE_MODES, Mode
from bicycle.effect import Effect, packaged_effects, registry


def known_modes() -> Mapping[str, Mode]:
    """The modes of every model and of every effect (:func:`bicycle.effect.registry`), in the order of tables."""
    return _by_name(registry().values())


def packaged_modes() -> Mapping[str, Mode]:
    """Those of the package alone, in the order of tables."""
    return _by_name(packaged_effects().values())


def _by_name(effects: Iterable[type[Effect]]) -> Mapping[str, Mode]:
    every = {mode.name: mode for mode in (*BASE_MODES, *(mode for effect in effects for mode in effect.modes))}
    return dict(sorted(every.items(), key=lambda item: (item[1].place, item[0])))
