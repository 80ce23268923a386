"""`python -m benchmarks posterior`: coverage, with and without variation between trials and gaps, and uniform ranks."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from math import nan
from pathlib import Path

import numpy as np
from scipy.stats import kstest

from benchmarks.cases import Failure, Run, add_line, read_lines, run_cases
from benchmarks.posterior.score import PosteriorScore, score_session
from benchmarks.scores import Estimate, Measure, Scores, Share, Table, median, resampled
from fitting.coefficient_fit import NAMES

FAR_SD = 4.0  # A truth that is further off is no chance.
_FEWEST = 50  # The test for uniformity needs at least this many sessions.


@dataclass(frozen=True)
class PosteriorOutcome:
    """Scores that `python -m benchmarks posterior` found in one set of sessions."""

    sessions: tuple[PosteriorScore, ...]  # all scores in the folder
    failures: tuple[Failure, ...] = ()  # sessions that gave no posterior in this run

    @property
    def gaps(self) -> list[int]:
        """Seeds between the lowest and the highest that have no score: sessions that failed, or that nobody has run."""
        seeds = {score.seed for score in self.sessions}
        return sorted(set(range(min(seeds, default=0), max(seeds, default=-1) + 1)) - seeds)

    @property
    def calibrations(self) -> dict[str, dict[str, Measure]]:
        """Calibration of the posterior of each coefficient."""
        below = np.array([score.below for score in self.sessions])  # (s, 5)
        p = holm(np.array([uniform_p(below[:, i]) for i in range(len(NAMES))]))  # (5,)
        return {name: _measure_calibration(i, self.sessions, p[i]) for i, name in enumerate(NAMES)}

    @property
    def warnings(self) -> dict[str, Measure]:
        """Measures of how often sessions warn, and what they miss in silence."""
        kinds = Counter(kind for score in self.sessions for kind in score.warnings)
        share = partial(Share.among, self.sessions)
        missed = share(lambda score: not (score.warnings or score.covered.all()))
        covered = Share(sum(int(s.covered.sum()) for s in self.sessions), len(NAMES) * len(self.sessions))
        seconds = median([score.seconds for score in self.sessions])
        return {
            "covered": Measure("truths of all coefficients inside", covered, "86 to 94 %"),
            "warned": Measure("sessions that warn", share(lambda s: bool(s.warnings))),
            **{kind: Measure(f"… {kind}", Share(count, len(self.sessions))) for kind, count in kinds.most_common()},
            "silent": Measure("no warning, a 90 % interval misses", missed),
            "far_silent": Measure(
                f"no warning, {FAR_SD:g} sd off",
                share(lambda s: not (s.warnings or (np.abs(s.off_sd) <= FAR_SD).all())),
            ),
            "seconds": Measure("seconds a session, median", seconds),
        }

    def scores(self, command: str) -> Scores:
        """Build all tables, with the command that made them."""
        tables, notes = [], []
        if self.sessions:
            count = f"{len(self.sessions)} sessions drawn from the prior, made by the twin itself"
            tables.append(Table.of(f"{count}: posterior of each coefficient against the truth", self.calibrations))
            tables.append(Table.of("Warnings", {"sessions": self.warnings}))
            notes += [f"No score of seeds {', '.join(map(str, self.gaps))}."] if self.gaps else []
        notes += [f"Session {failure.name} failed: {failure.message}." for failure in self.failures]
        data = "synthetic: sessions drawn from the prior, with their truth"
        return Scores("Posterior", data, command, tuple(tables), tuple(notes))


def measure_posterior(folder: Path, seeds: Sequence[int], run: Run) -> PosteriorOutcome:
    """Score the sessions asked for that the folder lacks, and judge all that it then holds.

    Args:
        folder: folder of `sessions.jsonl`; a new version of the program needs a new one. Of a file of scores (.jsonl)
            the table is made as they are, and nothing is run.
        seeds: seeds of the sessions.
        run: way to work off the sessions.

    Raises:
        InputError: the file holds something else.
    """
    if folder.suffix == ".jsonl":
        return PosteriorOutcome(_read(folder))
    lines = folder / "sessions.jsonl"
    there = {score.seed for score in _read(lines)} if lines.is_file() else set()
    cases = {str(seed): seed for seed in seeds if seed not in there}
    failures = run_cases(score_session, cases, run, partial(add_line, lines))
    found = _read(lines) if lines.is_file() else ()
    return PosteriorOutcome(tuple(sorted(found, key=lambda score: score.seed)), failures)


def _read(lines: Path) -> tuple[PosteriorScore, ...]:
    return read_lines(lines, PosteriorScore, lambda score: str(score.seed))


def uniform_p(below: np.ndarray) -> float:
    """Return the p-value of uniform shares (s,); nan for too few."""
    return float(kstest(below, "uniform").pvalue) if len(below) >= _FEWEST else nan


def holm(p: np.ndarray) -> np.ndarray:
    """Correct p-values of any shape for their number (Holm 1979)."""
    order = np.argsort(p, axis=None)
    stepped = np.maximum.accumulate(np.arange(p.size, 0, -1) * p.ravel()[order])
    corrected = np.empty(p.size)
    corrected[order] = np.minimum(stepped, 1.0)
    return corrected.reshape(p.shape)


def _measure_calibration(i: int, scores: Sequence[PosteriorScore], p: float) -> dict[str, Measure]:
    spread = resampled([score.off_sd[i] for score in scores], lambda off: float(np.sqrt(np.mean(np.square(off)))))
    width = median([score.q95[i] - score.q05[i] for score in scores])
    parts = {
        "varied": ("whose trials vary", [score for score in scores if score.varied and not score.gapped]),
        "alike": ("whose trials do not", [score for score in scores if not score.varied and not score.gapped]),
        "gapped": ("with gaps", [score for score in scores if score.gapped]),
    }
    split = {
        name: Measure(f"… of sessions {words}", _count_covered(part, i))
        for name, (words, part) in parts.items()
        if part
    }
    return {
        "covered": Measure("truths inside the 90 % interval", _count_covered(scores, i), "86 to 94 %"),
        **split,
        "spread": Measure("rms of (truth - mean) / sd", spread),
        "ks_p": Measure("uniform ranks, p (Kolmogorov and Smirnov)", Estimate(float(p), (nan, nan)), "≥ 0.05"),
        "width": Measure("width of the 90 % interval, median", width),
    }


def _count_covered(scores: Sequence[PosteriorScore], i: int) -> Share:
    return Share.among(scores, lambda score: bool(score.covered[i]))
