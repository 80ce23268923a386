"""Commands about swimming on purpose: `policy train`, `policy evaluate`, `policy play`, `aquarium`, `benchmark gym`."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from calib.commands.arguments import AsJson, Effort, SessionFolder, Workers

if TYPE_CHECKING:
    from swimgym.course import Course
    from swimgym.policy import Policy
    from swimgym.source import Fish

TaskName = Annotated[Literal["target", "circle"], typer.Option(help="reach random targets, or follow a circle of 1 m")]
PolicyFile = Annotated[
    Path | None, typer.Option("--policy", help="its npz; default: the one trained for this session and task")
]
Seed = Annotated[int, typer.Option(min=0, help="of all draws")]
PAPER = {
    "target": {"reached": 0.93, "episodes": 100},
    "circle": {"off_path_mean_m": 0.009, "off_path_max_m": 0.023},
}
"""Of "Simple Models, Real Swimming" (2026)."""
EPISODES = {"target": 1000, "circle": 2}
_TEST_SEED = 1_000_003  # goals that no training sees
policy = typer.Typer(
    rich_markup_mode=None, no_args_is_help=True, help="Policies that steer the twin: trained, scored and shown."
)


def train(
    session: SessionFolder,
    task: TaskName = "target",
    method: Annotated[
        Literal["search", "sac"],
        typer.Option(help="search: a steering law, in minutes; sac: a network, needs swimcal[policies]"),
    ] = "search",
    effort: Effort = "full",
    draws: Annotated[int, typer.Option(min=0, help="train on so many draws of the posterior; 0: the fit alone")] = 0,
    seed: Seed = 0,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Trains a policy on the session's twin and scores it; stopped, it goes on where it was.

    Writes results/policy/<task>.npz, which needs no torch, and its card <task>.json.
    """
    from calib.progress import progress_bar
    from swimgym.source import load_fish

    fish, file = load_fish(session, draws=draws, seed=seed), _file(session, task)
    with progress_bar(as_json) as progress:
        trained = _trained(fish, task, method, effort == "quick", seed, workers, file, progress)
        progress("scoring", None)
        scores = _scored(
            load_fish(session), task, trained, EPISODES[task] // (5 if effort == "quick" else 1) or 1, workers
        )
    trained = trained.scored(scores)
    trained.save(file)
    for kept in (_state(file, "search.json"), _state(file, "sac.zip"), _state(file, "sac.buffer.pkl")):
        kept.unlink(missing_ok=True)
    _print({"paper": PAPER[task], method: scores}, as_json, file)


def evaluate(
    session: SessionFolder,
    task: TaskName = "target",
    policy_file: PolicyFile = None,
    episodes: Annotated[int, typer.Option(min=0, help="0: 1,000 targets, or a circle to either side")] = 0,
    predictive: Annotated[
        int, typer.Option(min=0, help="also so many episodes of predictive control, which needs no training")
    ] = 0,
    seed: Seed = _TEST_SEED,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Scores a policy on the session's twin, beside the paper's and, if asked for, control by prediction."""
    from swimgym.policy import load_policy
    from swimgym.source import load_fish

    fish, file = load_fish(session), policy_file or _file(session, task)
    rows: dict[str, Any] = {"paper": PAPER[task]}
    if policy_file is not None or file.with_suffix(".npz").is_file() or not predictive:
        loaded = load_policy(file)
        rows[loaded.card.method] = _scored(fish, task, loaded, episodes or EPISODES[task], workers, seed, str(file))
    if predictive:
        rows["predictive"] = _predicted(fish, task, predictive, workers, seed)
    _print(rows, as_json)


def play(
    session: SessionFolder,
    out: Annotated[Path, typer.Option(help="the film: .mp4, .gif or .rrd")] = Path("policy.mp4"),
    task: TaskName = "target",
    policy_file: PolicyFile = None,
    target: Annotated[
        str, typer.Option(help="x,y in m from the start, the robot heading along -x; default: random")
    ] = "",
    seed: Seed = 0,
) -> None:
    """Films a policy on the session's twin: one episode, drawn from above. A target that it misses is an error."""
    from swimgym.aquarium import check_kind, write_shoal
    from swimgym.aquarium import play as played
    from swimgym.policy import load_policy
    from swimgym.source import load_fish

    check_kind(out)
    fish, file = load_fish(session), policy_file or _file(session, task)
    loaded = load_policy(file)
    course = _course(fish, task, 1, loaded, 1, str(file))
    swum, seen = played(course, loaded.act, _place(target) if target else None, seed)
    write_shoal(seen, out)
    print(f"reached after {swum.seconds[0]:.1f} s")
    print(out)


def aquarium(  # noqa: PLR0913
    session: Annotated[
        Path | None, typer.Argument(metavar="[SESSION]", help="a session with a fit; default: the built-in robot")
    ] = None,
    swimmers: Annotated[int, typer.Option(min=1, help="how many")] = 200,
    seconds: Annotated[float, typer.Option(min=0.1, help="how long they swim")] = 20.0,
    out: Annotated[Path, typer.Option(help="the file to write: .rrd (Rerun), .mp4 or .gif")] = Path("aquarium.mp4"),
    draws: Annotated[
        int, typer.Option(min=0, help="of the posterior, dealt out to the swimmers; 0: the fit alone")
    ] = 0,
    policy_file: Annotated[
        Path | None, typer.Option("--policy", help="that steers them; default: that of the session, else plain beats")
    ] = None,
    seed: Seed = 0,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Lets many swimmers roam one pool, and tells how many swim in real time."""
    from swimgym.aquarium import check_kind, swim_together, write_shoal
    from swimgym.policy import load_policy
    from swimgym.source import load_fish

    check_kind(out)
    fish = load_fish(session, draws=draws, seed=seed)
    file = policy_file or (_file(session, "target") if session is not None else None)
    steers = load_policy(file) if file and (policy_file or file.with_suffix(".npz").is_file()) else None
    if steers is not None:
        _course(fish, "target", 1, steers, 1, str(file))
    shoal = swim_together(fish, swimmers, seconds, policy=steers, seed=seed, workers=workers)
    write_shoal(shoal, out)
    told = {"swimmers": swimmers, "seconds": seconds, "wall_s": shoal.wall_s, "in_real_time": shoal.in_real_time}
    if as_json:
        print(json.dumps({**told, "diverged": int(shoal.diverged.sum()), "file": str(out)}, indent=1))
        return
    print(f"{swimmers} swimmers, {seconds:g} s in {shoal.wall_s:.1f} s: {shoal.in_real_time} swim in real time here")
    print(out)


def gym(
    session: Annotated[
        Path | None, typer.Option(help="of this calibrated session; default: the built-in robot")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Steps a second: the vector environment against a process for each environment, in one run."""
    from swimgym.speed import measure_gym_speed

    found = measure_gym_speed({} if session is None else {"session": str(session)})
    print(json.dumps({**asdict(found), "ratio": found.ratio}, indent=1) if as_json else found.table())


_EXAMPLES: dict[Callable[..., None], str] = {
    train: "calib policy train pool --task circle",
    evaluate: "calib policy evaluate pool --predictive 20",
    play: "calib policy play pool --target=-2,0.5 --out reach.mp4",
}
for command, example in _EXAMPLES.items():
    policy.command(epilog=f"Example: {example}")(command)


def _file(session: Path, task: str) -> Path:
    return session / "results" / "policy" / f"{task}.npz"


def _state(file: Path, ending: str) -> Path:
    return file.with_name(f"{file.stem}.{ending}")


def _course(fish: Fish, task: str, count: int, loaded: Policy, workers: int, file: str) -> Course:
    """For a policy, which is refused where it does not fit."""
    from session.errors import Fault, InputError
    from swimgym.making import make_course

    if loaded.card.task != task:
        step = f"Give --task {loaded.card.task}, or another policy."
        raise InputError([Fault(file, "", "a policy of another task", loaded.card.task, task, next_step=step)])
    course = make_course(task, count, fish=fish, rules=loaded.card.rules, workers=workers)
    loaded.check(fish, course, file)
    return course


def _trained(
    fish: Fish, task: str, method: str, quick: bool, seed: int, workers: int, file: Path, progress: Any
) -> Policy:
    if method == "search":
        from swimgym.search import SearchPlan, search

        plan = SearchPlan(6 if quick else 12, 16 if quick else 32, {"target": 16, "circle": 2}[task], seed=seed)
        return search(fish, task, plan, state_file=_state(file, "search.json"), workers=workers, progress=progress)
    from importlib.util import find_spec

    from session.errors import Fault, InputError

    if find_spec("stable_baselines3") is None:
        step = "Install them with `make policies`, or pip install 'swimcal[policies]'; or give --method search."
        raise InputError(
            [Fault("--method", "", "stable-baselines3 and torch are not here", "sac", "both", next_step=step)]
        )
    from swimgym.sac import SacPlan, train_sac

    plan_sac = SacPlan(steps=20_000 if quick else 400_000, every=10_000, seed=seed)
    return train_sac(fish, task, plan_sac, state_file=_state(file, "sac.zip"), workers=workers, progress=progress)


def _scored(
    fish: Fish, task: str, loaded: Policy, episodes: int, workers: int, seed: int = _TEST_SEED, file: str = "the policy"
) -> dict[str, Any]:
    from swimgym.evaluation import swim

    return swim(_course(fish, task, episodes, loaded, workers, file), loaded.act, seed).scores()


def _predicted(fish: Fish, task: str, episodes: int, workers: int, seed: int) -> dict[str, Any]:
    from swimgym.evaluation import swim
    from swimgym.making import make_course
    from swimgym.predictive import Predictive

    course = make_course(task, episodes, fish=fish, workers=workers)
    return swim(course, Predictive(course, fish, seed=seed, workers=workers), seed).scores()


def _place(text: str) -> tuple[float, float]:
    try:
        x, y = (float(number) for number in text.split(","))
    except ValueError as error:
        raise typer.BadParameter(f"found {text!r}, expected x,y in m such as -2,0.5", param_hint="--target") from error
    return x, y


def _print(rows: dict[str, Any], as_json: bool, file: Path | None = None) -> None:
    if as_json:
        print(json.dumps({**rows, **({"file": str(file)} if file else {})}, indent=1))
        return
    for name, scores in rows.items():
        told = [f"{scores['reached']:.1%} of {scores['episodes']} reached"] if "reached" in scores else []
        if "reached_ci95" in scores:
            told[0] += " (95 % interval {:.1%} to {:.1%})".format(*scores["reached_ci95"])
            told.append(f"median {scores['median_s']:.1f} s")
        if "off_path_mean_m" in scores:
            mean, largest = 1000 * scores["off_path_mean_m"], 1000 * scores["off_path_max_m"]
            told.append(f"off the circle {mean:.1f} mm in the mean, {largest:.1f} mm at most")
        print(f"{name}: {', '.join(told)}")
    if file is not None:
        print(file)
