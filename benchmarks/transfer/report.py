"""`calib benchmark transfer`: success and circle error by arm, the share of the gap that each closes, and S."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import spearmanr

from benchmarks.cases import Failure
from benchmarks.effects.folder import DIAGNOSIS, SuiteFolder
from benchmarks.effects.scored_diagnosis import read_diagnosis
from benchmarks.scores import Scores, Table, resampled
from benchmarks.transfer.laws import LAP_S, SLOW_M, TEST_S, OnRobot
from benchmarks.transfer.run import flocks

_NEAR_M = 0.05  # mean distance up to which a lap counts
_BLOWN_UP_S = 1.0  # no robot loses its circle so soon
_WORDS = {
    "shipped": "law of the sample, as it is",
    "published": "(a) published coefficients",
    "calibrated": "(b) calibrated twin",
    "randomised": "(c) twin drawn about the fit",
    "effects": "(d) with the named effects",
    "reality": "(e) the robot itself",
}


@dataclass(frozen=True)
class Pupil:
    """A robot, with what came of each arm."""

    name: str  # of its session
    tested: Mapping[str, OnRobot]  # by arm
    skill: (
        float  # S of its diagnosis, by which the gap of held-out swims shrinks; 0 where nothing is named, nan unknown
    )

    def log_error(self, arm: str) -> float:
        """Logarithm of its mean distance from the circle, mm."""
        return float(np.log(1000 * np.mean(self.tested[arm].off_m)))

    def log_cost(self, arm: str) -> float:
        """Logarithm of what the searches were asked to make small, but for the largest distance, mm."""
        found = self.tested[arm]
        lap_s = np.where(found.lapped, found.seconds, TEST_S)
        return float(np.log(1000 * np.mean(found.off_m + SLOW_M * np.maximum(1 - LAP_S / lap_s, 0.0))))

    def success(self, arm: str) -> float:
        """Share of episodes with a lap in time, near the circle."""
        found = self.tested[arm]
        return float(np.mean(np.array(found.lapped) & (np.array(found.off_m) <= _NEAR_M)))


Measure = Callable[[Pupil, str], float]
ERROR, COST = Pupil.log_error, Pupil.log_cost


def pupils(suite: SuiteFolder) -> tuple[tuple[Pupil, ...], tuple[str, ...]]:
    """Robots that all arms but the last were tested on; and the names of those that their own simulator cannot swim.

    Where a diagnosis named nothing that a model can hold, arm (d) is arm (b).
    """
    found: dict[str, dict[str, OnRobot]] = {}
    for flock in flocks(suite).every().values():
        for name, own in flock.robots.items():
            found.setdefault(name, {})[flock.arm] = own
    whole, lost = [], []
    for name, tested in sorted(found.items()):
        diagnosis = suite.sessions / name / DIAGNOSIS
        made = read_diagnosis(diagnosis) if diagnosis.exists() else None
        if made is not None and "calibrated" in tested:
            tested.setdefault("effects", tested["calibrated"])
        skill = float("nan") if made is None or (made.names and made.shrinkage is None) else made.shrinkage or 0.0
        if max(max(each.seconds) for each in tested.values()) < _BLOWN_UP_S:
            lost.append(name)
        else:
            whole.append(Pupil(name, tested, skill))
    return tuple(whole), tuple(lost)


def scores_of(suite: SuiteFolder, command: str, failures: Sequence[Failure] = ()) -> Scores:
    """All tables."""
    found, lost = pupils(suite)
    tables = [_arms(found), _gaps(found)]
    if rows := _skills(found):
        tables.append(Table("Does S tell? Rank correlation over robots", ("S against", "robots", "Spearman"), rows))
    notes = [
        "Circle of 1 m, four episodes a robot: to either side, from headings up to 0.2 rad askew; no search saw them. "
        f"Success: a lap in 80 s, at most {1000 * _NEAR_M:.0f} mm off in the mean.",
        "All searches begin at the law of the sample: 6 generations of 12 candidates, half a lap to either side.",
        f"Cost: mean distance, and {SLOW_M:g} m times the share by which a lap falls short of one in {LAP_S:.0f} s. "
        "The searches weigh the largest distance too. Error alone is not comparable: who swims slowly keeps nearer.",
        "Error and cost are geometric means over robots; 95 % intervals by drawing robots anew. Shares of the gap are "
        "those of the logarithms: 0 % is (a), 100 % is (e).",
    ]
    if named := [each for each in _with(found, "effects") if each.tested["effects"] is not each.tested["calibrated"]]:
        over = resampled(named, partial(_over, by=COST, arm="effects", of="calibrated"))
        notes.append(
            f"Effects that a model can hold were named in {len(named)} robots: (d) over (b) {over}. Elsewhere (d) "
            "is (b), and S is 0 where nothing was named, so that some of its correlation is there by definition."
        )
    if lost:
        notes.append(f"Left out: {', '.join(lost)}, which diverges in the second simulator at the step used here.")
    notes += [f"{failure.name} failed: {failure.message}." for failure in failures]
    data = "synthetic: robots of the second simulator with withheld effects; no twin knows what acts in them"
    return Scores("Transfer", data, command, tuple(tables), tuple(notes))


def _with(found: Sequence[Pupil], *arms: str) -> list[Pupil]:
    return [pupil for pupil in found if all(arm in pupil.tested for arm in arms)]


def _arms(found: Sequence[Pupil]) -> Table:
    rows = []
    for arm, words in _WORDS.items():
        if own := _with(found, arm, "published"):
            success = resampled(own, partial(_success, arm=arm))
            error, cost = (resampled(own, partial(_over, by=by, arm=arm)) for by in (ERROR, COST))
            lap = f"{np.mean([pupil.tested[arm].seconds for pupil in own]):.0f}"
            rows.append((words, str(len(own)), *map(str, (success, error, lap, cost))))
    head = ("law searched on", "robots", "success, %", "error, mm", "lap, s", "cost, mm")
    return Table("Tested on the robot", head, tuple(rows))


def _gaps(found: Sequence[Pupil]) -> Table:
    rows = []
    for arm, words in _WORDS.items():
        if own := _with(found, arm, "published", "shipped", "reality"):
            over = [
                "1" if arm == of else str(resampled(own, partial(_over, by=by, arm=arm, of=of)))
                for by, of in ((COST, "shipped"), (COST, "published"), (ERROR, "published"))
            ]
            better = sum(pupil.log_cost(arm) < pupil.log_cost("published") for pupil in own)
            closed = str(resampled(own, partial(_closed, arm=arm)))
            rows.append((words, *over, f"{better} of {len(own)}", "0" if arm == "published" else closed))
    head = ("", "cost over that of the law as it is", "over (a)", "error over (a)", "cheaper than (a)", "gap closed, %")
    return Table(
        "Robot by robot, and the share of the gap in cost between (a) and (e) that is closed", head, tuple(rows)
    )


def _skills(found: Sequence[Pupil]) -> tuple[tuple[str, ...], ...]:
    """Whether the diagnosis' S goes with what calibration or effects gained."""
    known = [pupil for pupil in _with(found, "calibrated", "effects", "reality") if np.isfinite(pupil.skill)]
    pairs = {
        "what calibration gains over (a)": ("published", "calibrated"),
        "what effects gain over (b)": ("calibrated", "effects"),
        "what is left between (b) and (e)": ("calibrated", "reality"),
    }
    return tuple(
        (label, str(len(known)), str(resampled(known, partial(_rank, before=before, after=after))))
        for label, (before, after) in pairs.items()
        if known
    )


def _success(drawn: Sequence[Pupil], arm: str) -> float:
    return float(100 * np.mean([pupil.success(arm) for pupil in drawn]))


def _over(drawn: Sequence[Pupil], by: Measure, arm: str, of: str = "") -> float:
    """Geometric mean; of an arm over another, where one is given."""
    return float(np.exp(_log(drawn, by, arm) - (_log(drawn, by, of) if of else 0.0)))


def _log(drawn: Sequence[Pupil], by: Measure, arm: str) -> float:
    return float(np.mean([by(pupil, arm) for pupil in drawn]))


def _closed(drawn: Sequence[Pupil], arm: str) -> float:
    """Share of the gap in cost, %."""
    a, x, e = (_log(drawn, COST, each) for each in ("published", arm, "reality"))
    return 100 * (a - x) / (a - e)


def _rank(drawn: Sequence[Pupil], before: str, after: str) -> float:
    """Spearman's correlation of S with the cost that is gained; nan where all are alike."""
    gains = np.array([pupil.log_cost(before) - pupil.log_cost(after) for pupil in drawn])
    skills = np.array([pupil.skill for pupil in drawn])
    alike = np.ptp(gains) == 0 or np.ptp(skills) == 0
    return float("nan") if alike else float(spearmanr(skills, gains).statistic)
