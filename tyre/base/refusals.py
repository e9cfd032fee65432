"""What the checks of values raise; in an own file, so that voluptuous is imported when the first table is read."""

from voluptuous import Invalid


class Refused(Invalid):
    """What a value is and must be, to stand behind its key."""


class UnknownKey(Invalid):
    """A key or name that is not among those allowed."""


class NoTable(Invalid):
    """A value where a table, or a list of tables, belongs."""
