"""Commands about policies and pools: `policy train`, `policy evaluate`, `policy play`, `aquarium`."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import calib
from calib.commands.arguments import AsJson, PolicyEffort, SessionFolder, Workers

TaskName = Annotated[Literal["target", "circle"], typer.Option(help="reach random targets, or follow a circle of 1 m")]
PolicyFile = Annotated[
    Path | None, typer.Option("--policy", help="the policy's npz; default: the one trained for this session and task")
]
Seed = Annotated[int, typer.Option(min=0, help="seed of all draws")]
_TEST_SEED = 1_000_003  # seed of goals that no training sees
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
    effort: PolicyEffort = "full",
    draws: Annotated[
        int, typer.Option(min=0, help="number of draws of the posterior to train on; 0: the fit alone")
    ] = 0,
    seed: Seed = 0,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Train a policy on the session's twin and score it; when stopped, it continues from where it was.

    Writes results/policy/<task>.npz, which needs no torch, and its card <task>.json.
    """
    found = calib.policy.train(
        session, task, method, effort, draws=draws, seed=seed, workers=workers, progress=not as_json
    )
    _print(found.rows, as_json, found.file)


def evaluate(
    session: SessionFolder,
    task: TaskName = "target",
    policy_file: PolicyFile = None,
    episodes: Annotated[
        int, typer.Option(min=0, help="number of episodes; 0: 1,000 targets, or a circle to either side")
    ] = 0,
    seed: Seed = _TEST_SEED,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Score a policy on the session's twin, next to the paper's."""
    found = calib.policy.evaluate(session, task, policy_file, episodes=episodes, seed=seed, workers=workers)
    _print(found.rows, as_json)


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
    """Film a policy on the session's twin: one episode, drawn from above. A target that it misses is an error."""
    swum = calib.policy.play(
        session, out, task, policy_file, target=_parse_place(target) if target else None, seed=seed
    )
    print(f"reached after {swum.seconds[0]:.1f} s")
    print(out)


def aquarium(  # noqa: PLR0913
    session: Annotated[
        Path | None, typer.Argument(metavar="[SESSION]", help="a session with a fit; default: the built-in robot")
    ] = None,
    swimmers: Annotated[int, typer.Option(min=1, help="number of swimmers")] = 200,
    seconds: Annotated[float, typer.Option(min=0.1, help="how long they swim")] = 20.0,
    out: Annotated[Path, typer.Option(help="the file to write: .rrd (Rerun), .mp4 or .gif")] = Path("aquarium.mp4"),
    draws: Annotated[
        int, typer.Option(min=0, help="draws of the posterior, dealt out to the swimmers; 0: the fit alone")
    ] = 0,
    policy_file: Annotated[
        Path | None, typer.Option("--policy", help="policy that steers them; default: the session's, else plain beats")
    ] = None,
    seed: Seed = 0,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Let many swimmers roam one pool, and tell how many swim in real time."""
    shoal = calib.policy.aquarium(
        session, swimmers, seconds, out, draws=draws, policy_file=policy_file, seed=seed, workers=workers
    )
    told = {"swimmers": swimmers, "seconds": seconds, "wall_s": shoal.wall_s, "in_real_time": shoal.in_real_time}
    if as_json:
        print(json.dumps({**told, "diverged": int(shoal.diverged.sum()), "file": str(out)}, indent=1))
        return
    print(f"{swimmers} swimmers, {seconds:g} s in {shoal.wall_s:.1f} s: {shoal.in_real_time} swim in real time here")
    print(out)


_EXAMPLES: dict[Callable[..., None], str] = {
    train: "calib policy train pool --task circle",
    evaluate: "calib policy evaluate pool --task circle",
    play: "calib policy play pool --target=-2,0.5 --out reach.mp4",
}
for command, example in _EXAMPLES.items():
    policy.command(epilog=f"Example: {example}")(command)


def _parse_place(text: str) -> tuple[float, float]:
    try:
        x, y = (float(number) for number in text.split(","))
    except ValueError as error:
        raise typer.BadParameter(f"found {text!r}, expected x,y in m such as -2,0.5", param_hint="--target") from error
    return x, y


def _print(rows: Mapping[str, Mapping[str, Any]], as_json: bool, file: Path | None = None) -> None:
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
