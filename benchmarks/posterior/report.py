"""`calib benchmark posterior` as a whole: uniform ranks, coverage, and widths beside those of the exact likelihood."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest, chisquare, kstest

from benchmarks.posterior.effect_names import Effect
from benchmarks.posterior.run import Tell, run_sessions
from benchmarks.posterior.score import RANKED, PosteriorScore
from benchmarks.posterior.store import Failure, ScoreStore, read_scores
from fitting.coefficient_fit import NAMES

BINS = 10
FAR_SD = 4.0  # a truth farther off than this is no chance
WIDE = 1.3  # width over the exact likelihood's that is asked at most
COVERED = (0.86, 0.94)  # share of truths that 90 % intervals are asked to hold
UNIFORM_P = 0.05  # from which ranks pass for uniform, all tests together
_FEWEST = 5 * BINS  # sessions, for five in each bin


class Calibration(NamedTuple):
    """How well the posterior of one coefficient is calibrated.

    Attributes:
        coefficient: which.
        covered: share of sessions whose 90 % interval holds the truth.
        covered_low, covered_high: 95 % interval of that share (Wilson 1927).
        ranks: (10,) how many truths fall in each tenth of the ranks.
        chi2_p, ks_p: of uniform ranks, by chi-square over ten bins and by Kolmogorov and Smirnov, both corrected for
            ten tests (Holm 1979); nan for fewer than 50 sessions.
        width, width_95: median and 95th percentile of the width of the 90 % interval over that of the exact likelihood.
        wide: share of sessions in which that is more than 1.3.
        spread: root mean square of the truth's distance from the mean, in standard deviations.
    """

    coefficient: str
    covered: float
    covered_low: float
    covered_high: float
    ranks: tuple[int, ...]
    chi2_p: float
    ks_p: float
    width: float
    width_95: float
    wide: float
    spread: float


@dataclass(frozen=True)
class PosteriorOutcome:
    """What `calib benchmark posterior` found in one set of sessions.

    Attributes:
        effect: that the truth has and the twin has not.
        scores: of the sessions, of all shards in the folder.
        failures: sessions that gave no posterior, of all shards too.
        others: files in the folder that other code made; they are left out.
        gaps: seeds below the highest that have no score.
    """

    effect: Effect
    scores: tuple[PosteriorScore, ...]
    failures: tuple[Failure, ...] = ()
    others: int = 0
    gaps: tuple[int, ...] = ()

    @property
    def misses(self) -> dict[str, tuple[str, ...]]:
        """What is asked of every coefficient, and which do not meet it; empty for fewer than 50 sessions."""
        if len(self.scores) < _FEWEST:
            return {}
        found = self.calibrations
        return {
            f"90 % intervals hold {100 * COVERED[0]:.0f} to {100 * COVERED[1]:.0f} % of truths": _those(
                found, lambda c: not COVERED[0] <= c.covered <= COVERED[1]
            ),
            f"ranks are uniform (p at least {UNIFORM_P:g}, Holm-corrected)": _those(
                found, lambda c: min(c.chi2_p, c.ks_p) < UNIFORM_P
            ),
            f"the median interval is at most {WIDE:g} times the exact likelihood's": _those(
                found, lambda c: c.width > WIDE
            ),
        }

    @property
    def calibrations(self) -> list[Calibration]:
        """Of each coefficient."""
        rank = np.array([score.rank for score in self.scores])  # (s, 5)
        below = np.array([score.below for score in self.scores])
        p = holm(np.array([uniform_p(rank[:, i], below[:, i]) for i in range(len(NAMES))]))  # (5, 2)
        return [_calibration(i, self.scores, (float(p[i, 0]), float(p[i, 1]))) for i in range(len(NAMES))]

    @property
    def silent(self) -> float:
        """Share of sessions in which some 90 % interval misses the truth and nothing warns of it."""
        return float(np.mean([not score.warned and not score.covered.all() for score in self.scores]))

    @property
    def far_silent(self) -> float:
        """Share of sessions in which some truth is 4 standard deviations off and nothing warns of it."""
        return float(np.mean([not score.warned and np.abs(score.off_sd).max() > FAR_SD for score in self.scores]))

    @property
    def warned(self) -> float:
        """Share of sessions that warn."""
        return float(np.mean([score.warned for score in self.scores]))

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "effect": self.effect,
            "coefficients": [each._asdict() for each in self.calibrations] if self.scores else [],
            "missed_by": self.misses,
            "sessions": [score.to_json() for score in self.scores],
            "failures": [failure._asdict() for failure in self.failures],
            "made_by_other_code": self.others,
            "seeds_without_a_score": list(self.gaps),
            "warned": self.warned if self.scores else None,
            "silent": self.silent if self.scores else None,
            "far_silent": self.far_silent if self.scores else None,
        }

    def text(self) -> str:
        """A table for a terminal."""
        lines = [*_table(self)] if self.scores else ["no session yet"]
        if self.others:
            lines.append(f"{self.others} files in the folder are of other code and left out")
        if self.gaps:
            lines.append(f"no score of seeds {', '.join(map(str, self.gaps))}")
        lines += [f"session {failure.seed} failed: {failure.message}" for failure in self.failures]
        return "\n".join(lines)


@dataclass(frozen=True)
class Asked:
    """Which sessions to score, and how.

    Attributes:
        first, count: seeds.
        effect: that the twin leaves out.
        strength: of that, in shares of its full strength.
        workers: sessions at a time; 0 for one on each core.
        scheduler: address of a dask scheduler; None for this process alone.
    """

    first: int = 0
    count: int = 300
    effect: Effect = "none"
    strength: float = 1.0
    workers: int = 0
    scheduler: str | None = None


def measure_posterior(folder: Path, asked: Asked, tell: Tell | None = None) -> PosteriorOutcome:
    """Scores the sessions asked for that the folder lacks, and judges all that it then holds.

    Args:
        folder: where scores are kept; several machines may fill it with a shard each. Of a file of scores (.jsonl) the
            table is made as they are, whichever code made them, and nothing is run.
        asked: the sessions.
        tell: of the progress.

    Raises:
        InputError: no scheduler answers, or the file holds something else.
        ResultsNotWritable: the folder is not writable.
    """
    if folder.suffix == ".jsonl":
        scores = read_scores(folder)
        effects = {score.effect for score in scores}
        return PosteriorOutcome(effects.pop() if len(effects) == 1 else "any", scores)
    store = ScoreStore(folder, asked.effect, asked.strength)
    seeds = range(asked.first, asked.first + asked.count)
    run_sessions(store, seeds, asked.workers, asked.scheduler, tell)
    return PosteriorOutcome(asked.effect, tuple(store.scores()), store.failures(), store.others, tuple(store.gaps()))


def uniform_p(rank: np.ndarray, below: np.ndarray) -> tuple[float, float]:
    """p-values of uniform ranks (s,), from 0 to 99, over ten bins, and of uniform shares (s,); nan for too few."""
    if len(rank) < _FEWEST:
        return float("nan"), float("nan")
    binned = np.bincount(rank * BINS // (RANKED + 1), minlength=BINS)
    return float(chisquare(binned).pvalue), float(kstest(below, "uniform").pvalue)


def holm(p: np.ndarray) -> np.ndarray:
    """p-values of any shape, corrected for their number (Holm 1979)."""
    order = np.argsort(p, axis=None)
    stepped = np.maximum.accumulate(np.arange(p.size, 0, -1) * p.ravel()[order])
    corrected = np.empty(p.size)
    corrected[order] = np.minimum(stepped, 1.0)
    return corrected.reshape(p.shape)


def _calibration(i: int, scores: Sequence[PosteriorScore], p: tuple[float, float]) -> Calibration:
    covered = int(sum(score.covered[i] for score in scores))
    interval = binomtest(covered, len(scores)).proportion_ci(0.95, method="wilson")
    ranks = np.bincount([score.rank[i] * BINS // (RANKED + 1) for score in scores], minlength=BINS)
    width = np.array([score.width_ratio[i] for score in scores])
    width = width[np.isfinite(width)]
    return Calibration(
        coefficient=NAMES[i],
        covered=covered / len(scores),
        covered_low=float(interval.low),
        covered_high=float(interval.high),
        ranks=tuple(map(int, ranks)),
        chi2_p=p[0],
        ks_p=p[1],
        width=float(np.median(width)) if len(width) else np.nan,
        width_95=float(np.quantile(width, 0.95)) if len(width) else np.nan,
        wide=float(np.mean(width > WIDE)) if len(width) else np.nan,
        spread=float(np.sqrt(np.mean([score.off_sd[i] ** 2 for score in scores]))),
    )


def _table(outcome: PosteriorOutcome) -> list[str]:
    scores, count = outcome.scores, len(outcome.scores)
    seconds = np.array([score.seconds for score in scores])
    head = f"{'coefficient':13} {'90 % covers':>11} {'(95 % of that)':>16} {'spread':>7} "
    head += f"{'width':>6} {'95 %':>6} {'> 1.3':>6} "
    rows = [
        f"{c.coefficient:13} {c.covered:11.1%} {f'{c.covered_low:.1%} to {c.covered_high:.1%}':>16} {c.spread:7.2f} "
        f"{c.width:6.2f} {c.width_95:6.2f} {c.wide:6.1%} {c.chi2_p:7.3f} {c.ks_p:7.3f}  "
        + " ".join(f"{n:3d}" for n in c.ranks)
        for c in outcome.calibrations
    ]
    return [
        f"{count} sessions drawn from the prior, unmodelled effect: {outcome.effect}",
        head + f"{'chi2 p':>7} {'KS p':>7}  truths in each tenth of the ranks",
        *rows,
        "spread: root mean square of truth less mean, in standard deviations. width: of the 90 % interval over that of "
        "the exact likelihood, median, 95th percentile and share above 1.3.",
        f"chi2 over {BINS} bins and Kolmogorov-Smirnov test uniform ranks, Holm-corrected for {2 * len(NAMES)} tests; "
        f"from {_FEWEST} sessions.",
        *(
            f"{asked}: {'missed by ' + ', '.join(missed) if missed else 'yes'}"
            for asked, missed in outcome.misses.items()
        ),
        f"{np.median(seconds):.0f} s a session ({np.quantile(seconds, 0.95):.0f} s at the 95th percentile), "
        f"largest R-hat {max(max(s.r_hat) for s in scores):.3f}, at least "
        f"{min(min(s.ess_bulk) for s in scores):.0f} effective draws",
        f"{outcome.warned:.1%} of sessions warn; without a warning, {outcome.silent:.1%} miss a truth with a 90 % "
        f"interval and {outcome.far_silent:.1%} by more than {FAR_SD:g} standard deviations",
        "of that, by kind: " + (", ".join(_by_kind(scores)) or "none"),
        *_by_effect(scores),
    ]


def _those(found: Sequence[Calibration], misses: Callable[[Calibration], bool]) -> tuple[str, ...]:
    return tuple(each.coefficient for each in found if misses(each))


def _by_kind(scores: Sequence[PosteriorScore]) -> list[str]:
    counts = Counter(kind for score in scores for kind in score.warnings)
    return [f"{kind} {count / len(scores):.1%}" for kind, count in counts.most_common()]


def _by_effect(scores: Sequence[PosteriorScore]) -> list[str]:
    """A line an effect and strength, where there are several."""
    kinds = sorted({(score.effect, score.strength) for score in scores})
    if len(kinds) < 2:
        return []
    lines = [
        f"{'effect':22} {'strength':>8} {'sessions':>8} {'warn':>5} {'missed':>6} "
        f"{'silent':>6} {'> 3 sd':>6} {'> 4 sd':>6} silent"
    ]
    for name, strength in kinds:
        own = [score for score in scores if (score.effect, score.strength) == (name, strength)]
        silent = [score for score in own if not score.warned]
        far = [max(abs(off) for off in score.off_sd) for score in silent]
        missed = [sum(not score.covered.all() for score in some) for some in (own, silent)]
        lines.append(
            f"{name:22} {strength:8g} {len(own):8d} {len(own) - len(silent):5d} {missed[0]:6d} {missed[1]:6d} "
            f"{sum(each > 3 for each in far):6d} {sum(each > FAR_SD for each in far):6d}"
        )
    return lines
