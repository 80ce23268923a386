"""The making of a synthetic session: the twin moves, a camera and a faulty tracker look on, the truth is kept."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import mujoco
import tomlkit

from session import load_session
from session.create import new_folder, write_session_toml
from session.results import write_whole
from synthetic.decays import simulate_decays
from synthetic.noise import NOISELESS
from synthetic.plan import SyntheticPlan
from synthetic.recorder import Filming, Progress, Recorder, motor_file
from synthetic.swims import simulate_dry_runs, simulate_swims
from synthetic.truth import Truth, structure_of, write_truth

ROBOT_FILE = "robot.toml"


def make_session(
    folder: Path, plan: SyntheticPlan, video: Filming | None = None, progress: Progress = lambda *_: None
) -> Path:
    """Make a session folder with known truth: `session.toml`, packed tracks or videos, motor logs, `truth.json`.

    The motion comes from the twin at a finer time step than a fit uses; a swim without a motor begins in the middle of
    a developed one. Each trial draws from streams of its own, so that changing one leaves the others as they are. The
    same plan gives the same bytes on the same engine.

    A filmed swim has `trials/<name>.mp4`, start boxes next to it, and what a perfect tracker would find as
    `truth/<name>.csv`. The plan's noise and faults, which are a tracker's, do not apply to it.

    A trial with a motor has `trials/<name>.motor.csv` and `trials/<name>.commands.csv`, as from `calib capture`. The
    offset between the motor's clock and that of the video is in the truth alone.

    Args:
        folder: the folder to make.
        plan: the plan of the session.
        video: films the swim trials for which it says so; a renderer is in `benchmarks.video`.
        progress: called after each frame of a video.

    Raises:
        session.InputError: the folder is not empty, or a trial leaves the image.
        session.ResultsNotWritable: the folder cannot be written.
        session.SimulationDiverged: the planned motion is unstable.
    """
    if video is not None:
        plan = _remove_tracker(plan, video)
    with new_folder(folder) as part:
        recorder = Recorder(part, plan, video, progress)
        truth = Truth(
            mujoco=mujoco.__version__,
            plan=plan,
            structure=structure_of(plan.swimmer),
            trials={true.trial.name: recorder.swim(i, true) for i, true in enumerate(simulate_swims(plan))},
            dry_runs={true.trial.name: recorder.dry_run(i, true) for i, true in enumerate(simulate_dry_runs(plan))},
            free_decays={true.trial.name: recorder.free_decay(i, true) for i, true in enumerate(simulate_decays(plan))},
        )
        _write_description(part, plan, recorder.recordings)
        write_truth(part, truth)
        load_session(part)
    return folder


def _remove_tracker(plan: SyntheticPlan, video: Filming) -> SyntheticPlan:
    """Return the plan without the errors of a tracker in the swim trials that are filmed."""
    names = [trial.name for trial in plan.trials]
    trials = tuple(t.model_copy(update={"faults": ()}) if video.films(t.name) else t for t in plan.trials)
    tracked = plan.dry_runs or plan.free_decays or not all(map(video.films, names))
    return plan.model_copy(update={"trials": trials, "noise": plan.noise if tracked else NOISELESS})


def _write_description(folder: Path, plan: SyntheticPlan, recordings: Mapping[str, Mapping[str, str]]) -> None:
    if plan.robot is not None:
        write_whole(folder / ROBOT_FILE, tomlkit.dumps(plan.robot.model_dump()))
    write_session_toml(
        folder,
        name=plan.name,
        camera={"fps": plan.camera.fps, "scale_length_m": round(plan.swimmer.scale_length_m, 9)},
        markers=plan.markers,
        trials=list(_trial_tables(plan, recordings)),
        fit={"warmup_s": plan.warmup_s},
        robot_file=None if plan.robot is None else ROBOT_FILE,
    )


def _trial_tables(plan: SyntheticPlan, recordings: Mapping[str, Mapping[str, str]]) -> Iterator[dict[str, Any]]:
    """Yield the keys of each `[[trial]]`; None leaves a key out."""
    for kind, trials in (("swim", plan.trials), ("dry", plan.dry_runs)):
        for trial in trials:
            motor = None if trial.motor is None else motor_file(trial)
            driven = {"motor": motor, "commanded_hz": trial.commanded_hz, "role": trial.role}
            yield {"name": trial.name, "kind": kind, **recordings[trial.name], **driven}
    for decay in plan.free_decays:
        yield {"name": decay.name, "kind": "free_decay", **recordings[decay.name], "role": decay.role}
