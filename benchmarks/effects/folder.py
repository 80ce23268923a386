"""A suite as a folder: sessions that anybody may diagnose, answers apart from them, and what came of it."""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from benchmarks.effects.answer import Answer
from session import FaultCollector

DIAGNOSIS = Path("results") / "diagnosis.json"
SECONDS = Path("results") / "diagnosis.seconds"
"""How long it took, where this benchmark ran the program."""


class SuiteFolder(NamedTuple):
    """Where a suite is.

    Attributes:
        folder: of the suite.
    """

    folder: Path

    @property
    def sessions(self) -> Path:
        """A folder a session."""
        return self.folder / "sessions"

    @property
    def answers(self) -> Path:
        """A file a session; nothing but the scorer opens them."""
        return self.folder / "answers"

    @property
    def discrepancy(self) -> Path:
        """What every diagnosis may know of reality's base state."""
        return self.folder / "discrepancy.npz"

    @property
    def without(self) -> Path:
        """Copies of sessions, to be diagnosed by a catalogue that lacks the effect that is there."""
        return self.folder / "without"

    @property
    def followed(self) -> Path:
        """Sessions with the trial that their diagnosis recommends, to be diagnosed once more."""
        return self.folder / "followed"

    @property
    def rules(self) -> Path:
        """What trivial rules said, a file a session."""
        return self.folder / "rules"

    @property
    def names(self) -> tuple[str, ...]:
        """Of the sessions, in order.

        Raises:
            InputError: there is no whole suite.
        """
        names = sorted(path.stem for path in self.answers.glob("*.json"))
        begun = {path.name for path in self.sessions.glob("[!.]*")} - set(names)
        if not names or begun:
            faults = FaultCollector(str(self.folder))
            faults.add(
                "",
                "no suite of withheld effects",
                found="one that broke off" if begun or self.sessions.is_dir() else "no answers",
                expected="a folder that `calib benchmark effects FOLDER --part make` has finished",
                next_step="Make it, or copy datasets/withheld/small.",
            )
            faults.raise_if_any()
        return tuple(names)

    def check_every(self, stands: Callable[[str], bool], what: str, next_step: str) -> None:
        """That something stands of every session.

        Args:
            stands: of a session by its name.
            what: is wrong where it does not.
            next_step: to take then.

        Raises:
            InputError: it does not, or there is no whole suite.
        """
        names = self.names
        if left := [name for name in names if not stands(name)]:
            faults = FaultCollector(str(self.folder))
            found = f"{len(left)} of {len(names)} are missing"
            faults.add("", what, found=found, expected="all", next_step=next_step)
            faults.raise_if_any()

    def check_diagnosed(self) -> None:
        """That every session is diagnosed, without which no answer is to be opened.

        Raises:
            InputError: one is not, or there is no whole suite.
        """
        self.check_every(
            lambda name: (self.sessions / name / DIAGNOSIS).exists(),
            "not every session is diagnosed, as it must be before an answer is opened",
            "Go on with --part diagnose, or with a program of yours.",
        )

    def true(self) -> tuple[Answer, ...]:
        """All answers, in the order of the names.

        Raises:
            InputError: there is no whole suite.
        """
        return tuple(Answer.read(self.answer(name)) for name in self.names)

    def answer(self, name: str) -> Path:
        """The answer of a session."""
        return self.answers / f"{name}.json"

    def made(self, name: str) -> bool:
        """Whether a session is there, and its answer."""
        return (self.sessions / name / "session.toml").exists() and self.answer(name).exists()
