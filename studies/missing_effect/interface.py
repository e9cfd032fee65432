"""What every kind of measurement can do: become a forward model, and show its gap."""

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from bicycle.model import Model
from studies.inference.fit import Fit
from studies.inference.forward import Forward
from studies.inference.judge import Judgement

Draw = Callable[[Judgement, Path], bool]
"""Draw a figure of a judgement into a file without its ending; False where there is nothing to draw."""

Figure = tuple[Draw, str]
"""How a figure is drawn, and its caption."""


class Measurement(Protocol):
    """A measurement with its base model, ready to be diagnosed."""

    @property
    def name(self) -> str:
        """For the title of the report."""

    @property
    def description(self) -> str:
        """In words; may be empty."""

    @property
    def source(self) -> str:
        """Where it comes from; may be empty."""

    def forward(self, *, without: tuple[str, ...] = (), also: tuple[str, ...] = ()) -> Forward:
        """The forward model with its candidates; effects in ``without`` are not tried, motors in ``also`` are.

        Raises
        ------
        InputError
            An effect in ``without`` or ``also`` that does not exist, or data that cannot be used.
        """

    def figures(self) -> dict[str, Figure]:
        """Figures of this kind of data by name: ``gap``, ``before_after``; of parts with their number."""

    def on(self, model: Model) -> "Measurement":
        """The same measurement with another base ``model``; InputError where there is no bicycle."""

    def model_with(self, final: Fit) -> Model | None:
        """The base model with the effects of the ``final`` fit; None where there is none."""
