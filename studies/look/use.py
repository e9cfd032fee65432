"""What a recording can be used for: which samples, which not, why, and what to do next."""

from dataclasses import dataclass, field

USES = (
    "slip sweep",
    "pull test",
    "step (relaxation)",
    "free decay (modal)",
    "replay (histories)",
    "frequency response",
)


@dataclass(frozen=True)
class Event:
    """A stretch of a recording for one use.

    Attributes
    ----------
    name : str
        Of the window; empty for a whole recording.
    first, last : int
        Samples of the file, from 1, both included.
    used : int
        How many samples in it are fitted.
    left_out : dict of str to int
        Why samples in it are not fitted -> how many.
    notes : tuple of str
        What the fit will remark.
    start_s, end_s : float
        s, by the time of the file.
    """

    name: str
    first: int
    last: int
    used: int
    left_out: dict[str, int] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    start_s: float = 0.0
    end_s: float = 0.0

    @property
    def words(self) -> str:
        """Which samples are used and which are not, in one line."""
        name = f"{self.name}: " if self.name else ""
        timed = f" ({self.start_s:.4g} to {self.end_s:.4g} s)" if self.end_s > self.start_s else ""
        name, whole = f"{name}samples {self.first}-{self.last}{timed}, ", self.last - self.first + 1
        if not self.left_out:
            how = f"all {whole}" if self.used == whole else f"resampled to {self.used}"
            return f"{name}{how}"
        said = ", ".join(f"{count} {why}" for why, count in self.left_out.items())
        return f"{name}{self.used} of {whole}; left out: {said}"


@dataclass(frozen=True)
class Use:
    """One use of a recording.

    Attributes
    ----------
    name : str
        One of :data:`USES`.
    events : tuple of Event
        What can be used; empty where nothing can.
    reasons : tuple of str
        Why nothing, or not more, can be used.
    remedies : tuple of str
        What to do about that.
    next_step : str
        A command.
    provided : str
        What the user must still say for the answer to hold.
    windows : bool
        Whether the events are windows found here, which the drafts hold: without them the answer is another.
    """

    name: str
    events: tuple[Event, ...] = ()
    reasons: tuple[str, ...] = ()
    remedies: tuple[str, ...] = ()
    next_step: str = ""
    provided: str = ""
    windows: bool = False

    @property
    def usable(self) -> bool:
        """Whether a command would use some of it."""
        return bool(self.events)
