"""The example at the end of every ``--help``."""

ARGUMENTS = "velotyre.arguments"
"""Where click's ``meta`` holds what stood on the command line."""


def example(*lines: str) -> str:
    r"""Epilogue of a command: ``lines`` of commands that run as they stand (``\b`` keeps click from joining them)."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in lines)
