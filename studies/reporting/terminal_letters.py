"""Letters that the encoding of the output lacks, such as those of a file on Windows: spelled in ASCII."""

import codecs
import sys
import unicodedata

GREEK = "GREEK SMALL LETTER "
SIGNS = {"−": "-", "–": "-", "—": "-", "→": "->", "≤": "<=", "≥": ">=", "±": "+-", "×": "x", "·": " ", "’": "'"}


def spell_out(text: str) -> str:
    """The nearest letters of ASCII, a question mark where there are none.

    >>> spell_out("χ² = 1.5 at α ≤ 3…")
    'chi2 = 1.5 at alpha <= 3...'
    """
    return "".join(_nearest(letter) for letter in text)


def _nearest(letter: str) -> str:
    """The nearest letters of ASCII to one letter."""
    decomposed = unicodedata.normalize("NFKD", letter)
    name = unicodedata.name(decomposed[0], "")  # of an accented letter that without the accent
    greek = name.removeprefix(GREEK).lower() if name.startswith(GREEK) else ""
    return SIGNS.get(letter) or greek or decomposed.encode("ascii", "ignore").decode() or "?"


def spell_out_what_is_lacking() -> None:
    """Let the standard streams spell out what their encoding lacks, where they would end in an error."""
    codecs.register_error("velotyre.spell_out", _replace)
    for stream in (sys.stdout, sys.stderr):
        if "utf" not in (stream.encoding or "utf").lower() and hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="velotyre.spell_out")


def _replace(error: UnicodeError) -> tuple[str, int]:
    """The replacement of letters that cannot be encoded, and where the text goes on."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    return spell_out(error.object[error.start : error.end]), error.end
