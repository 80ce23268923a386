"""One file for each session of the posterior's benchmark: shards fill a folder together, and what is there stands."""

import json
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import Any, NamedTuple

import emcee
import mujoco

import fitting
import swimmer
import synthetic
from benchmarks.posterior import effects, exact, truth
from benchmarks.posterior import score as scoring
from benchmarks.posterior.effect_names import Effect
from benchmarks.posterior.score import PosteriorScore
from session import FaultCollector, fingerprint_of, plain_json, sha256_of, write_whole


class Failure(NamedTuple):
    """A session that gave no posterior, and why."""

    seed: int
    message: str


@dataclass(frozen=True)
class ScoreStore:
    """Scores of one set of sessions, one line of JSON each, as `sessions/<seed>.json`.

    Attributes:
        folder: that several machines may share.
        effect, strength: of the set; an effect other than "none" has a folder of its own beside `sessions`, and so has
            each strength of it.
    """

    folder: Path
    effect: Effect
    strength: float = 1.0

    @property
    def sessions(self) -> Path:
        """Where the files are."""
        if self.effect == "none":
            return self.folder / "sessions"
        return self.folder / (f"sessions-{self.effect}" + (f"-{self.strength:g}" if self.strength != 1 else ""))

    def missing(self, seeds: Sequence[int]) -> list[int]:
        """Those without a score by this code and engine."""
        return [seed for seed in seeds if self._read(self._file(seed)) is None]

    def keep(self, score: PosteriorScore) -> None:
        """Writes a score, or writes it anew.

        Raises:
            ResultsNotWritable: the folder is not writable.
        """
        self.sessions.mkdir(parents=True, exist_ok=True)
        write_whole(
            self._file(score.seed), json.dumps({"fingerprint": self._fingerprint, **plain_json(score.to_json())}) + "\n"
        )
        self._failed(score.seed).unlink(missing_ok=True)

    def keep_failure(self, failure: "Failure") -> None:
        """Notes that a session gave no posterior, until it gives one.

        Raises:
            ResultsNotWritable: the folder is not writable.
        """
        self.sessions.mkdir(parents=True, exist_ok=True)
        write_whole(self._failed(failure.seed), failure.message + "\n")

    def failures(self) -> tuple["Failure", ...]:
        """Of all shards, by seed."""
        noted = [Failure(int(path.stem), path.read_text().rstrip()) for path in self.sessions.glob("*.failed")]
        return tuple(sorted(failure for failure in noted if self._read(self._file(failure.seed)) is None))

    def scores(self) -> Iterator[PosteriorScore]:
        """All by this code and engine, of all shards, by seed."""
        for path in sorted(self.sessions.glob("*.json"), key=lambda path: (len(path.name), path.name)):
            if (score := self._read(path)) is not None:
                yield score

    def gaps(self) -> list[int]:
        """Seeds below the highest that have no score: sessions that failed, or that nobody has run."""
        seeds = {score.seed for score in self.scores()}
        return sorted(set(range(max(seeds, default=-1) + 1)) - seeds)

    @property
    def others(self) -> int:
        """How many stand there that other code or another engine made, or that cannot be read."""
        return sum(self._read(path) is None for path in self.sessions.glob("*.json"))

    def _file(self, seed: int) -> Path:
        return self.sessions / f"{seed}.json"

    def _failed(self, seed: int) -> Path:
        return self.sessions / f"{seed}.failed"

    def _read(self, path: Path) -> PosteriorScore | None:
        with suppress(OSError, ValueError, KeyError, TypeError):
            stands = json.loads(path.read_text())
            if stands.pop("fingerprint") == self._fingerprint:
                return _score(stands)
        return None

    @property
    def _fingerprint(self) -> str:
        return fingerprint_of(_code(), {"effect": self.effect, "strength": self.strength})


def read_scores(file: Path) -> tuple[PosteriorScore, ...]:
    """Scores that were kept in one file, a line each, by seed; whichever code made them.

    Raises:
        InputError: the file cannot be read, or a line is no score.
    """
    faults, scores = FaultCollector(str(file)), []
    try:
        lines = file.read_text().splitlines()
    except OSError as error:
        faults.add("", "the file cannot be read", found=str(error), expected="scores, one line of JSON each")
        faults.raise_if_any()
    for number, line in enumerate(lines, 1):
        try:
            stands = json.loads(line)
            stands.pop("fingerprint")
            scores.append(_score(stands))
        except (ValueError, KeyError, TypeError, AttributeError) as error:
            faults.add(
                f"line {number}",
                "no score of a session",
                found=str(error),
                expected="a line as in sessions/<seed>.json",
            )
    faults.raise_if_any()
    return tuple(sorted(scores, key=lambda score: score.seed))


def _score(stands: dict[str, Any]) -> PosteriorScore:
    """From JSON, in which lists stand for tuples and null for what is not known."""
    plain: dict[str, Any] = {
        name: _tuple(value) if isinstance(value, list) else value for name, value in stands.items()
    }
    if plain.keys() != {field.name for field in fields(PosteriorScore)}:
        raise ValueError("the file of another program")
    return PosteriorScore(**plain)


def _tuple(values: list[Any]) -> tuple[Any, ...]:
    return tuple(float("nan") if value is None else value for value in values)


@cache
def _code() -> dict[str, str]:
    """What a score depends on: the twin, the inference, how sessions are drawn and scored, and MuJoCo."""
    modules = (scoring, effects, exact, truth)
    files = [Path(str(module.__file__)) for module in modules]
    for package in (fitting, swimmer, synthetic):
        files += Path(str(package.__file__)).parent.rglob("*.py")
        files += Path(str(package.__file__)).parent.rglob("*.toml")
    libraries = {"mujoco": mujoco.__version__, "emcee": emcee.__version__, "arviz": version("arviz")}
    return libraries | {f"{path.parent.name}/{path.name}": sha256_of(path) for path in sorted(set(files))}
