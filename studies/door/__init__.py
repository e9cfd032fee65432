"""The studies in a line of Python, and the stubs of the package ``velotyre``."""

from tyre.ground.door import room

__getattr__, __dir__ = room(
    __name__,
    {
        "door_stubs": (
            "FOLDER",
            "stubs",
        ),
        "library": ("content_of",),
    },
)
