"""`python -m benchmarks foreign`: sessions drawn, run and judged, a line of JSON each, and the table of them."""

import shutil
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.cases import Failure, Run, add_line, read_lines, run_cases
from benchmarks.foreign.disturbances import KINDS, disturb
from benchmarks.foreign.draw import draw
from benchmarks.foreign.judge import Verdict, judge
from benchmarks.foreign.recordings import Recordings
from benchmarks.scores import Measure, Scores, Share, Table

LINES = "sessions.jsonl"
MOST_FLAGGED = 0.02  # At most this share of clean sessions may be flagged.


@dataclass(frozen=True)
class ForeignOutcome:
    """All sessions that a folder holds, and those of this run that could not even be made."""

    sessions: tuple[Verdict, ...]
    failures: tuple[Failure, ...] = ()

    @property
    def clean(self) -> list[Verdict]:
        """Sessions that nothing was done to."""
        return [each for each in self.sessions if each.clean]

    @property
    def falls_short(self) -> bool:
        """Whether anything falls short of what is asked."""
        flagged = sum(bool(each.flags) for each in self.clean) > MOST_FLAGGED * len(self.clean)
        return bool(flagged or self.failures or any(each.short for each in self.sessions))

    def scores(self, command: str) -> Scores:
        """Build the tables."""
        share, sessions = Share.among, self.sessions
        found = {
            "broken": Measure(
                "sessions that end in a traceback or words of the inside",
                share(sessions, lambda s: bool(s.broken)),
                "none",
            ),
            "wrong": Measure(
                "… with a number beyond 4 standard errors, unflagged", share(sessions, lambda s: bool(s.wrong)), "none"
            ),
            "unsaid": Measure("… of which something is not said", share(sessions, lambda s: bool(s.unsaid)), "none"),
            "flagged": Measure(
                "clean sessions with a flag about a trial", share(self.clean, lambda s: bool(s.flags)), "2 %"
            ),
            "refused": Measure("sessions refused", share(sessions, lambda s: bool(s.refusal))),
            "excused": Measure(
                "numbers beyond 4 standard errors with a flag",
                Share(sum(len(s.excused) for s in sessions), sum(s.judged for s in sessions)),
            ),
        }
        tables = (
            [Table.of(f"{len(sessions)} sessions, {len(self.clean)} of them clean", {"sessions": found})]
            if sessions
            else []
        )
        rows = tuple((str(s.number), kind, text) for s in sessions for kind, text in _list_shortcomings(s))
        tables += [Table("What falls short", ("session", "", "what"), rows)] if rows else []
        befell = Counter(each.split(":")[0] for s in sessions for each in s.disturbances)
        short = Counter(each.split(":")[0] for s in sessions if s.short for each in s.disturbances)
        kinds = tuple((kind.name, str(befell[kind.name]), str(short[kind.name])) for kind in KINDS)
        tables += [Table("Disturbances", ("", "sessions", "fall short"), kinds)]
        notes = tuple(f"Session {failure.name} could not be made: {failure.message}." for failure in self.failures)
        data = "synthetic: random sessions by the twin and by a second simulator, two thirds of them disturbed"
        return Scores("Foreign sessions", data, command, tuple(tables), notes)


def _list_shortcomings(session: Verdict) -> list[tuple[str, str]]:
    said = [("broken", session.broken)] if session.broken else []
    said += [("wrong", each) for each in session.wrong] + [("not said", each) for each in session.unsaid]
    return said + [("needless flag", each) for each in session.flags if session.clean]


def measure_foreign(
    folder: Path, seed: int, numbers: Sequence[int], run: Run, keep: Path | None = None
) -> ForeignOutcome:
    """Judge the sessions of these numbers that the folder lacks, and return all that it then holds.

    Args:
        folder: folder of `sessions.jsonl`; a new version of the program needs a new one.
        seed: seed of all draws.
        numbers: numbers of the sessions.
        run: way to work off the sessions.
        keep: folder in which sessions, results and `terminal.txt` are kept; default: nowhere.
    """
    lines = folder / LINES
    there = {(each.seed, each.number) for each in _read(lines)}
    cases = {f"{number}": number for number in numbers if (seed, number) not in there}
    failures = run_cases(partial(score_session, seed, keep), cases, run, partial(add_line, lines))
    return ForeignOutcome(tuple(sorted(_read(lines), key=lambda each: (each.seed, each.number))), failures)


def session_of(seed: int, number: int) -> Recordings:
    """Make the session of a number, disturbed and filmed."""
    session = draw(seed, number)
    disturb(session, number, np.random.default_rng([seed, number, 1_000_000]))
    return session


def score_session(seed: int, keep: Path | None, number: int) -> Verdict:
    """Make a session, run the program on it, and judge that; every fourth is also sampled or diagnosed."""
    session, more = session_of(seed, number), {1: ("posterior",), 3: ("diagnose",)}.get(number % 8, ())
    with TemporaryDirectory() as scratch:
        folder = (keep or Path(scratch)) / f"session_{seed}_{number}"
        shutil.rmtree(folder, ignore_errors=True)
        session.write(folder)
        return judge(session, folder, seed, number, ("fit", *more))


def _read(lines: Path) -> tuple[Verdict, ...]:
    return read_lines(lines, Verdict, lambda each: f"{each.seed} {each.number}") if lines.is_file() else ()
