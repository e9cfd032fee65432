"""The example at the end of every ``--help``."""


def example(*lines: str) -> str:
    """Epilogue of a command: commands that run as they stand (``\\b`` keeps click from joining the lines)."""
    return "\b\nExample:\n" + "\n".join(f"  {line}" for line in lines)
