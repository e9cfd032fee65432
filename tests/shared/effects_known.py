"""What a worker process can import and run."""

from bicycle import registry


def known() -> list[str]:
    return list(registry())
