"""Works off the arms: which model a law is searched on. What was searched and tested once is kept in the suite."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.cases import Failure, Records, Run, run_cases
from benchmarks.effects.diagnosing import diagnose_one, program_of
from benchmarks.effects.folder import DIAGNOSIS, SuiteFolder
from benchmarks.effects.suite import SessionPlan
from benchmarks.reality import World
from benchmarks.transfer.laws import Make, OnRobot, searched, shipped_law, tested
from benchmarks.transfer.robots import Robot, draw_robots, in_the_pool, load_worlds, plans
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from fitting.calibration_file import CALIBRATION
from fitting.model.forecast import NORMAL_90
from swimgym import Fish, Swimmers, load_fish

ARMS = ("shipped", "published", "calibrated", "reality", "randomised", "effects")
"""The law of the sample session as it is; laws searched on the published coefficients, the fit, the robot itself, draws
about the fit, and the fit with the effects that were named. In the order in which they are worked off."""
_TOGETHER = 12  # robots: a step of many costs little more than one of one


@dataclass(frozen=True)
class Flock:
    """Robots that were searched for and tested together, by one arm."""

    task: str  # of `TASKS`
    arm: str  # see `ARMS`
    robots: dict[str, OnRobot]  # by session


@dataclass(frozen=True)
class _Case:
    suite: Path
    task: str
    arm: str
    seed: int  # of the search on the published coefficients, which is one for all of them
    robots: dict[str, Robot]
    plans: dict[str, SessionPlan]


def work_off(
    suite: SuiteFolder, count: int, made_by: tuple[int, str], task: str, arms: Sequence[str], run: Run
) -> tuple[Failure, ...]:
    """Searches and tests what is missing.

    Args:
        suite: fits and diagnoses are written into its sessions.
        count: robots, the first of the suite.
        made_by: its seed, and which suite or part of one it is.
        task: of `TASKS`.
        arms: of `ARMS`.
        run: how.

    Returns:
        What failed; the next run tries it again.

    Raises:
        InputError: there is no whole suite.
    """
    of = plans(*made_by)
    names = suite.names[:count]
    kept = Records(suite.folder / "transfer" / "robots", Robot)
    for name, made in draw_robots([of[name] for name in kept.missing(names)]).items():
        kept.keep(name, made)
    robots = {name: robot for name in names if (robot := kept.read(name)) is not None}
    records, cases = flocks(suite), {}
    for arm in arms:
        done = {
            name
            for flock in records.every().values()
            if (flock.task, flock.arm) == (task, arm)
            for name in flock.robots
        }
        todo = [name for name in robots if name not in done]
        for first in range(0, len(todo), _TOGETHER):
            group = {name: robots[name] for name in todo[first : first + _TOGETHER]}
            cases[f"{task}-{arm}-{todo[first]}"] = _Case(suite.folder, task, arm, first // _TOGETHER, group, of)
    return run_cases(_flock, cases, run, records.keep)


def flocks(suite: SuiteFolder) -> Records[Flock]:
    """What was searched and tested."""
    return Records(suite.folder / "transfer" / "flocks", Flock)


def _flock(case: _Case) -> Flock:
    suite = SuiteFolder(case.suite)
    robots = {name: robot for name, robot in case.robots.items() if case.arm != "effects" or _named(suite, name)}
    if not robots:
        return Flock(case.task, case.arm, {})
    worlds = load_worlds(suite, robots, case.plans)
    laws, promised = _laws(case, suite, tuple(robots), worlds)
    found = tested(partial(in_the_pool, worlds), case.task, laws, promised)
    return Flock(case.task, case.arm, dict(zip(robots, found, strict=True)))


def _laws(
    case: _Case, suite: SuiteFolder, names: tuple[str, ...], worlds: tuple[World, ...]
) -> tuple[np.ndarray, np.ndarray]:
    """(r, p) laws and (r,) what they promise."""
    task, arm, count = case.task, case.arm, len(names)
    if arm == "shipped":
        return np.tile(shipped_law(task), (count, 1)), np.full(count, np.nan)
    if arm == "reality":
        return searched(lambda _, episodes, candidates: in_the_pool(worlds, episodes * candidates), task, count)
    if arm == "published":
        law, cost = searched(_twins([load_fish()], None), task, 1, case.seed)
        return np.tile(law, (count, 1)), np.tile(cost, count)
    for name in names:
        Pipeline(open_session(suite.sessions / name), Options("quick", workers=1)).fit()
    fishes = [load_fish(suite.sessions / name, effects=arm == "effects") for name in names]
    return searched(_twins(fishes, suite if arm == "randomised" else None, names), task, count)


def _twins(fishes: Sequence[Fish], drawn: SuiteFolder | None, names: tuple[str, ...] = ()) -> Make:
    """Twins to search on; of sessions whose fit is drawn, another draw in every episode."""

    def make(generation: int, episodes: int, candidates: int) -> Swimmers:
        random = np.random.default_rng([generation, 17])
        models = []
        for _ in range(episodes):
            own = list(fishes)
            if drawn is not None:
                own = [_drawn(fish, drawn.sessions / name, random) for fish, name in zip(own, names, strict=True)]
            models += [fish.models[0] for fish in own] * candidates
        return Swimmers(models, len(models), workers=1)

    return make


def _drawn(fish: Fish, session: Path, random: np.random.Generator) -> Fish:
    """With coefficients by the curvature of the fit's posterior at its mode, each by itself."""
    fit = CALIBRATION.read(session / "results").fit
    sd = np.diff(fit.interval, axis=1)[:, 0] / (2 * NORMAL_90)
    return fish.with_coefficients(np.maximum(random.normal(list(fit.coefficients), sd), 1e-3))


def _named(suite: SuiteFolder, name: str) -> bool:
    """Whether a session's diagnosis, made here where it is missing, named effects that a model can hold."""
    session = suite.sessions / name
    if not (session / DIAGNOSIS).exists():
        diagnose_one(program_of(""), suite.discrepancy, (session, frozenset()))
    return any((session / "results").glob("calibrated+*.xml"))
