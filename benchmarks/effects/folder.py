"""Suite as a folder: sessions that anybody may diagnose, answers apart from them, and what came of it."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from swimcal.errors import Fault, InputError
from swimcal.results import from_plain

DIAGNOSIS = Path("results") / "diagnosis.json"
SECONDS = Path("results") / "diagnosis.seconds"
"""File with the duration, where this benchmark ran the program."""


Kind = Literal["null", "single", "double", "outside"]


@dataclass(frozen=True)
class Answer:
    """Answer of one session."""

    session: str  # name of the session
    kind: Kind  # no effect, one or two of the catalogue, or one that the catalogue does not hold
    effects: tuple[str, ...] = ()  # names of the catalogue that are present
    outside: str | None = None  # name of what is present and not in the catalogue; None where all is
    # rivals of each effect that these data cannot separate from it (two-way error above 5 %)
    alike: tuple[tuple[str, ...], ...] = ()
    # whitened distance from the nearest rival, each refitted; of the weakest of several, 0 of null
    detectability: float = 0.0
    stage: str | None = None  # stage at which the effect acts; None for null and for effects at several stages
    # Share by which the twin's own form of the true effects, refitted on the fit trials, shrinks the gap of the held-
    # out ones, both without noise. It can be reached, and an interval should hold it. None for null and outside.
    oracle_shrinkage: float | None = None
    seed: int = 0  # seed of all that was drawn for the session
    strengths: tuple[float, ...] = ()  # strength with which each of what is present was made


class SuiteFolder:
    """Folders of a suite."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.sessions = folder / "sessions"  # This holds a folder a session.
        self.answers = folder / "answers"  # This holds a file a session; nothing but the scorer opens them.
        self.without = folder / "without"  # This holds copies of sessions, for a catalogue that lacks the effect.

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sessions, in order.

        Raises:
            InputError: there is no whole suite.
        """
        names = sorted(path.stem for path in self.answers.glob("*.json"))
        begun = {path.name for path in self.sessions.glob("[!.]*")} - set(names)
        if not names or begun:
            fault = Fault(
                str(self.folder),
                "",
                "no suite of withheld effects",
                "one that broke off" if begun or self.sessions.is_dir() else "no answers",
                "a folder that `python -m benchmarks effects FOLDER --part make` has finished",
                next_step="Make it, or copy datasets/withheld/small.",
            )
            raise InputError([fault])
        return tuple(names)

    def check_diagnosed(self) -> None:
        """Check that every session is diagnosed, without which no answer is to be opened.

        Raises:
            InputError: one is not, or there is no whole suite.
        """
        names = self.names
        if missing := [name for name in names if not (self.sessions / name / DIAGNOSIS).exists()]:
            what, step = "not every session is diagnosed", "Go on with --part diagnose, or with a program of yours."
            found, expected = f"{len(missing)} of {len(names)} are missing", "all, before an answer is opened"
            raise InputError([Fault(str(self.folder), "", what, found, expected, next_step=step)])

    def true(self) -> tuple[Answer, ...]:
        """Read all answers, in the order of the names.

        Raises:
            InputError: there is no whole suite.
        """
        return tuple(from_plain(Answer, json.loads(self.answer(name).read_bytes())) for name in self.names)

    @property
    def singles(self) -> dict[str, Answer]:
        """Answers of the sessions that hold one effect of the catalogue, by name."""
        return {answer.session: answer for answer in self.true() if answer.kind == "single"}

    def answer(self, name: str) -> Path:
        """Return the file of a session's answer."""
        return self.answers / f"{name}.json"

    def made(self, name: str) -> bool:
        """Return whether a session is there, and its answer."""
        return (self.sessions / name / "session.toml").exists() and self.answer(name).exists()
