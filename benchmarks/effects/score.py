"""How right diagnoses are of sessions whose effect was withheld from what wrote them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import permutations
from typing import Any

import numpy as np
from scipy.stats import norm

from benchmarks.effects.answer import Answer
from benchmarks.effects.shares import Estimate, Reliability, Share, median, resampled
from benchmarks.effects.suite import DETECTABILITIES
from benchmarks.effects.told import Told

CONFIDENT = 0.9
CLEAR = 5.0  # detectability from which a name is asked for
_SET = 3
_FALSE_ALARMS = 0.01
_FEW = 5  # rivals
_ALMOST = 0.9  # of a level that counts as reached
_WORTH_TELLING = 0.01  # probabilities below do not count for calibration: there are thirty of them in each session
_SUSPECT = 0.1
OTHER = "(none)"


@dataclass(frozen=True)
class Case:
    """A session: what is true of it and what was told."""

    answer: Answer
    told: Told

    @property
    def named_right(self) -> bool:
        """Whether the likeliest name is that of an effect that is present."""
        return self.told.first is not None and self.answer.present(self.told.first)

    @property
    def in_set(self) -> bool:
        """Whether at most three names are told, all present effects among them."""
        return len(self.told.names) <= _SET and set(self.answer.effects) <= self.told.names

    @property
    def in_groups(self) -> bool:
        """Whether at most three groups are told, and each present effect is in another of them."""
        effects, groups = self.answer.effects, self.told.groups
        return len(groups) <= _SET and any(
            all(effect in group for effect, group in zip(effects, chosen, strict=True))
            for chosen in permutations(groups, len(effects))
        )

    @property
    def confidently_wrong(self) -> bool:
        """Whether an effect that is not present is told with a probability above 0.9."""
        return any(p > CONFIDENT and not self.answer.present(name) for name, p in self.told.chances.items())


@dataclass(frozen=True)
class Score:
    """Of all sessions of a suite."""

    cases: tuple[Case, ...]

    def share(self, right: Callable[[Case], bool], among: Callable[[Case], bool] = lambda _: True) -> Share:
        """Of some sessions, those of which something holds."""
        chosen = [case for case in self.cases if among(case)]
        return Share(sum(right(case) for case in chosen), len(chosen))

    @property
    def headline(self) -> dict[str, Share]:
        """What the toolkit's goals are about."""
        return {
            "false_alarms": self.share(lambda c: c.told.verdict != "no_gap", _of("null")),
            "right_first": self.share(lambda c: c.named_right, clear),
            "right_in_three": self.share(lambda c: c.in_set, clear),
            "confident_wrong": self.share(lambda c: c.confidently_wrong),
            "unexplained_outside": self.share(lambda c: c.told.verdict == "unexplained", _of("outside")),
            "confident_outside": self.share(lambda c: c.confidently_wrong, _of("outside")),
            "doubles_in_groups": self.share(lambda c: c.in_groups, _of("double")),
            "stage_right": self.share(lambda c: c.told.stage == c.answer.stage, lambda c: c.answer.stage is not None),
            "interval_holds": self.share(_holds, lambda c: _holds_applies(c)),
        }

    @property
    def clear_alone(self) -> dict[str, Share]:
        """Those of the headline that count every session with something in it, of the clear ones."""
        return {
            "unexplained_outside": self.share(lambda c: c.told.verdict == "unexplained", _clear_of("outside")),
            "doubles_in_groups": self.share(lambda c: c.in_groups, _clear_of("double")),
            "stage_right": self.share(
                lambda c: c.told.stage == c.answer.stage, lambda c: c.answer.stage is not None and _is_clear(c.answer)
            ),
        }

    @property
    def reachable(self) -> dict[str, float]:
        """What of these, weak ones with them, a matched filter would see with one false alarm in a hundred.

        Such a filter knows beforehand what to look for, and the weaker of two decides (Neyman and Pearson 1933); nan
        where there is no session.
        """
        among = {
            "unexplained_outside": _of("outside"),
            "doubles_in_groups": _of("double"),
            "stage_right": lambda case: case.answer.stage is not None,
        }
        found = {}
        for name, chosen in among.items():
            d = np.array([case.answer.detectability for case in self.cases if chosen(case)])
            found[name] = float(norm.sf(norm.isf(_FALSE_ALARMS) - d).mean()) if d.size else float("nan")
        return found

    @property
    def by_detectability(self) -> dict[float, Share]:
        """The right name first, of single effects, by how detectable they are."""
        return self.shares_by_detectability(lambda c: c.named_right)

    @property
    def by_effect(self) -> dict[str, Share]:
        """The right name first, of clear single effects, by name."""
        return self.shares_by_effect(lambda c: c.named_right)

    @property
    def in_three_by_detectability(self) -> dict[float, Share]:
        """All that is present among at most three names, of single effects, by how detectable they are."""
        return self.shares_by_detectability(lambda c: c.in_set)

    @property
    def in_three_by_effect(self) -> dict[str, Share]:
        """The same of clear single effects, by name."""
        return self.shares_by_effect(lambda c: c.in_set)

    def shares_by_detectability(self, right: Callable[[Case], bool]) -> dict[float, Share]:
        """Of single effects at each level, those of which something holds."""
        levels = sorted({_level(case.answer) for case in self.cases if case.answer.kind == "single"})
        return {level: self.share(right, _at(level)) for level in levels}

    def shares_by_effect(self, right: Callable[[Case], bool]) -> dict[str, Share]:
        """Of clear single effects of each name, those of which something holds."""
        names = sorted({case.answer.effects[0] for case in self.cases if clear(case)})
        return {name: self.share(right, _is(name)) for name in names}

    @property
    def share_on_stage(self) -> Estimate:
        """Median share of the gap that is put on the stage where the effect acts; nan of none."""
        return median([c.told.by_stage[c.answer.stage] for c in self.cases if c.answer.stage in c.told.by_stage])

    @property
    def confusion(self) -> dict[str, dict[str, int]]:
        """Of clear single effects: how often each was first named what."""
        table: dict[str, dict[str, int]] = {}
        for case in filter(clear, self.cases):
            row = table.setdefault(case.answer.effects[0], {})
            first = case.told.first or OTHER
            row[first] = row.get(first, 0) + 1
        return table

    @property
    def look_alikes(self) -> dict[str, dict[str, int]]:
        """Of effects that are no weaker than a rival can be told at, but have a few rivals that follow them: how often.

        There the set of both is the right answer; an effect with more rivals than a few is just weak.
        """
        table: dict[str, dict[str, int]] = {}
        for case in self.cases:
            for name, rivals in zip(case.answer.effects, case.answer.alike, strict=False):
                for rival in rivals if len(rivals) <= _FEW else ():
                    row = table.setdefault(name, {})
                    row[rival] = row.get(rival, 0) + 1
        return dict(sorted(table.items()))

    @property
    def reliability(self) -> Reliability:
        """Of all probabilities from 1 % on."""
        return _reliability(self.cases, _WORTH_TELLING)

    @property
    def calibration_error(self) -> Estimate:
        """Of all probabilities from 1 % on. Most are small, and whoever tells none but small ones errs by little."""
        return resampled(self.cases, lambda cases: _reliability(cases, _WORTH_TELLING).error)

    @property
    def calibration_error_of_suspects(self) -> Estimate:
        """Of the probabilities from 10 % on, which is where somebody looks."""
        return resampled(self.cases, lambda cases: _reliability(cases, _SUSPECT).error)

    @property
    def calibration_error_by_chance(self) -> Estimate:
        """What it would be of these, few as they are, if they came true just as often as they say."""
        return Reliability.error_by_chance(np.array([p for p, _ in _probabilities(self.cases, _SUSPECT)]))

    @property
    def shrinkage_of_oracle(self) -> Estimate:
        """Median over clear sessions whose effects are all told, nan of none: shrinkage over that of the true effects.

        Clear ones alone, as of intervals: what weak effects shrink by is mostly noise. And where the true effects, in
        the twin's form, shrink the gap at all.
        """
        clear = filter(lambda case: _is_clear(case.answer) and case.in_set, self.cases)
        both = [(case.told.shrinkage, case.answer.oracle_shrinkage) for case in clear]
        return median([told / true for told, true in both if told is not None and true is not None and true > 0.0])

    @property
    def wrong_said(self) -> Share:
        """Sessions in which a name is said and none that is said is present, however sure it is."""
        return self.share(lambda c: bool(c.told.names) and not any(map(c.answer.present, c.told.names)))

    @property
    def said_right(self) -> Share:
        """Of all groups that are said, in any session, those that hold an effect which is present."""
        groups = [(case.answer, group) for case in self.cases for group in case.told.groups]
        return Share(sum(any(map(answer.present, group)) for answer, group in groups), len(groups))

    @property
    def seconds(self) -> Estimate:
        """Median a session; nan where none tells."""
        return median([case.told.seconds for case in self.cases if case.told.seconds is not None])

    def to_json(self) -> dict[str, Any]:
        """Plain numbers."""
        return {
            "sessions": len(self.cases),
            "headline": {name: share.to_json() for name, share in self.headline.items()},
            "clear_alone": {name: share.to_json() for name, share in self.clear_alone.items()},
            "reachable": self.reachable,
            "by_detectability": {f"{level:g}": share.to_json() for level, share in self.by_detectability.items()},
            "by_effect": {name: share.to_json() for name, share in self.by_effect.items()},
            "in_three_by_detectability": {
                f"{level:g}": share.to_json() for level, share in self.in_three_by_detectability.items()
            },
            "in_three_by_effect": {name: share.to_json() for name, share in self.in_three_by_effect.items()},
            "confusion": self.confusion,
            "look_alikes": self.look_alikes,
            "reliability": self.reliability.to_json(),
            "calibration_error": self.calibration_error.to_json(),
            "calibration_error_of_suspects": self.calibration_error_of_suspects.to_json(),
            "calibration_error_by_chance": self.calibration_error_by_chance.to_json(),
            "wrong_name_said": self.wrong_said.to_json(),
            "said_right": self.said_right.to_json(),
            "share_on_stage": self.share_on_stage.to_json(),
            "shrinkage_of_oracle": self.shrinkage_of_oracle.to_json(),
            "seconds": self.seconds.to_json(),
        }


def scored(answers: Sequence[Answer], told: Sequence[Told]) -> Score:
    """Of sessions in one order."""
    return Score(tuple(Case(answer, each) for answer, each in zip(answers, told, strict=True)))


def _reliability(cases: Sequence[Case], least: float) -> Reliability:
    told = _probabilities(cases, least)
    return Reliability.of(np.array([p for p, _ in told]), np.array([present for _, present in told], bool))


def _probabilities(cases: Sequence[Case], least: float) -> list[tuple[float, bool]]:
    """All from some size on, and whether each came true."""
    return [(p, case.answer.present(name)) for case in cases for name, p in case.told.chances.items() if p >= least]


def _level(answer: Answer) -> float:
    """The level that an effect was made for, as far as it reached it; 0 below the lowest."""
    return max((level for level in DETECTABILITIES if answer.detectability >= _ALMOST * level), default=0.0)


def _of(kind: str) -> Callable[[Case], bool]:
    return lambda case: case.answer.kind == kind


def _at(level: float) -> Callable[[Case], bool]:
    return lambda case: case.answer.kind == "single" and _level(case.answer) == level


def _is(name: str) -> Callable[[Case], bool]:
    return lambda case: clear(case) and case.answer.effects[0] == name


def clear(case: Case) -> bool:
    """Whether a session holds one effect that its data tell from every other."""
    return case.answer.kind == "single" and _is_clear(case.answer)


def _is_clear(answer: Answer) -> bool:
    return _level(answer) >= CLEAR


def _clear_of(kind: str) -> Callable[[Case], bool]:
    return lambda case: case.answer.kind == kind and _is_clear(case.answer)


def _holds_applies(case: Case) -> bool:
    """What was fitted reaches what the true effects reach only where noise moves its parameters little: at a
    detectability of d the error of a parameter costs at most about 1 / d^2 of the shrinkage, 4 % at five.
    """
    if _level(case.answer) < CLEAR:
        return False
    right = bool(case.answer.effects) and set(case.answer.effects) == set(case.told.names)
    return right and case.answer.oracle_shrinkage is not None and case.told.interval is not None


def _holds(case: Case) -> bool:
    (low, high), true = case.told.interval or (np.nan, np.nan), case.answer.oracle_shrinkage
    return true is not None and bool(low <= true <= high)
