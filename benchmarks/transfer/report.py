"""`calib benchmark transfer`: success, and error or time, by arm, the share of the gap that each closes, and S."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.stats import spearmanr

from benchmarks.cases import Failure
from benchmarks.effects.folder import DIAGNOSIS, SuiteFolder
from benchmarks.effects.scored_diagnosis import read_diagnosis
from benchmarks.scores import Scores, Table, resampled
from benchmarks.transfer.laws import CANDIDATES, GENERATIONS, LAP_S, SLOW_M, TASKS, OnRobot
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
    task: str  # of `TASKS`
    tested: Mapping[str, OnRobot]  # by arm
    skill: (
        float  # S of its diagnosis, by which the gap of held-out swims shrinks; 0 where nothing is named, nan unknown
    )

    def log_error(self, arm: str) -> float:
        """Logarithm of its mean distance from the circle, mm."""
        return float(np.log(1000 * np.mean(self.tested[arm].off_m)))

    def log_cost(self, arm: str) -> float:
        """Logarithm of what the searches were asked to make small: of time to a target, s, an episode where it fails.

        On a circle of the mean distance and the lack of pace, mm, without the largest distance.
        """
        found = self.tested[arm]
        took_s = np.where(found.reached, found.seconds, TASKS[self.task].test_s)
        if self.task == "target":
            return float(np.log(np.mean(took_s)))
        return float(np.log(1000 * np.mean(found.off_m + SLOW_M * np.maximum(1 - LAP_S / took_s, 0.0))))

    def success(self, arm: str) -> float:
        """Share of episodes with the target reached, or a lap near the circle, in time."""
        found = self.tested[arm]
        near = self.task == "target" or np.array(found.off_m) <= _NEAR_M
        return float(np.mean(np.array(found.reached) & near))


Measure = Callable[[Pupil, str], float]
COST = Pupil.log_cost
_MEASURES: Mapping[str, Mapping[str, Measure]] = {
    "circle": {"cost, mm": COST, "error, mm": Pupil.log_error},
    "target": {"time, s": COST},
}


def pupils(suite: SuiteFolder, task: str) -> tuple[tuple[Pupil, ...], tuple[str, ...]]:
    """Robots that all arms but the last were tested on; and the names of those that their own simulator cannot swim.

    Where a diagnosis named nothing that a model can hold, arm (d) is arm (b).
    """
    found: dict[str, dict[str, OnRobot]] = {}
    for flock in (each for each in flocks(suite).every().values() if each.task == task):
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
            whole.append(Pupil(name, task, tested, skill))
    return tuple(whole), tuple(lost)


def scores_of(suite: SuiteFolder, task: str, failures: Sequence[Failure] = ()) -> Scores:
    """All tables of a task."""
    found, lost = pupils(suite, task)
    tables = [_arms(found, task), _gaps(found, task)]
    if rows := _skills(found):
        tables.append(Table("Does S tell? Rank correlation over robots", ("S against", "robots", "Spearman"), rows))
    plan = TASKS[task]
    swum = {
        "circle": f"Circle of 1 m, {plan.tested} episodes a robot: to either side, from headings up to 0.2 rad askew; "
        f"no search saw them. Success: a lap in {plan.test_s:.0f} s, at most {1000 * _NEAR_M:.0f} mm off in the mean.",
        "target": f"{plan.tested} targets in 4 m x 4 m ahead, the same for all robots; no search saw them. Success: "
        f"within 50 mm in {plan.test_s:.0f} s; a target that is not reached counts with all of these.",
    }
    cost = {
        "circle": f"Cost: mean distance, and {SLOW_M:g} m times the share by which a lap falls short of one in "
        f"{LAP_S:.0f} s. The searches weigh the largest distance too. Error alone is not comparable: who swims slowly "
        "keeps nearer.",
        "target": "The searches count what is left of the way to a target that is not reached too.",
    }
    notes = [
        swum[task],
        f"All searches begin at the law of the sample: {GENERATIONS} generations of {CANDIDATES} candidates, "
        f"{plan.episodes} episodes of {plan.seconds:.0f} s each.",
        cost[task],
        "Error, cost and time are geometric means over robots; 95 % intervals by drawing robots anew. Shares of the "
        "gap are those of the logarithms: 0 % is (a), 100 % is (e).",
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
    title = "Transfer" if task == "circle" else "Transfer: targets"
    command = f"calib benchmark transfer --folder FOLDER --task {task}"
    return Scores(title, data, command, tuple(tables), tuple(notes))


def _with(found: Sequence[Pupil], *arms: str) -> list[Pupil]:
    return [pupil for pupil in found if all(arm in pupil.tested for arm in arms)]


def _arms(found: Sequence[Pupil], task: str) -> Table:
    rows = []
    for arm, words in _WORDS.items():
        if own := _with(found, arm, "published"):
            success = resampled(own, partial(_success, arm=arm))
            measures = [resampled(own, partial(_over, by=by, arm=arm)) for by in _MEASURES[task].values()]
            lap = [f"{np.mean([pupil.tested[arm].seconds for pupil in own]):.0f}"] if task == "circle" else []
            rows.append((words, str(len(own)), str(success), *map(str, measures), *lap))
    laps = ["lap, s"] if task == "circle" else []
    return Table(
        "Tested on the robot", ("law searched on", "robots", "success, %", *_MEASURES[task], *laps), tuple(rows)
    )


def _gaps(found: Sequence[Pupil], task: str) -> Table:
    of = {"that of the law as it is": "shipped", "(a)": "published"}
    rows = []
    for arm, words in _WORDS.items():
        if own := _with(found, arm, "published", "shipped", "reality"):
            over = [
                "1" if arm == other else str(resampled(own, partial(_over, by=by, arm=arm, of=other)))
                for by in _MEASURES[task].values()
                for other in of.values()
            ]
            better = sum(pupil.log_cost(arm) < pupil.log_cost("published") for pupil in own)
            closed = str(resampled(own, partial(_closed, arm=arm)))
            rows.append((words, *over, f"{better} of {len(own)}", "0" if arm == "published" else closed))
    measures = [name.split(",")[0] for name in _MEASURES[task]]
    head = ("", *(f"{name} over {other}" for name in measures for other in of), "better than (a)", "gap closed, %")
    return Table(
        f"Robot by robot, and the share of the gap in {measures[0]} between (a) and (e) that is closed",
        head,
        tuple(rows),
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
