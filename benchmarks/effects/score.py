"""Scores of diagnoses of sessions whose effect was withheld from what wrote them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations

import numpy as np
from scipy.stats import norm

from benchmarks.effects.folder import Answer
from benchmarks.effects.scored_diagnosis import Diagnosis
from benchmarks.effects.suite import DETECTABILITIES
from benchmarks.scores import Estimate, Measure, Share, median, resampled

CONFIDENT = 0.9  # A probability above this is a confident name.
CLEAR = 5.0  # A name is asked for from this detectability on.
_MAX_NAMES = 3  # A useful set names at most this many effects or groups.
_FALSE_ALARM_RATE = 0.01
_REACHED_SHARE = 0.9  # A level counts as reached from this share of it on.
_MIN_PROBABILITY = 0.01  # Calibration leaves out smaller ones, of which each session has thirty.
_SUSPECT = 0.1  # An effect of at least this probability is a suspect.
_BINS = np.linspace(0.0, 1.0, 11)
_DRAWS = 400  # The error by chance is simulated this many times.
Measures = dict[str, Measure]


@dataclass(frozen=True)
class Case:
    """Answer and diagnosis of a session."""

    answer: Answer
    diagnosis: Diagnosis

    @property
    def level(self) -> float:
        """Detectability that the session was made for, as far as it reached that; 0 below the lowest."""
        return max(
            (level for level in DETECTABILITIES if self.answer.detectability >= _REACHED_SHARE * level), default=0.0
        )

    @property
    def clear(self) -> bool:
        """Whether its data separate what is present from every other effect."""
        return self.level >= CLEAR

    @property
    def named_right(self) -> bool:
        """Whether the likeliest name is that of an effect that is present."""
        return self.diagnosis.first in self.answer.effects

    @property
    def in_set(self) -> bool:
        """Whether at most three effects are named, all present effects among them."""
        return len(self.diagnosis.names) <= _MAX_NAMES and set(self.answer.effects) <= self.diagnosis.names

    @property
    def in_groups(self) -> bool:
        """Whether at most three groups are named, and each present effect is in another of them."""
        effects, groups = self.answer.effects, self.diagnosis.named_groups
        return len(groups) <= _MAX_NAMES and any(
            all(effect in group for effect, group in zip(effects, chosen, strict=True))
            for chosen in permutations(groups, len(effects))
        )

    @property
    def confidently_wrong(self) -> bool:
        """Whether an effect that is not present has a probability above 0.9."""
        confident = {name for name, p in self.diagnosis.probability_of.items() if p > CONFIDENT}
        return not confident <= set(self.answer.effects)

    @property
    def unexplained(self) -> bool:
        """Whether the verdict is `unexplained`."""
        return self.diagnosis.verdict == "unexplained"

    @property
    def stage_right(self) -> bool:
        """Whether most of the gap is put on the stage where the effect acts."""
        return self.diagnosis.stage == self.answer.stage

    @property
    def interval_counts(self) -> bool:
        """Whether an interval of the shrinkage is to hold the oracle's.

        What was fitted reaches what the true effects reach only where noise moves its parameters little: at a
        detectability of d the error of a parameter costs at most about 1 / d^2 of the shrinkage, 4 % at five.
        """
        right = bool(self.answer.effects) and set(self.answer.effects) == self.diagnosis.names
        return self.clear and right and self.answer.oracle_shrinkage is not None and self.diagnosis.interval is not None

    @property
    def interval_holds(self) -> bool:
        """Whether the interval holds the oracle's shrinkage."""
        (low, high), true = self.diagnosis.interval or (np.nan, np.nan), self.answer.oracle_shrinkage
        return true is not None and low <= true <= high


def of_kind(kind: str) -> Callable[[Case], bool]:
    """Return the test for sessions of a kind."""
    return lambda case: case.answer.kind == kind


def clear(counts: Callable[[Case], bool]) -> Callable[[Case], bool]:
    """Return the test for the clear ones of some sessions."""
    return lambda case: case.clear and counts(case)


def has_stage(case: Case) -> bool:
    """Return whether what is there acts at one stage."""
    return case.answer.stage is not None


CLEAR_SINGLE = clear(of_kind("single"))


def measures(cases: Sequence[Case]) -> Measures:
    """Compute the required measures of a diagnosis, and others, of all sessions of a suite."""
    share = partial(_measure_share, cases)
    null, outside, two = of_kind("null"), of_kind("outside"), of_kind("double")
    interval = "interval holds the oracle's, d ≥ 5"
    seconds = median([case.diagnosis.seconds for case in cases if case.diagnosis.seconds is not None])
    return {
        "false_alarms": share("alarm where there is nothing", lambda c: c.diagnosis.verdict != "no_gap", null, "≤ 1 %"),
        "right_first": share("right name first, d ≥ 5", lambda c: c.named_right, CLEAR_SINGLE, "≥ 85 %"),
        "right_in_three": share("right name among three, d ≥ 5", lambda c: c.in_set, CLEAR_SINGLE, "≥ 90 %"),
        "confident_wrong": share("wrong name above 90 %", lambda c: c.confidently_wrong, asked="≤ 2 %"),
        "unexplained_outside": share("outside: unexplained", lambda c: c.unexplained, outside, "≥ 80 %"),
        "confident_outside": share("outside: a name above 90 %", lambda c: c.confidently_wrong, outside, "≤ 5 %"),
        "doubles_in_groups": share("two: each in its group", lambda c: c.in_groups, two, "≥ 70 %"),
        "stage_right": share("most of the gap on its stage", lambda c: c.stage_right, has_stage, "≥ 80 %"),
        "interval_holds": share(interval, lambda c: c.interval_holds, lambda c: c.interval_counts, "92 to 98 %"),
        **_measure_calibration(cases),
        "shrinkage": Measure("shrinkage over the oracle's, d ≥ 5, median", _compare_shrinkages(cases), "≥ 0.9"),
        "groups_right": Measure("named groups with a present effect", _count_right_groups(cases)),
        "only_wrong": share("only wrong names, at any probability", _is_only_wrong),
        "unexplained_clear": share("outside: unexplained, d ≥ 5", lambda c: c.unexplained, clear(outside)),
        "doubles_clear": share("two: each in its group, d ≥ 5", lambda c: c.in_groups, clear(two)),
        "stage_clear": share("most of the gap on its stage, d ≥ 5", lambda c: c.stage_right, clear(has_stage)),
        **by_detectability(cases),
        "seconds": Measure("seconds a session, median", seconds, "≤ 60"),
    }


def by_detectability(cases: Sequence[Case]) -> Measures:
    """Compute how often the right name comes first, of single effects, by how detectable they are."""
    levels = (0.0, *DETECTABILITIES)
    return {
        f"first_at_{level:g}": _measure_share(
            cases,
            f"right name first, d = {level:g}" if level else "right name first, d < 1",
            lambda c: c.named_right,
            lambda c, level=level: c.answer.kind == "single" and c.level == level,  # type: ignore[misc]
        )
        for level in levels
    }


def measures_without(cases: Sequence[Case]) -> Measures:
    """Score sessions with one effect, diagnosed by a catalogue that lacked it: no name can be right.

    From a detectability of five on no other effect follows it: from there `unexplained` is asked for, and the stage.
    """
    share, stage = partial(_measure_share, cases), "most of the gap on its stage, d ≥ 5"
    return {
        "unexplained": share("unexplained, d ≥ 5", lambda c: c.unexplained, CLEAR_SINGLE, "≥ 80 %"),
        "stage_right": share(stage, lambda c: c.stage_right, CLEAR_SINGLE, "≥ 80 %"),
        "confident_wrong": share("another name above 90 %", lambda c: c.confidently_wrong, asked="≤ 5 %"),
    }


def reachable(cases: Sequence[Case], counts: Callable[[Case], bool]) -> float:
    """Return the share that a matched filter would detect with one false alarm in a hundred, weak effects included.

    Such a filter knows beforehand what to look for, and the weaker of two decides (Neyman and Pearson 1933); nan where
    there is no session.
    """
    d = np.array([case.answer.detectability for case in cases if counts(case)])
    return float(norm.sf(norm.isf(_FALSE_ALARM_RATE) - d).mean()) if d.size else float("nan")


def calibration_error(predicted: np.ndarray, true: np.ndarray) -> float:
    """Return the mean difference between probabilities (k,) and how often they came true (k,), over ten bins.

    Expected calibration error (Naeini et al. 2015); nan of none.
    """
    if not len(predicted):
        return float("nan")
    which = np.clip(np.digitize(predicted, _BINS) - 1, 0, len(_BINS) - 2)
    count = np.bincount(which, minlength=len(_BINS) - 1)
    apart = np.bincount(which, predicted - true, minlength=len(_BINS) - 1)
    return float(np.abs(apart).sum() / count.sum())


def error_by_chance(predicted: np.ndarray) -> Estimate:
    """Estimate the error of as many probabilities (k,) that come true exactly as often as predicted; nan of none.

    The interval holds 95 % of such errors.
    """
    random = np.random.default_rng(0)
    errors = [calibration_error(predicted, random.uniform(size=len(predicted)) < predicted) for _ in range(_DRAWS)]
    low, high = np.quantile(errors, [0.025, 0.975])
    return Estimate(float(np.mean(errors)), (float(low), float(high)))


def _measure_calibration(cases: Sequence[Case]) -> Measures:
    """Measure the calibration, and apart that from 10 % on: most probabilities are small, and so is their error."""
    by_chance = error_by_chance(np.array([p for p, _ in _list_probabilities(cases, _SUSPECT)]))
    return {
        "calibration": Measure("calibration error", resampled(cases, lambda c: _score(c, _MIN_PROBABILITY)), "≤ 0.05"),
        "of_suspects": Measure("… of probabilities ≥ 10 %", resampled(cases, lambda c: _score(c, _SUSPECT)), "≤ 0.05"),
        "by_chance": Measure("… by chance, were these right", by_chance),
    }


def _score(cases: Sequence[Case], least: float) -> float:
    found = _list_probabilities(cases, least)
    return calibration_error(np.array([p for p, _ in found]), np.array([true for _, true in found], bool))


def _list_probabilities(cases: Sequence[Case], least: float) -> list[tuple[float, bool]]:
    """List all probabilities from some size on, and whether each came true."""
    return [
        (p, name in case.answer.effects)
        for case in cases
        for name, p in case.diagnosis.probability_of.items()
        if p >= least
    ]


def _measure_share(
    cases: Sequence[Case],
    label: str,
    right: Callable[[Case], bool],
    counts: Callable[[Case], bool] = lambda _: True,
    asked: str = "",
) -> Measure:
    return Measure(label, Share.among(cases, right, counts), asked)


def _count_right_groups(cases: Sequence[Case]) -> Share:
    """Count, of all named groups in any session, those that hold an effect which is present."""
    groups = [(case.answer, group) for case in cases for group in case.diagnosis.named_groups]
    return Share.among(groups, lambda named: bool(set(named[0].effects) & set(named[1])))


def _is_only_wrong(case: Case) -> bool:
    return bool(case.diagnosis.names) and not case.diagnosis.names & set(case.answer.effects)


def _compare_shrinkages(cases: Sequence[Case]) -> Estimate:
    """Compare shrinkages over clear sessions whose effects are all named: that by weak effects is mostly noise.

    And where the true effects, in the twin's form, shrink the gap at all.
    """
    both = [(c.diagnosis.shrinkage, c.answer.oracle_shrinkage) for c in cases if c.clear and c.in_set]
    return median([found / true for found, true in both if found is not None and true is not None and true > 0.0])
