"""A note that knows what it is about, so that a reader can be shown one line for all notes on one thing."""

from collections.abc import Sequence


class Note(str):
    """A sentence with its subject.

    Attributes
    ----------
    subject : str
        What the sentence is about: ``Tyre1 on flat``.
    headline : str
        What must be seen of the subject even where its notes are folded into one line.
    inside : bool
        False where values of the subject are extrapolated beyond what was measured.
    """

    subject: str
    headline: str
    inside: bool

    def __new__(cls, text: str, subject: str = "", headline: str = "", *, inside: bool = True) -> "Note":
        note = super().__new__(cls, text)
        note.subject, note.headline, note.inside = subject, headline, inside
        return note

    def replace(self, old: str, new: str, count: int = -1) -> "Note":  # type: ignore[override]
        """The same note with ``new`` words for ``old`` ones, at most ``count`` times (any number if negative)."""
        return Note(super().replace(old, new, count), self.subject, self.headline, inside=self.inside)


def extrapolated(notes: Sequence[str]) -> bool:
    """Whether one of ``notes`` says that values lie beyond what was measured."""
    return any(isinstance(note, Note) and not note.inside for note in notes)


def folded(notes: Sequence[str]) -> list[str]:
    """One line for all ``notes`` on one subject (where there are several), the others as they are, in their order."""
    groups: dict[str, list[str]] = {}
    for number, note in enumerate(notes):
        subject = note.subject if isinstance(note, Note) and note.subject else f"\0{number}"
        groups.setdefault(subject, []).append(note)
    lines = []
    for subject, group in groups.items():
        first = group[0]
        if len(group) == 1 or not isinstance(first, Note):
            lines += group
        else:
            lines.append(f"{subject} ({first.headline}): {len(group)} notes, --verbose shows them")
    return lines
