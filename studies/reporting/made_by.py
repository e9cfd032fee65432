"""With which version of velotyre, and of a library, something was made."""

from importlib.metadata import PackageNotFoundError, version


def version_of(name: str) -> str:
    """Version of an installed distribution, or ``not installed`` (a checkout without installation has none).

    Parameters
    ----------
    name : str
        Of the distribution, as pip knows it.
    """
    try:
        return version(name)
    except PackageNotFoundError:
        return "not installed"


def made_by() -> str:
    """The last paragraph of a report."""
    return f"\n\nMade by velotyre {version_of('velotyre')}.\n"
