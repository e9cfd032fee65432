"""One frequency unit in the API: a frequency says Hz, what is in rad/s is called an angular frequency."""

import inspect
from importlib import import_module
from pkgutil import walk_packages

import bicycle
from studies import root_loci


def test_no_field_or_argument_is_called_plainly_frequency():
    """``Modes.frequency(name)`` is in Hz; a plain ``frequency`` in rad/s beside it was read as Hz."""
    plain, checked = [], 0
    for package in (bicycle, root_loci):
        for module in walk_packages(package.__path__, f"{package.__name__}."):
            for name, thing in vars(import_module(module.name)).items():
                if callable(thing) and getattr(thing, "__module__", "") == module.name and name[0] != "_":
                    checked += 1
                    if "frequency" in inspect.signature(thing).parameters:
                        plain.append(f"{module.name}.{name}")
    assert checked > 100
    assert plain == []
