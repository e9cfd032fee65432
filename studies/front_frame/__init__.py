"""The front frame from published figures: stiffness of head tube and fork, or a deflection at the ground."""

from tyre.ground.door import room

HOME = {
    "hinge_report": ("hinge_record", "hinge_tables", "hinge_text", "model_text"),
    "published": (
        "FigureMap",
        "FrontHinge",
        "PublishedFigures",
        "front_frame",
        "map_figures",
        "map_of",
        "read_map",
    ),
}
"""Module -> the names that it gives to other rooms; each is imported when it is first used."""

__getattr__, __dir__ = room(__name__, HOME)
