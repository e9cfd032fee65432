"""Names of files in the private folder of a page."""

from pathlib import PurePosixPath

from tyre.base.errors import InputError, shown

MOST_LETTERS, DEEPEST = 100, 4  # of a part of a name, and how many parts
RESULTS = ("look", "fit", "tyre_fit", "diagnosis")
"""Folders of the commands, beside what is loaded."""

GATHERED = "as_loaded"
"""Folder of what is loaded and nothing else, for as long as a command reads it."""

OWN = (*RESULTS, GATHERED)


def file_name(given: str) -> str:
    """A name that stays inside a folder, with ``/`` between its parts.

    Parameters
    ----------
    given : str

    Raises
    ------
    InputError
        Too long or deep, hidden, with a mark that leads elsewhere, or the name of a folder of results.
    """
    parts = given.split("/")
    bad = [
        p for p in parts if not p.strip() or len(p) > MOST_LETTERS or p[0] in ".-~" or any(m in p for m in '\\:*?"<>|')
    ]
    if bad or len(parts) > DEEPEST or not given.isprintable() or parts[0] in OWN:
        raise InputError(
            f"file {shown(given[:200])} cannot be loaded under this name: letters, digits, blanks, '_', '-' and '.', "
            f"no dot or dash first, not in a folder {', '.join(OWN)}; rename it"
        )
    return PurePosixPath(*parts).as_posix()


def is_litter(name: str) -> bool:
    """Whether a ``name`` in a zip is one of those that systems put there beside the files."""
    return name.startswith("__MACOSX/") or name.rpartition("/")[2] in (".DS_Store", "Thumbs.db")
