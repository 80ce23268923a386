"""Policies that steer the calibrated twin: a function a command of `calib policy`, and that of `calib aquarium`.

The same in all: `session` has a fit; `task` is "target", reach random targets, or "circle", follow one of 1 m;
`policy_file` is an npz, by default the one trained for this session and task; `seed` is that of all draws; `workers`
are threads, 0 for all cores.

Example:
    >>> calib.policy.train("pool", "circle", effort="quick").to_frame().index.tolist()
    ['paper', 'search']
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from calib.given import AnySession, folder_of
from calib.options import EffortName
from swimcal.errors import Fault, InputError
from swimcal.session import load_session

if TYPE_CHECKING:
    import pandas as pd

    from swimgym.aquarium import Shoal
    from swimgym.course import Course
    from swimgym.policy import Policy, Swum
    from swimgym.swimmers import Fish

__all__ = ["PolicyScores", "aquarium", "evaluate", "play", "train"]

TaskName = Literal["target", "circle"]
PAPER = {
    "target": {"reached": 0.93, "episodes": 100},
    "circle": {"off_path_mean_m": 0.009, "off_path_max_m": 0.023},
}
"""Scores of "Simple Models, Real Swimming" (2026)."""
EPISODES = {"target": 1000, "circle": 2}
TEST_SEED = 1_000_003
"""Seed of goals that no training sees."""


@dataclass(frozen=True)
class PolicyScores:
    """The scores of policies.

    Attributes:
        file: file of the policy.
        rows: scores, in m and s, of each policy or controller; "paper" has the published numbers.

    Example:
        >>> from swimgym.policy import SHIPPED
        >>> scores = calib.policy.evaluate("pool", "target", SHIPPED / "target", episodes=1)
        >>> scores.rows["paper"]["reached"]
        0.93
    """

    file: Path
    rows: Mapping[str, Mapping[str, Any]]

    def to_frame(self) -> pd.DataFrame:
        """Make a table with a row for each policy or controller."""
        import pandas as pd

        return pd.DataFrame.from_dict(dict(self.rows), orient="index")


def train(
    session: AnySession,
    task: TaskName = "target",
    method: Literal["search", "sac"] = "search",
    effort: EffortName = "full",
    *,
    draws: int = 0,
    seed: int = 0,
    workers: int = 0,
    progress: bool = True,
) -> PolicyScores:
    """Train a policy on the session's twin and score it; when stopped, it continues from where it was.

    It writes `results/policy/<task>.npz`, its card `<task>.json` and, for the report, how it swam.

    Args:
        session: a session with a fit, opened, or its folder.
        task: "target", reach random targets, or "circle", follow a circle of 1 m.
        seed: seed of all draws.
        workers: threads; 0 for all cores.
        method: "search": a steering law, in minutes; "sac": a network, needs swimcal[policies].
        effort: how hard to search, and on how many targets it is scored.
        draws: number of draws of the posterior to train on; 0: the fit alone.
        progress: show the progress on standard error.

    Raises:
        InputError: there is no fit, no posterior to draw from, or what "sac" needs is not installed.

    Example:
        >>> scores = calib.policy.train("pool", "circle", effort="quick")
        >>> scores.file.name
        'circle.npz'
    """
    from calib.progress_bar import progress_bar
    from swimgym.swimmers import load_fish

    folder, quick = _folder(session), effort == "quick"
    fish, file = load_fish(folder, draws=draws, seed=seed), policy_file_of(folder, task)
    with progress_bar(not progress) as report:
        trained = _train_policy(fish, task, method, quick, seed, workers, file, report)
        report("scoring", None)
        swum = _swim_policy(load_fish(folder), task, trained, EPISODES[task] // (5 if quick else 1) or 1, workers)
    trained.scored(swum.scores()).save(file)
    swum.save(file.with_suffix(".swims.npz"))
    for kept in ("search.json", "sac.zip", "sac.buffer.pkl"):
        _state(file, kept).unlink(missing_ok=True)
    return PolicyScores(file, {"paper": PAPER[task], method: swum.scores()})


def evaluate(
    session: AnySession,
    task: TaskName = "target",
    policy_file: str | Path | None = None,
    *,
    episodes: int = 0,
    seed: int = TEST_SEED,
    workers: int = 0,
) -> PolicyScores:
    """Score a policy on the session's twin, next to the paper's.

    Args:
        session: a session with a fit, opened, or its folder.
        task: "target", reach random targets, or "circle", follow a circle of 1 m.
        policy_file: the npz of the policy; default: the one trained for this session and task.
        seed: seed of all draws.
        workers: threads; 0 for all cores.
        episodes: number of episodes; 0: 1,000 targets, or a circle to either side.

    Raises:
        InputError: there is no fit, no such policy, or one of another task.
        ModelMismatch: a policy of another robot or engine.

    Example:
        >>> from swimgym.policy import SHIPPED
        >>> calib.policy.evaluate("pool", "target", SHIPPED / "target", episodes=1).to_frame().index.tolist()
        ['paper', 'search']
    """
    from swimgym.policy import load_policy
    from swimgym.swimmers import load_fish

    folder = _folder(session)
    fish, file = load_fish(folder), Path(policy_file or policy_file_of(folder, task))
    loaded = load_policy(file)
    swum = _swim_policy(fish, task, loaded, episodes or EPISODES[task], workers, seed, str(file))
    return PolicyScores(file, {"paper": PAPER[task], loaded.card.method: swum.scores()})


def play(
    session: AnySession,
    out: str | Path = "policy.mp4",
    task: TaskName = "target",
    policy_file: str | Path | None = None,
    *,
    target: tuple[float, float] | None = None,
    seed: int = 0,
) -> Swum:
    """Film a policy on the session's twin: one episode, drawn from above.

    Args:
        session: a session with a fit, opened, or its folder.
        task: "target", reach random targets, or "circle", follow a circle of 1 m.
        policy_file: the npz of the policy; default: the one trained for this session and task.
        seed: seed of all draws.
        out: the film: .mp4, .gif or .rrd.
        target: x, y in m from the start, the robot heading along -x; default: random.

    Returns:
        The episode.

    Raises:
        InputError: there is no fit, no such policy, or it misses the target.
        ModelMismatch: a policy of another robot or engine.

    Example:
        >>> from swimgym.policy import SHIPPED
        >>> swum = calib.policy.play("pool", "reach.rrd", policy_file=SHIPPED / "target", target=(-1.0, 0.2))
        >>> bool(swum.seconds[0] > 1)
        True
    """
    from swimgym.aquarium import check_kind, write_shoal
    from swimgym.aquarium import play as played
    from swimgym.policy import load_policy
    from swimgym.swimmers import load_fish

    check_kind(Path(out))
    folder = _folder(session)
    fish, file = load_fish(folder), Path(policy_file or policy_file_of(folder, task))
    loaded = load_policy(file)
    swum, seen = played(_course(fish, task, 1, loaded, 1, str(file)), loaded.act, target, seed)
    write_shoal(seen, Path(out))
    return swum


def aquarium(
    session: AnySession | None = None,
    swimmers: int = 200,
    seconds: float = 20.0,
    out: str | Path = "aquarium.mp4",
    *,
    draws: int = 0,
    policy_file: str | Path | None = None,
    seed: int = 0,
    workers: int = 0,
) -> Shoal:
    """Let many swimmers roam one pool, and tell how many swim in real time.

    Args:
        session: a session with a fit; default: the built-in robot.
        swimmers: number of swimmers.
        seconds: how long they swim.
        out: the file to write: .rrd (Rerun), .mp4 or .gif.
        draws: number of draws of the posterior, dealt out to the swimmers; 0: the fit alone.
        policy_file: the policy that steers them; default: that of the session, else plain beats.
        seed: seed of all draws.
        workers: threads; 0 for all cores.

    Raises:
        InputError: there is no fit, no posterior to draw from, no such policy, or another kind of file.

    Example:
        >>> shoal = calib.policy.aquarium(swimmers=4, seconds=1, out="four.rrd")
        >>> shoal.in_real_time > 4
        True
    """
    from swimgym.aquarium import check_kind, swim_together, write_shoal
    from swimgym.policy import load_policy
    from swimgym.swimmers import load_fish

    check_kind(Path(out))
    folder = None if session is None else _folder(session)
    fish = load_fish(folder, draws=draws, seed=seed)
    own = None if folder is None else policy_file_of(folder, "target")
    file = Path(policy_file) if policy_file else own if own is not None and own.is_file() else None
    steers = None if file is None else load_policy(file)
    if steers is not None:
        _course(fish, "target", 1, steers, 1, str(file))
    shoal = swim_together(fish, swimmers, seconds, policy=steers, seed=seed, workers=workers)
    write_shoal(shoal, Path(out))
    return shoal


def policy_file_of(session: Path, task: str) -> Path:
    """Return the path of the policy of a session and a task."""
    return session / "results" / "policy" / f"{task}.npz"


def _folder(session: AnySession) -> Path:
    folder = folder_of(session)
    return folder if folder.is_dir() else load_session(folder).folder  # which tells what is missing


def _state(file: Path, ending: str) -> Path:
    return file.with_name(f"{file.stem}.{ending}")


def _course(fish: Fish, task: str, count: int, loaded: Policy, workers: int, file: str) -> Course:
    """Make the course of a policy, which is refused where it does not fit."""
    from swimgym.course import make_course

    if loaded.card.task != task:
        step = f"Give --task {loaded.card.task}, or another policy."
        raise InputError([Fault(file, "", "a policy of another task", loaded.card.task, task, next_step=step)])
    course = make_course(task, count, fish=fish, rules=loaded.card.rules, workers=workers)
    loaded.check(fish, course, file)
    return course


def _train_policy(
    fish: Fish, task: str, method: str, quick: bool, seed: int, workers: int, file: Path, progress: Any
) -> Policy:
    if method == "search":
        from swimgym.policy import SearchPlan, search

        plan = SearchPlan(6 if quick else 12, 16 if quick else 32, {"target": 16, "circle": 2}[task], seed=seed)
        return search(fish, task, plan, state_file=_state(file, "search.json"), workers=workers, progress=progress)
    if find_spec("stable_baselines3") is None:
        step = "Install them with `make policies`, or pip install 'swimcal[policies]'; or give --method search."
        raise InputError(
            [Fault("--method", "", "stable-baselines3 and torch are not here", "sac", "both", next_step=step)]
        )
    from swimgym.sac import SacPlan, train_sac

    plan_sac = SacPlan(steps=70_000 if quick else 400_000, every=10_000, seed=seed)
    return train_sac(fish, task, plan_sac, state_file=_state(file, "sac.zip"), workers=workers, progress=progress)


def _swim_policy(
    fish: Fish, task: str, loaded: Policy, episodes: int, workers: int, seed: int = TEST_SEED, file: str = "the policy"
) -> Swum:
    from swimgym.policy import swim

    return swim(_course(fish, task, episodes, loaded, workers, file), loaded.act, seed)
