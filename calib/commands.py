"""The commands of `calib`, by what they work on.

Videos and tracks: `track`, `edit`, `view`, `convert`. A session and its results: `new`, `run`, `fit`, `posterior`,
`diagnose`, `report`, `mjcf`; `doctor` checks it. The robot: `robot`. The camera: `board`, `lens`, `scale`. Policies and
pools: `train`, `evaluate`, `play` and `aquarium`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

import calib
from calib.kept_output import print_again
from calib.terminal import (
    FORMS,
    AsJson,
    Command,
    Effort,
    LastStep,
    ObjectiveOption,
    PolicyEffort,
    Rename,
    Scheduler,
    SessionFolder,
    SessionFolders,
    TrackerOption,
    Verbose,
    Workers,
    print_export,
    print_result,
    renaming,
)

TRACKER_HELP = "hybrid: spots, and CSRT where none answers; spots: without CSRT; csrt: plain CSRT, the baseline"

_MANY = ("--videos", "--tracks")

BoardFile = Annotated[
    Path | None, typer.Option(help="TOML with a table [board]; default: the board of docs/tracking.md")
]

TaskName = Annotated[Literal["target", "circle"], typer.Option(help="reach random targets, or follow a circle of 1 m")]
PolicyFile = Annotated[
    Path | None, typer.Option("--policy", help="the policy's npz; default: the one trained for this session and task")
]
Seed = Annotated[int, typer.Option(min=0, help="seed of all draws")]
_TEST_SEED = 1_000_003  # seed of goals that no training sees


# Videos and tracks.


def track(
    session: SessionFolder,
    method: Annotated[
        TrackerOption | None, typer.Option(help=f"{TRACKER_HELP}; default: that of the existing tracks, else hybrid")
    ] = None,
    click: Annotated[
        bool, typer.Option("--click", help="only write a page on which to click the start boxes of each video")
    ] = False,
    frame: Annotated[
        int | None, typer.Option(min=0, help="with --click: the frame that the pages show, the first is 0")
    ] = None,
    export: Annotated[str, typer.Option(help=f"also write the tracks as one of: {', '.join(FORMS)}")] = "",
    workers: Workers = 0,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Track the markers in a session's videos, with the state and confidence of each sample, and flags."""
    from calib.results.tracks import PartlyTracked, TrackResult, print_others, print_tracks

    try:
        found = calib.track(
            session, method=method, export=export, click=click, frame=frame, workers=workers, progress=not as_json
        )
    except PartlyTracked as problem:
        print_others(problem, as_json, verbose)
        raise
    if isinstance(found, TrackResult):
        print_tracks(found, as_json, verbose)
    else:
        files = {page.name.removesuffix(".click.html"): str(page) for page in found.files}
        print(json.dumps(files, indent=1) if as_json else "\n".join(files.values()))


def edit(
    session: SessionFolder,
    trial: Annotated[str, typer.Argument(help="the trial to correct")],
    correction: Annotated[
        str,
        typer.Argument(
            help='as JSON, e.g. {"op": "swap", "markers": ["tail_3", "tail_4"], "frames": [120, 180]}; '
            'others: "drop", "relabel", "box" (set a box and track on), "undo"'
        ),
    ],
) -> None:
    """Add a correction to the edit log of a trial; `calib track` replays it. Nothing is ever removed from the log."""
    print(calib.correct(session, trial, correction))


def view(
    session: SessionFolder,
    show: Annotated[bool, typer.Option("--open", help="open it in the Rerun viewer")] = False,
) -> None:
    """Write the rerun recording: video, tracks, states, confidence and, once there is a fit, the twin."""
    from calib.viewer import open_viewer

    made = calib.view(session)
    print_export(made)  # print first: the viewer may be missing
    if show:
        open_viewer(made.file)


def convert(
    tracks: Annotated[Path, typer.Argument(help="tracks in any of the forms; recognised from the content")],
    out: Annotated[Path, typer.Option(help="the file to write")],
    to: Annotated[str, typer.Option(help=f"the form to write: {', '.join(FORMS)}")] = "swimcal",
    markers: Annotated[
        str | None,
        typer.Option(
            help="markers to take, comma-separated; in files without a header, their order; default: the published nine"
        ),
    ] = None,
    fps: Annotated[float | None, typer.Option(help="frames a second, for forms without time")] = None,
    rename: Rename = "",
) -> None:
    """Convert tracks between this program, DeepLabCut, movement and the authors' CSV."""
    names = () if markers is None else tuple(name.strip() for name in markers.split(","))
    print(calib.convert_tracks(tracks, out, to, markers=names, fps=fps, rename=renaming(rename)))


# A session and its results.


class SeveralFiles(Command):
    """A command whose options of files take all files up to the next option, as the shell expands ``*.mp4``."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Give each file an option of its own."""
        spread, option = [], ""
        for argument in args:
            if argument.startswith("-"):
                option = argument if argument in _MANY else ""
                spread += [] if option else [argument]
            else:
                spread += [option, argument] if option else [argument]
        return super().parse_args(ctx, spread)


def new(  # noqa: PLR0913
    session: Annotated[Path, typer.Argument(metavar="SESSION", help="the folder to make")],
    videos: Annotated[
        list[Path] | None, typer.Option(help="videos, one a trial; all that follow up to the next option")
    ] = None,
    tracks: Annotated[list[Path] | None, typer.Option(help="tracks in any form, one a trial; as --videos")] = None,
    robot: Annotated[Path | None, typer.Option(help="the robot's TOML; default: the published 0.57 m fish")] = None,
    fps: Annotated[
        float | None, typer.Option(help="frames a second; needed for tracks and videos without time")
    ] = None,
    commands: Annotated[
        str, typer.Option(help="crank turns a second of each trial, comma-separated; default: from names like f1_25")
    ] = "",
    from_fishsim: Annotated[
        Path | None,
        typer.Option(help="a checkout of the authors' repository, or a folder of its marker CSVs"),
    ] = None,
    synthetic: Annotated[
        bool, typer.Option("--synthetic", help="a session made with the twin, with its truth")
    ] = False,
    fit: Annotated[str, typer.Option(help="trials to fit on, comma-separated; the others are held out")] = "",
    rename: Rename = "",
    seed: Annotated[int | None, typer.Option(min=0, help="seed of a synthetic session; default: 0")] = None,
    like: Annotated[
        Path | None,
        typer.Option(help="session of the same robot and camera: take robot, lens, commands and roles from it"),
    ] = None,
) -> None:
    """Make a session folder from your videos or tracks, and list what you still have to fill in."""
    from swimcal.session import SESSION_FILE

    calib.new_session(
        session,
        videos=videos or (),
        tracks=tracks or (),
        robot=robot,
        fps=fps,
        commands_hz=_parse_numbers(commands),
        from_fishsim=from_fishsim,
        synthetic=synthetic,
        fit=tuple(name.strip() for name in fit.split(",") if name.strip()),
        rename=renaming(rename),
        seed=seed,
        like=like,
    )
    for line in (session / SESSION_FILE).read_text(encoding="utf-8").splitlines():
        if line.startswith("# TODO"):
            print(f"to fill in: {line.removeprefix('# TODO ')}")
        elif line.startswith("# NOTE"):
            print(f"note: {line.removeprefix('# NOTE ')}")
    print(session)


def _parse_numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(number) for number in text.split(",") if number.strip())
    except ValueError as error:
        raise typer.BadParameter(
            f"found {text!r}, expected numbers such as 0.5,0.75", param_hint="--commands"
        ) from error


def run(
    sessions: SessionFolders,
    effort: Effort = None,
    until: Annotated[LastStep, typer.Option(help="the last step before the report")] = "diagnosis",
    jobs: Annotated[int, typer.Option(min=1, help="sessions at a time")] = 1,
    scheduler: Scheduler = None,
    workers: Workers = 0,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Run every stage the session has data for, then write the report.

    The stages are tracks, fit, MJCF, posterior and diagnosis. With several sessions, also write an index, as `calib
    report` does; one that fails stops no other.
    """
    alone = len(sessions) == 1 and scheduler is None and not as_json
    if alone and until == "diagnosis" and print_again("run", sessions[0], effort, verbose):
        return
    from calib.results.fit import StructureResult
    from calib.results.result import Export

    which = sessions if len(sessions) > 1 else sessions[0]
    made = calib.run(which, effort, until=until, jobs=jobs, workers=workers, scheduler=scheduler, progress=not as_json)
    if isinstance(made, Export):
        print_export(made, as_json)
        return
    page = None if isinstance(made, StructureResult) else made.session.results / "report.html"
    print_result(made, as_json, verbose, page)


def fit(
    session: SessionFolder,
    effort: Effort = None,
    workers: Workers = 0,
    objective: Annotated[
        ObjectiveOption,
        typer.Option(help="published: the published search as well (minutes), for comparison with the fit"),
    ] = "likelihood",
    scheduler: Scheduler = None,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Fit hinges and crank, swim frequencies and phases, the five fluid coefficients and EBT; write the MJCF.

    Free decays give stiffness and damping of the hinges; dry runs then give the crank arm. What was not recorded
    is assumed to be as the robot is described, and reported so. Without a swim it ends with hinges and crank.

    Held-out trials are forecast given the frequency, and again after their first two beats; a line, a power law and a
    constant stride through the fitted speeds are given for comparison. The other commands use the current fit, whatever
    its effort; it stays until you fit again.
    """
    plain = objective == "likelihood" and scheduler is None and not as_json
    if plain and print_again("fit", session, effort, verbose):
        return
    found = calib.fit(session, effort, workers=workers, objective=objective, progress=not as_json, scheduler=scheduler)
    print_result(found, as_json, verbose)


def posterior(
    session: SessionFolder,
    effort: Effort = None,
    workers: Workers = 0,
    scheduler: Scheduler = None,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Sample the posterior of the five fluid coefficients, given the fit trials.

    Where there are too few effective draws, nothing is reported.
    """
    if scheduler is None and not as_json and print_again("posterior", session, effort, verbose):
        return
    found = calib.posterior(session, effort, workers=workers, progress=not as_json, scheduler=scheduler)
    print_result(found, as_json, verbose)


def diagnose(  # noqa: PLR0913
    session: SessionFolder,
    effort: Effort = None,
    workers: Workers = 0,
    exclude: Annotated[str | None, typer.Option(help="effects to leave out, comma-separated")] = None,
    test: Annotated[str | None, typer.Option(help="instead: test these effects together, comma-separated")] = None,
    reference: Annotated[
        Path | None,
        typer.Option(help="session of the same robot, camera and water before something changed: what changed?"),
    ] = None,
    scheduler: Scheduler = None,
    verbose: Verbose = False,
    as_json: AsJson = False,
) -> None:
    """Locate the sim-to-real gap, rank its likely causes, and measure how far it shrinks with them.

    Writes results/diagnosis.json and, where an effect is named, the model with it. With --reference the effects are
    what changed since that session. With --test it writes results/supposed.json alone.
    """
    excluded, tested = _parse_effects("--exclude", exclude), _parse_effects("--test", test)
    if tested and excluded:
        raise typer.BadParameter("takes effects of the whole catalogue; leave --exclude out", param_hint="--test")
    if tested and reference is not None:
        raise typer.BadParameter("tests effects within one session; leave --reference out", param_hint="--test")
    if tested:
        alone = calib.effect_test(session, tested, effort, workers=workers, progress=not as_json)
        print_result(alone, as_json, verbose)
        return
    plain = not excluded and reference is None and scheduler is None and not as_json
    if plain and print_again("diagnose", session, effort, verbose):
        return
    found = calib.diagnose(
        session,
        effort,
        exclude=excluded,
        reference=reference,
        workers=workers,
        progress=not as_json,
        scheduler=scheduler,
    )
    print_result(found, as_json, verbose)


def _parse_effects(option: str, text: str | None) -> tuple[str, ...]:
    """Parse the names in a comma-separated list; an `InputError` where the option was given and holds none."""
    names = tuple(name.strip() for name in (text or "").split(",") if name.strip())
    if text is not None and not names:
        from swimcal.effects.catalogue import catalogue
        from swimcal.errors import Fault, InputError

        step = "Name some, or leave the option out; docs/effects.md lists them."
        expected, choices = "names of the catalogue, comma-separated", tuple(catalogue())
        raise InputError([Fault(option, "", "names no effect", repr(text), expected, choices, step)])
    return names


def report(
    sessions: SessionFolders,
    index: Annotated[
        Path | None,
        typer.Option(help="where the index of several sessions goes; default: index.html next to the first"),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Write the HTML report of the current results of each session; of several an index, also as CSV. Fits nothing."""
    alone = len(sessions) == 1 and index is None and not as_json
    if alone and print_again("report", sessions[0], None):
        return
    print_export(calib.report(sessions if len(sessions) > 1 else sessions[0], index), as_json)


def mjcf(
    source: Annotated[
        Path | None,
        typer.Argument(metavar="SESSION | ROBOT", help="session folder or robot TOML; default: the 0.57 m fish"),
    ] = None,
    out: Annotated[Path, typer.Option(help="the file to write")] = Path("robot.xml"),
) -> None:
    """Write the MJCF: of the current fit for a session, nominal for a robot; fits nothing."""
    print_export(calib.export_mjcf(source, out))


def robot(
    file: Annotated[Path | None, typer.Argument(metavar="ROBOT", help="robot TOML; default: the 0.57 m fish")] = None,
    out: Annotated[Path, typer.Option(help="the picture to write: .png, .svg or .pdf")] = Path("robot.png"),
) -> None:
    """Draw a robot's description, with its mass, length, natural frequency in air and speed at 1 Hz."""
    print_export(calib.draw_robot(file, out))


def doctor(
    session: Annotated[Path | None, typer.Argument(metavar="SESSION", help="a session folder to check, too")] = None,
    motor: Annotated[bool, typer.Option("--motor", help="also look for the motor on every serial port")] = False,
    as_json: AsJson = False,
) -> None:
    """Check the installation, a session and the motor connection, and say what to do. Exit code 2 after a fault."""
    found = calib.doctor(session, motor=motor)
    if as_json:
        print(found.to_json(orient="index", indent=1))
    for check, (state, what, step) in [] if as_json else found.iterrows():
        mark = {"ok": "ok    ", "advice": "advice", "fault": "FAULT "}[state]
        end = "" if what.endswith((".", "?")) else "."
        told = f"{what}{end} {step}" if step else what
        print(f"{mark} {check}: {told}")
    if (found.state == "fault").any():
        raise typer.Exit(2)


# The camera.


def board(
    out: Annotated[Path, typer.Option(help="the file to write: .pdf, .svg or .png")] = Path("board.pdf"),
    description: BoardFile = None,
) -> None:
    """Draw a calibration board to be printed at its true size."""
    print(calib.camera.board(out, description))


def lens(
    pictures: Annotated[list[Path], typer.Argument(help="15 to 30 pictures of the board, or one video of it")],
    out: Annotated[Path, typer.Option(help="the camera file to write")] = Path("camera.toml"),
    description: BoardFile = None,
    as_json: AsJson = False,
) -> None:
    """Calibrate the lens from pictures of a board at many angles; the session names the file as its calibration."""
    found = calib.camera.lens(pictures, out, description, progress=not as_json)
    if as_json:
        flags = [flag.to_json() for flag in found.flags]
        numbers = {"rms_px": found.rms_px, "coverage": found.coverage}
        print(json.dumps({"camera": found.calibration.model_dump(mode="json"), **numbers, "flags": flags}, indent=1))
        return
    used = found.pictures - len(found.rejected)
    covered = f"{found.coverage:.0%} of the picture covered"
    print(f"{used} of {found.pictures} pictures used, {found.rms_px:.2f} px rms, {covered}")
    for flag in found.flags:
        print(f"! {flag.message}")
    print(out)


def scale(
    picture: Annotated[Path, typer.Argument(help="a picture of the board lying level at the water's surface")],
    description: BoardFile = None,
    camera: Annotated[Path | None, typer.Option(help="the camera file of `calib camera lens`")] = None,
    board_height_m: Annotated[float, typer.Option(help="height of the board above the water, m")] = 0.0,
) -> None:
    """Measure metres per pixel from a board in the pool; with a lens also the camera's height."""
    found = calib.camera.scale(picture, description, camera, board_height_m)
    print(f"{1000 * found.metres_per_px:.4f} ± {1000 * found.sd_metres_per_px:.4f} mm per pixel at the water's surface")
    if found.camera_height_m is not None:
        height, tilt = found.camera_height_m, found.tilt_deg
        print(f"camera {height:.3f} m above the water (height_above_water_m), tilted by {tilt:.1f} degrees")
    print("scale_length_m of the session: this times the nose-neck distance in pixels")


# Policies and pools.


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
        Path | None, typer.Argument(metavar="SESSION", help="a session with a fit; default: the built-in robot")
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
