"""Where the packaged data are: installed as ``tyre.data``, or the ``data`` folder of a bare checkout."""

from importlib import import_module, resources
from importlib.resources.abc import Traversable
from pathlib import Path


def data_root() -> Traversable:
    """Return the folder with ``tyres/``, ``bicycles/`` and ``measured/``.

    Returns
    -------
    importlib.resources.abc.Traversable
        ``tyre.data`` of an installation (wheel, editable or zipped), else ``data/`` next to the package.
    """
    try:
        import_module("tyre.data")
    except ModuleNotFoundError:
        return Path(__file__).resolve().parents[2] / "data"
    return resources.files("tyre.data")
