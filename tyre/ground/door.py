"""Names of a package, and whole libraries, that are imported when they are first used."""

import sys
from collections.abc import Callable, Iterable, Mapping
from importlib import import_module
from importlib.util import LazyLoader, find_spec, module_from_spec
from types import ModuleType
from typing import Any

from tyre.ground.renamed import now_called


def door(package: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Give ``__getattr__`` and ``__dir__`` of a ``package`` whose names other modules define, by ``homes``."""
    attributes = sys.modules[package].__dict__

    def get(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module {package!r} has no attribute {name!r}{now_called(name, homes)}")
        attributes[name] = getattr(import_module(homes[name]), name)
        return attributes[name]

    return get, lambda: sorted({*attributes, *homes})


def room(package: str, files: Mapping[str, Iterable[str]]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """Give the same of a package whose ``files`` define the names, by file."""
    return door(package, {name: f"{package}.{file}" for file, names in files.items() for name in names})


def library(name: str) -> Any:
    """A library that takes long to load and is loaded when one of its names is first used."""
    if name in sys.modules:
        return sys.modules[name]
    spec = find_spec(name)
    if spec is None or spec.loader is None:
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    spec.loader = LazyLoader(spec.loader)
    module: ModuleType = module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)  # which only prepares it
    return module
