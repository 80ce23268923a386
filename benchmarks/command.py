"""The commands of `python -m benchmarks`."""

import json
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from calib.terminal import AsJson, Scheduler

if TYPE_CHECKING:
    from benchmarks.cases import Failure
    from benchmarks.scores import Scores


def speed(
    session: Annotated[
        Path | None, typer.Option(help="also measure with the coefficients of this calibrated session")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure the twin's speed on one core and on all, and without fluid; and its distance to an 8 times finer step."""
    from benchmarks.speed import measure_speed, speed_table

    outcome = measure_speed(session)
    print(json.dumps(outcome.to_json(), indent=1) if as_json else speed_table(outcome))


def tracking(
    part: Annotated[
        Literal["all", "accuracy", "starts", "damaged", "speed", "fit"],
        typer.Option(
            help="accuracy on every clip; names in clips that begin in full beat; damaged and odd files; speed at 4K; "
            "what the error costs in the fitted coefficients"
        ),
    ] = "all",
    clips: Annotated[str, typer.Option(help="only these clips, comma-separated")] = "",
    folder: Annotated[
        Path | None, typer.Option(help="where rendered videos are kept for the next time; default: nowhere")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Track rendered videos with known truth: the tracker, the tracker without CSRT, plain CSRT."""
    from benchmarks.tracking.report import measure_tracking
    from calib.progress_bar import progress_bar

    chosen = tuple(name.strip() for name in clips.split(",") if name.strip())
    with TemporaryDirectory() if folder is None else nullcontext(folder) as place, progress_bar(as_json) as progress:
        scores = measure_tracking(Path(place), part, chosen, progress)
    _print(scores, as_json)


def posterior(
    folder: Annotated[
        Path | None,
        typer.Option(help="for scores, a file a session; a .jsonl file of scores: only its table; default: nowhere"),
    ] = None,
    first: Annotated[int, typer.Option(min=0, help="first session of this shard")] = 0,
    count: Annotated[int, typer.Option(min=0, help="sessions of this shard; 0: only the table of what is there")] = 300,
    workers: Annotated[int, typer.Option(min=0, help="sessions at a time; 0: one on each core")] = 0,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Draw sessions from the prior; measure how often posteriors hold the truth (simulation-based calibration)."""
    from benchmarks.cases import Run
    from benchmarks.posterior.report import measure_posterior
    from calib.progress_bar import progress_bar

    seeds, command = range(first, first + count), f"python -m benchmarks posterior --folder {folder or 'FOLDER'}"
    with TemporaryDirectory() if folder is None else nullcontext(folder) as place, progress_bar(as_json) as progress:
        outcome = measure_posterior(Path(place), seeds, Run(workers, scheduler, progress))
    _print(outcome.scores(command), as_json)


def effects(
    folder: Annotated[
        Path, typer.Argument(help="of the suite; to score, also a cases.jsonl, of one shard or of several")
    ],
    part: Annotated[
        Literal["make", "diagnose", "withhold", "score"],
        typer.Option(
            help="make the sessions; diagnose them; diagnose those with one effect by a catalogue that lacks it; "
            "score all diagnoses, into scores.json and cases.jsonl"
        ),
    ] = "make",
    suite: Annotated[
        str,
        typer.Option(
            help="small: 24 sessions; large: 700; many: 24, most with five small effects; "
            "wake: 40 of another generator, whose swimmer sheds its wake; "
            "large:2/10: the second tenth of the large one, which others may join"
        ),
    ] = "small",
    seed: Annotated[int, typer.Option(min=0, help="of the suite")] = 0,
    program: Annotated[
        str, typer.Option(help="command that diagnoses, given SESSION [--exclude EFFECT]; default: the toolkit's own")
    ] = "",
    workers: Annotated[int, typer.Option(min=0, help="sessions at a time; 0: one on each core")] = 0,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Make sessions whose effect is withheld from what diagnoses them, have them diagnosed, and score that."""
    if part == "score":
        _score_effects(folder, as_json)
        return
    from benchmarks.cases import Run
    from benchmarks.effects.diagnosing import diagnose_suite, diagnose_without, program_of
    from benchmarks.effects.folder import SuiteFolder
    from benchmarks.effects.run import make_suite
    from benchmarks.effects.suite import suite_named
    from calib.progress_bar import progress_bar

    try:
        size, shard = suite_named(suite)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--suite") from error
    with progress_bar(as_json) as progress:
        of, run = SuiteFolder(folder), Run(workers, scheduler, progress)
        if part == "make":
            failures = make_suite(of, seed, size, run, shard)
        else:
            do = {"diagnose": diagnose_suite, "withhold": diagnose_without}[part]
            failures = do(of, program_of(program), run)
    _print_failures(failures, as_json)


def pairs(
    folder: Annotated[Path, typer.Argument(help="of the pairs")],
    part: Annotated[
        Literal["make", "diagnose", "score"], typer.Option(help="make the pairs; diagnose them; score the diagnoses")
    ] = "make",
    generator: Annotated[
        Literal["reality", "wake"], typer.Option(help="the second simulator, or the swimmer that sheds its wake")
    ] = "reality",
    seed: Annotated[int, typer.Option(min=0, help="of all draws")] = 0,
    healthy: Annotated[int, typer.Option(min=0, help="pairs without a change")] = 20,
    changed: Annotated[int, typer.Option(min=0, help="pairs with one effect in the second session")] = 30,
    workers: Annotated[int, typer.Option(min=0, help="pairs at a time; 0: one on each core")] = 0,
    as_json: AsJson = False,
) -> None:
    """Make pairs of a healthy and a changed session, have the change diagnosed with the reference, and score that."""
    from benchmarks.cases import Run
    from benchmarks.effects.pair_scoring import diagnose_pairs, score_pairs, scores_of
    from benchmarks.effects.pairs import make_pairs, plan_pairs
    from calib.progress_bar import progress_bar

    if part == "make":
        made = len(make_pairs(folder, generator, plan_pairs(generator, seed, healthy, changed)))
        print(json.dumps({"made": made}) if as_json else f"{made} made")
    elif part == "diagnose":
        with progress_bar(as_json) as progress:
            _print_failures(diagnose_pairs(folder, Run(workers, None, progress)), as_json)
    else:
        _print(scores_of(score_pairs(folder), f"python -m benchmarks pairs {folder} --part score"), as_json)


def real_pairs(
    folder: Annotated[Path, typer.Argument(help="of the pairs")],
    source: Annotated[Path, typer.Option(help="folder of the public track files")],
    seed: Annotated[int, typer.Option(min=0, help="of all draws")] = 0,
    healthy: Annotated[int, typer.Option(min=0, help="pairs without a change")] = 4,
    changed: Annotated[int, typer.Option(min=0, help="pairs with one fault in the second session")] = 12,
    as_json: AsJson = False,
) -> None:
    """Make pairs out of public trials of the real robot, for the other parts of `pairs`."""
    from benchmarks.effects.real_pairs import make_real, plan_real

    made = make_real(folder, source, plan_real(seed, healthy, changed))
    print(json.dumps({"made": made}) if as_json else f"{made} made")


def plain(
    folder: Annotated[Path, typer.Argument(help="of the sessions")],
    part: Annotated[
        Literal["make", "diagnose", "score"],
        typer.Option(help="make the sessions; diagnose them; score the diagnoses"),
    ] = "make",
    seed: Annotated[int, typer.Option(min=0, help="of all draws")] = 0,
    unchanged: Annotated[int, typer.Option(min=0, help="sessions without a change")] = 2,
    changed: Annotated[int, typer.Option(min=0, help="sessions with one change")] = 28,
    workers: Annotated[int, typer.Option(min=0, help="sessions at a time; 0: one on each core")] = 0,
    as_json: AsJson = False,
) -> None:
    """Make sessions of the exported twin in plain MuJoCo with one change each, have them diagnosed, and score that."""
    from benchmarks.cases import Run
    from benchmarks.effects.plain import make_plain, plan_plain
    from benchmarks.effects.plain_scoring import diagnose_plain, score_plain, scores_of_plain
    from calib.progress_bar import progress_bar

    if part == "make":
        made = make_plain(folder, plan_plain(seed, unchanged, changed))
        print(json.dumps({"made": made}) if as_json else f"{made} made")
    elif part == "diagnose":
        with progress_bar(as_json) as progress:
            _print_failures(diagnose_plain(folder, Run(workers, None, progress)), as_json)
    else:
        _print(scores_of_plain(score_plain(folder), f"python -m benchmarks plain {folder} --part score"), as_json)


def foreign(
    folder: Annotated[Path, typer.Option(help="for sessions.jsonl, a line a session; what it holds is not run again")],
    count: Annotated[int, typer.Option(min=0, help="sessions; 0: only the table of what is there")] = 300,
    first: Annotated[int, typer.Option(min=0, help="number of the first")] = 0,
    seed: Annotated[int, typer.Option(min=0, help="of all draws")] = 0,
    keep: Annotated[Path | None, typer.Option(help="where sessions and results are kept; default: nowhere")] = None,
    workers: Annotated[int, typer.Option(min=0, help="sessions at a time; 0: one on each core")] = 0,
    as_json: AsJson = False,
) -> None:
    """Fit random sessions, two thirds of them disturbed: right or flagged? Exit status 1 when one falls short."""
    from benchmarks.cases import Run
    from benchmarks.foreign.report import measure_foreign
    from calib.progress_bar import progress_bar

    command = f"python -m benchmarks foreign --folder {folder} --seed {seed} --count {count}"
    with progress_bar(as_json) as progress:
        outcome = measure_foreign(folder, seed, range(first, first + count), Run(workers, None, progress), keep)
    _print(outcome.scores(command), as_json)
    if outcome.falls_short:
        raise typer.Exit(1)


def gym(
    session: Annotated[
        Path | None, typer.Option(help="of this calibrated session; default: the built-in robot")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Measure steps a second: the vector environment against a process for each environment, in one run."""
    from benchmarks.gym import measure_gym

    found = measure_gym(**({} if session is None else {"session": str(session)}))
    print(json.dumps(found, indent=1) if as_json else "\n".join(f"{kind}: {rate:,.1f}" for kind, rate in found.items()))


def warp(
    exported: Annotated[Path, typer.Argument(metavar="MJCF", help="an exported twin, as `calib mjcf --out` writes it")],
) -> None:
    """Measure an exported twin in MuJoCo Warp, which wants a GPU: speed of thousands, and distance to MuJoCo."""
    from benchmarks.warp import measure_warp

    print(measure_warp(exported))


def _print_failures(failures: "tuple[Failure, ...]", as_json: bool) -> None:
    found = {"failed": [failure._asdict() for failure in failures]}
    print(json.dumps(found, indent=1) if as_json else f"{len(failures)} failed" if failures else "all done")
    for failure in [] if as_json else failures:
        print(f"{failure.name}: {failure.message}")


def _score_effects(folder: Path, as_json: bool) -> None:
    """Score a suite, or its cases in a file."""
    from benchmarks.cases import write_lines
    from benchmarks.effects.folder import SuiteFolder
    from benchmarks.effects.scoring import score_all, score_file
    from swimcal.results import write_whole

    command = f"python -m benchmarks effects {folder} --part score"
    if folder.suffix == ".jsonl":
        scores = score_file(folder).scores(command)
    else:
        outcome = score_all(SuiteFolder(folder))
        scores = outcome.scores(command)
        write_lines(folder / "cases.jsonl", outcome.cases)
        write_whole(folder / "scores.json", scores.json())
    _print(scores, as_json)


def _print(scores: "Scores", as_json: bool) -> None:
    print(scores.json() if as_json else scores.text(), end="" if as_json else "\n")


COMMANDS: dict[Callable[..., None], str] = {
    speed: "speed --session pool",
    tracking: "tracking --part accuracy",
    posterior: "posterior --folder scores --first 2000 --count 30",
    effects: "effects suite --part make --suite small --seed 1",
    pairs: "pairs pairs --part make --generator wake --seed 1",
    real_pairs: "real-pairs pairs --source fishsim/Data/Markers",
    plain: "plain plain --part make --seed 1",
    foreign: "foreign --folder foreign --count 300",
    gym: "gym --session pool",
    warp: "warp fish.xml",
}
"""Commands, each with an example for its help."""
