"""Remembered answers, for what is asked twice in a row or now and again."""

from collections.abc import Callable, Hashable
from typing import Generic, TypeVar

Answer = TypeVar("Answer")


class LastAnswer(Generic[Answer]):
    """Holder of the last answer: a fit asks for residuals at a point, and then for their slopes at the same point."""

    def __init__(self) -> None:
        self._question: Hashable = None
        self._answer: Answer | None = None

    def get(self, question: Hashable, compute: Callable[[], Answer]) -> Answer:
        """Answer to ``question``: the last one if that was asked last, else computed and remembered."""
        if self._answer is None or question != self._question:
            self._question, self._answer = question, compute()
        return self._answer

    def put(self, question: Hashable, answer: Answer) -> None:
        """Remember a better ``answer`` to ``question``."""
        self._question, self._answer = question, answer


class RecentAnswers(Generic[Answer]):
    """Holder of answers by question; forgets all of them once there are ``most``."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._answers: dict[Hashable, Answer] = {}

    def get(self, question: Hashable, compute: Callable[[], Answer]) -> Answer:
        """Answer to ``question``: the remembered one, else computed; if ``most`` are there, all are forgotten first."""
        if question not in self._answers:
            if len(self._answers) >= self._most:
                self._answers.clear()
            self._answers[question] = compute()
        return self._answers[question]
