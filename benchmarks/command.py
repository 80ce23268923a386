"""The commands of `python -m benchmarks`."""

import json
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from calib.terminal import AsJson

if TYPE_CHECKING:
    from benchmarks.cases import Failure
    from benchmarks.scores import Scores

Workers = Annotated[int, typer.Option(min=0, help="sessions at a time; 0: one on each core")]
Seed = Annotated[int, typer.Option(min=0, help="of all draws")]
Healthy = Annotated[int, typer.Option(min=0, help="pairs without a change")]
MakeDiagnoseScore = Annotated[
    Literal["make", "diagnose", "score"], typer.Option(help="make what is missing; diagnose it; score the diagnoses")
]


def speed(as_json: AsJson = False) -> None:
    """Measure the twin's speed on one core and on all, and without fluid; and its distance to an 8 times finer step."""
    from benchmarks.speed import measure_speed

    _print(measure_speed(), as_json)


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
        typer.Option(help="for sessions.jsonl, a line a session; or such a file: only its table; default: nowhere"),
    ] = None,
    first: Annotated[int, typer.Option(min=0, help="number of the first")] = 0,
    count: Annotated[int, typer.Option(min=0, help="sessions; 0: only the table of what is there")] = 300,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Draw sessions from the prior; measure how often posteriors hold the truth (simulation-based calibration)."""
    from benchmarks.cases import Run
    from benchmarks.posterior.report import measure_posterior
    from calib.progress_bar import progress_bar

    seeds, command = range(first, first + count), f"python -m benchmarks posterior --folder {folder or 'FOLDER'}"
    with TemporaryDirectory() if folder is None else nullcontext(folder) as place, progress_bar(as_json) as progress:
        outcome = measure_posterior(Path(place), seeds, Run(workers, progress))
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
            help="small: 24 sessions; large: 700; "
            "wake: 40 of another generator, whose swimmer sheds its wake; "
            "large:2/10: the second tenth of the large one, which others may join"
        ),
    ] = "small",
    seed: Annotated[int, typer.Option(min=0, help="of the suite")] = 0,
    program: Annotated[
        str, typer.Option(help="command that diagnoses, given SESSION [--exclude EFFECT]; default: the toolkit's own")
    ] = "",
    workers: Workers = 0,
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
        of, run = SuiteFolder(folder), Run(workers, progress)
        if part == "make":
            failures = make_suite(of, seed, size, run, shard)
        else:
            do = {"diagnose": diagnose_suite, "withhold": diagnose_without}[part]
            failures = do(of, program_of(program), run)
    _print_failures(failures, as_json)


def pairs(
    folder: Annotated[Path, typer.Argument(help="of the pairs")],
    part: MakeDiagnoseScore = "make",
    generator: Annotated[
        Literal["reality", "wake"], typer.Option(help="the second simulator, or the swimmer that sheds its wake")
    ] = "reality",
    seed: Seed = 0,
    healthy: Healthy = 20,
    changed: Annotated[int, typer.Option(min=0, help="pairs with one effect in the second session")] = 30,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Make pairs of a healthy and a changed session, have the change diagnosed with the reference, and score that."""
    if part == "make":
        from benchmarks.effects.pairs import make_pairs, plan_pairs

        _print_made(make_pairs(folder, generator, plan_pairs(generator, seed, healthy, changed)), as_json)
    else:
        _diagnose_or_score(folder, part, f"pairs {folder}", workers, as_json)


def real_pairs(
    folder: Annotated[Path, typer.Argument(help="of the pairs")],
    source: Annotated[Path, typer.Option(help="folder of the public track files")],
    seed: Seed = 0,
    healthy: Healthy = 4,
    changed: Annotated[int, typer.Option(min=0, help="pairs with one fault in the second session")] = 12,
    as_json: AsJson = False,
) -> None:
    """Make pairs out of public trials of the real robot, for the other parts of `pairs`."""
    from benchmarks.effects.real_pairs import make_real, plan_real

    _print_made(make_real(folder, source, plan_real(seed, healthy, changed)), as_json)


def plain(
    folder: Annotated[Path, typer.Argument(help="of the sessions")],
    part: MakeDiagnoseScore = "make",
    seed: Seed = 0,
    unchanged: Annotated[int, typer.Option(min=0, help="sessions without a change")] = 2,
    changed: Annotated[int, typer.Option(min=0, help="sessions with one change")] = 28,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Make sessions of the exported twin in plain MuJoCo with one change each, have them diagnosed, and score that."""
    if part == "make":
        from benchmarks.effects.plain import make_plain, plan_plain

        _print_made(make_plain(folder, plan_plain(seed, unchanged, changed)), as_json)
    else:
        _diagnose_or_score(folder, part, f"plain {folder}", workers, as_json)


def foreign(
    folder: Annotated[Path, typer.Option(help="for sessions.jsonl, a line a session; what it holds is not run again")],
    count: Annotated[int, typer.Option(min=0, help="sessions; 0: only the table of what is there")] = 300,
    first: Annotated[int, typer.Option(min=0, help="number of the first")] = 0,
    seed: Seed = 0,
    keep: Annotated[Path | None, typer.Option(help="where sessions and results are kept; default: nowhere")] = None,
    workers: Workers = 0,
    as_json: AsJson = False,
) -> None:
    """Fit random sessions, two thirds of them disturbed: right or flagged? Exit status 1 when one falls short."""
    from benchmarks.cases import Run
    from benchmarks.foreign.report import measure_foreign
    from calib.progress_bar import progress_bar

    command = f"python -m benchmarks foreign --folder {folder} --seed {seed} --count {count}"
    with progress_bar(as_json) as progress:
        outcome = measure_foreign(folder, seed, range(first, first + count), Run(workers, progress), keep)
    _print(outcome.scores(command), as_json)
    if outcome.falls_short:
        raise typer.Exit(1)


def gym(as_json: AsJson = False) -> None:
    """Measure steps a second: the vector environment against a process for each environment, in one run."""
    from benchmarks.gym import measure_gym

    found = measure_gym()
    print(json.dumps(found, indent=1) if as_json else "\n".join(f"{kind}: {rate:,.1f}" for kind, rate in found.items()))


def warp(
    exported: Annotated[Path, typer.Argument(metavar="MJCF", help="an exported twin, as `calib mjcf --out` writes it")],
) -> None:
    """Measure an exported twin in MuJoCo Warp, which wants a GPU: speed of thousands, and distance to MuJoCo."""
    from benchmarks.warp import measure_warp

    _print(measure_warp(exported), as_json=False)


def _diagnose_or_score(folder: Path, part: str, command: str, workers: int, as_json: bool) -> None:
    """Diagnose sessions with one change, or score their diagnoses."""
    from benchmarks.cases import Run
    from benchmarks.effects.changes import diagnose_changes, score_changes, scores_of
    from calib.progress_bar import progress_bar

    if part == "score":
        _print(scores_of(score_changes(folder), f"python -m benchmarks {command} --part score"), as_json)
        return
    with progress_bar(as_json) as progress:
        _print_failures(diagnose_changes(folder, Run(workers, progress)), as_json)


def _print_made(made: int, as_json: bool) -> None:
    print(json.dumps({"made": made}) if as_json else f"{made} made")


def _print_failures(failures: "tuple[Failure, ...]", as_json: bool) -> None:
    found = {"failed": [failure._asdict() for failure in failures]}
    print(json.dumps(found, indent=1) if as_json else f"{len(failures)} failed" if failures else "all done")
    for failure in [] if as_json else failures:
        print(f"{failure.name}: {failure.message}")


def _score_effects(folder: Path, as_json: bool) -> None:
    """Score a suite, or its cases in a file."""
    from benchmarks.cases import write_lines
    from benchmarks.effects.folder import SuiteFolder
    from benchmarks.effects.scoring import read_cases, score_suite, score_without, scores_of
    from swimcal.results import write_whole

    command, suite = f"python -m benchmarks effects {folder} --part score", SuiteFolder(folder)
    if folder.suffix == ".jsonl":
        scores = scores_of(read_cases(folder), (), command)
    else:
        cases = score_suite(suite)
        scores = scores_of(cases, score_without(suite), command)
        write_lines(folder / "cases.jsonl", cases)
        write_whole(folder / "scores.json", scores.json())
    _print(scores, as_json)


def _print(scores: "Scores", as_json: bool) -> None:
    print(scores.json() if as_json else scores.text(), end="" if as_json else "\n")


COMMANDS: dict[Callable[..., None], str] = {
    speed: "speed",
    tracking: "tracking --part accuracy",
    posterior: "posterior --folder scores --first 2000 --count 30",
    effects: "effects suite --part make --suite small --seed 1",
    pairs: "pairs pairs --part make --generator wake --seed 1",
    real_pairs: "real-pairs pairs --source fishsim/Data/Markers",
    plain: "plain plain --part make --seed 1",
    foreign: "foreign --folder foreign --count 300",
    gym: "gym",
    warp: "warp fish.xml",
}
"""Commands, each with an example for its help."""
