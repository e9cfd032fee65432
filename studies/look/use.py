"""Hold what a recording can be used for: which samples, which not, why, and what to do next."""

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
    """A stretch of a recording for one use."""

    name: str  # of the window; empty for a whole recording
    first: int  # samples of the file, from 1, both included
    last: int  # samples of the file, from 1, both included
    used: int  # how many samples in it are fitted
    left_out: dict[str, int] = field(default_factory=dict)  # why samples in it are not fitted -> how many
    notes: tuple[str, ...] = ()  # what the fit will remark
    start_s: float = 0.0  # s, by the time of the file
    end_s: float = 0.0  # s, by the time of the file

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
    """One use of a recording."""

    name: str  # one of :data:`USES`
    events: tuple[Event, ...] = ()  # what can be used; empty where nothing can
    reasons: tuple[str, ...] = ()  # why nothing, or not more, can be used
    remedies: tuple[str, ...] = ()  # what to do about that
    next_step: str = ""  # a command
    provided: str = ""  # what the user must still say for the answer to hold
    windows: bool = False

    @property
    def usable(self) -> bool:
        """Tell if a command would use some of it."""
        return bool(self.events)
