"""One frequency unit in the API: a frequency says Hz, what is in rad/s is called an angular frequency."""

import inspect
from importlib import import_module
from pkgutil import walk_packages

import bicycle


def test_no_field_or_argument_is_called_plainly_frequency():
    """``Modes.frequency(name)`` is in Hz; a plain ``frequency`` in rad/s beside it was read as Hz."""
    homes = [module.name for module in walk_packages(bicycle.__path__, "bicycle.")] + ["studies.motion.locus"]
    plain, checked = [], 0
    for home in homes:
        for name, thing in vars(import_module(home)).items():
            if inspect.isbuiltin(thing):
                continue  # what the kernel in C exports has no signature
            if callable(thing) and getattr(thing, "__module__", "") == home and name[0] != "_":
                checked += 1
                if "frequency" in inspect.signature(thing).parameters:
                    plain.append(f"{home}.{name}")
    assert checked > 100
    assert plain == []
