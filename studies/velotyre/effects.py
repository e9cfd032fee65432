"""Every physical effect of ``bicycle.effects`` by the name of its class."""

from bicycle.effects import __dir__, __getattr__

__all__ = ["__dir__", "__getattr__"]
