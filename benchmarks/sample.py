"""Maker of `datasets/sample`, with the checksums of its card: `python -m benchmarks.sample datasets/sample`.

The session is made by the second simulator with one effect that the twin lacks: so its fit is not checked by the model
that made the data, and its diagnosis has something to find. The card and `truth.json` tell what was put in; the program
opens neither.
"""

import json
import shutil
import sys
import tempfile
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from benchmarks.effects.drawn import drawn_nuisances, swim_past_middle
from benchmarks.effects.rows import tracks_of
from benchmarks.reality import Recording, Trial, World, simulate
from benchmarks.reality.camera import Camera
from benchmarks.reality.mechanism import Mechanism
from benchmarks.reality.mechanisms.fluid import BackgroundCurrent
from benchmarks.reality.tendons import Turn
from benchmarks.video.filmed import SessionVideo
from fitting.pool import forward_speed
from swimcal.create_session import FISHSIM_MARKERS, new_folder, write_session_toml
from swimcal.results import sha256_of, write_whole
from swimcal.robot import load_robot
from swimcal.runs import CrankTurn
from swimcal.session import load_session
from swimsynth.plan import SyntheticCamera, SyntheticPlan, SyntheticTrial, default_plan, trial_name
from swimsynth.session import motor_file, save_packed_tracks
from swimsynth.simulate import DrivenMotor, TrueRun, save_commands, save_motor_log
from tracking.head_frame import to_head_frame

SAMPLE_SEED = 0
CARD_FILE = "CARD.md"
TRUTH_FILE = "truth.json"
WITHHELD = BackgroundCurrent(right_m_s=0.0057, up_m_s=0.0019, turning_rad_s=0.0008)
"""The effect that the twin lacks: the pool's pump is on, and its water drifts by 6 mm/s, in a wide eddy."""
WORLD = World(
    coefficients=(0.4, 2.0, 6.0, 4.0, 1.0),
    nuisances=replace(drawn_nuisances(np.random.default_rng(SAMPLE_SEED)), marker_shift_m={}),
    mechanisms=(WITHHELD,),
    camera=Camera(height_m=2.5, focal_px=2412.5),
)
"""A robot within its maker's tolerances, and a camera of 965 px per metre, as in the published videos."""
VIDEO_NAME = "f1_00_video"
VIDEO = SessionVideo(trials=(VIDEO_NAME,), width_px=1280, height_px=720, crf=21)
SPEEDS_HZ = (0.6, 0.7, 0.8, 1.0, 1.3)
FIT_HZ = (0.6, 0.8, 1.3)
"""Commanded turns of the crank a second; the held-out swims lie within the range of the fitted ones."""
_WAYS_RAD = (np.pi, 0.0, 0.0, np.pi, 0.0)  # The swims go either way along the current.
_FEWEST_S = 5.0  # A swim lasts at least this long.
_FEWEST_BEATS = 4.2  # A swim has at least this many beats.
_VIDEO_HZ = 1.0
_VIDEO_S = 3.5
_VIDEO_HEADING_RAD = 3.0
_RUN_IN_S = 3.0
_WARMUP_S = 1.0
_HEADING_RAD = 0.35  # Headings are at most this far off the picture's long side.
_TABLE = "|---|---|\n"  # This begins the table of checksums, with which the card ends.


class DrivenCrank(Mechanism):
    """Crank that turns as its motor drives it, from rest to rest, whatever pulls at it."""

    driven: CrankTurn  # turn of the crank since the first frame
    phase_rad: float  # phase in the first frame

    def turn(self, time_s: np.ndarray, turn: Turn, state: np.ndarray) -> Turn:  # noqa: ARG002
        """Follow the motor."""
        return Turn(self.phase_rad + self.driven.angle(time_s), self.driven.speed(time_s))


def make_sample(folder: Path) -> Path:
    """Make the sample; files of the same names are replaced, no others are touched."""
    with tempfile.TemporaryDirectory() as scratch:
        shutil.copytree(_make(Path(scratch) / "sample"), folder, dirs_exist_ok=True)
    return folder


def _make(folder: Path) -> Path:
    plan = default_plan(SAMPLE_SEED)  # Its dry experiments start and stop as `calib capture` drives them.
    driven = {run.name: run for run in plan.dry_runs}
    motors = {
        name: DrivenMotor.of(run, run.motor, np.random.default_rng([SAMPLE_SEED, number]))
        for number, (name, run) in enumerate(driven.items())
        if run.motor is not None
    }
    recordings = _simulate(_plan_trials(plan), motors)
    with new_folder(folder) as part:
        tables = []
        for number, (name, recording) in enumerate(recordings.items()):
            files = _film(part, name, recording) if VIDEO.films(name) else _write_tracks(part, name, recording, number)
            hz = driven[name].commanded_hz if name in driven else recording.trial.frequency_hz or None
            if name in motors:
                _write_log(part, name, motors[name], recording)
                files["motor"] = motor_file(driven[name])
            held_out = recording.trial.kind == "swim" and (hz not in FIT_HZ or VIDEO.films(name))
            role = "holdout" if held_out else "fit"
            tables.append({"name": name, "kind": recording.trial.kind, **files, "commanded_hz": hz, "role": role})
        write_session_toml(
            part,
            name="sample",
            camera={"fps": plan.camera.fps, "scale_length_m": round(load_robot().scale_length_m, 9)},
            markers=FISHSIM_MARKERS,
            trials=tables,
            fit={"warmup_s": _WARMUP_S},
        )
        write_whole(part / TRUTH_FILE, json.dumps(_collect_truth(recordings), indent=1) + "\n")
        load_session(part)
    return folder


def _plan_trials(plan: SyntheticPlan) -> dict[str, Trial]:
    random = np.random.default_rng(SAMPLE_SEED)
    ways = zip(SPEEDS_HZ, _WAYS_RAD, strict=True)
    swims = {trial_name("f", hz): _plan_swim(hz, way_rad, random) for hz, way_rad in ways}
    swims[VIDEO_NAME] = swim_past_middle(_VIDEO_HZ, _VIDEO_S, _VIDEO_HEADING_RAD, 0.2, random)
    dry = {run.name: Trial("dry", run.seconds, phase_rad=run.phase_rad) for run in plan.dry_runs}
    decays = {
        each.name: Trial("free_decay", each.seconds, bent_rad=each.bent_rad, release_s=each.release_s)
        for each in plan.free_decays
    }
    return {name: replace(trial, run_in_s=_RUN_IN_S) for name, trial in swims.items()} | dry | decays


def _simulate(trials: Mapping[str, Trial], motors: Mapping[str, DrivenMotor]) -> dict[str, Recording]:
    """Simulate all trials in one batch; a crank that a motor is logged of turns as that drives it."""
    worlds = dict.fromkeys(trials, WORLD)
    for name, motor in motors.items():
        turned = DrivenCrank(motor.turn, trials[name].phase_rad)
        worlds[name] = replace(WORLD, mechanisms=(*WORLD.mechanisms, turned))
    filmed = simulate([(worlds[name], trial) for name, trial in trials.items()], FISHSIM_MARKERS)
    return dict(zip(trials, filmed, strict=True))


def _plan_swim(hz: float, way_rad: float, random: np.random.Generator) -> Trial:
    heading = float(random.uniform(-_HEADING_RAD, _HEADING_RAD) + way_rad)
    return swim_past_middle(hz, max(_FEWEST_S, round(_FEWEST_BEATS / hz, 1)), heading, 0.2, random)


def _write_tracks(folder: Path, name: str, recording: Recording, number: int) -> dict[str, str]:
    """Write the tracks that a tracker with faults gives; return the keys of its `[[trial]]`."""
    random = np.random.default_rng([SAMPLE_SEED, 4, number])
    file = f"trials/{name}.csv.gz"
    tracks = tracks_of(recording, WORLD.noise.tracked(recording.time_s, recording.position_px, random))
    save_packed_tracks(folder / file, tracks)
    return {"tracks": file}


def _write_log(folder: Path, name: str, motor: DrivenMotor, recording: Recording) -> None:
    """Write what the motor's computer logs, on a clock of its own."""
    crank = CubicSpline(recording.drive.time_s, recording.drive.angle_rad)
    last_s = recording.drive.time_s[-1]
    read = motor.read(crank(np.clip(motor.sampled_s, recording.drive.time_s[0], last_s)))
    save_motor_log(folder / f"trials/{name}.motor.csv", read.log)
    save_commands(folder / f"trials/{name}.commands.csv", read.commands)


def _film(folder: Path, name: str, recording: Recording) -> dict[str, str]:
    """Render the video of a swim in the middle of the picture, with start boxes and exact tracks; return its keys."""
    camera = SyntheticCamera(px_per_m=WORLD.camera.focal_px / WORLD.camera.height_m)
    trial, hz = recording.trial, recording.trial.frequency_hz
    seen = SyntheticTrial(
        name=name, frequency_hz=hz, commanded_hz=hz, seconds=trial.duration_s, role="holdout", phase_rad=trial.phase_rad
    )
    plan = SyntheticPlan(trials=(seen,), camera=camera, seed=SAMPLE_SEED)
    middle = (recording.position_px.max(axis=(0, 1)) + recording.position_px.min(axis=(0, 1))) / 2
    swim = TrueRun(
        trial=seen,
        time_s=recording.time_s,
        position_px=recording.position_px + WORLD.camera.centre_px - middle,
        head=recording.head,
        hinges_rad=recording.hinges_rad,
        frequency_hz=hz,
        phase_rad=trial.phase_rad,
        speed_m_s=_measure_speed(recording),
    )
    return VIDEO.film(folder, 0, swim, plan, lambda *_: None)


def _measure_speed(recording: Recording) -> float:
    """Return the forward speed after the warm-up without noise, m/s, as `forward_speed` defines it."""
    nose, neck = (recording.markers.index(marker) for marker in ("nose", "neck"))
    head = to_head_frame(recording.marker_m, nose, neck)
    kept = recording.time_s >= _WARMUP_S
    return float(forward_speed(recording.time_s, head, kept, recording.trial.frequency_hz))


def _collect_truth(recordings: Mapping[str, Recording]) -> dict[str, Any]:
    swims = {name: each for name, each in recordings.items() if each.trial.kind == "swim"}
    return {
        "withheld": {"effect": "background_current", **asdict(WITHHELD)},
        "coefficients": WORLD.coefficients,
        "robot": {key: value for key, value in asdict(WORLD.nuisances).items() if key != "marker_shift_m"},
        "trials": {
            name: {
                "frequency_hz": each.trial.frequency_hz,
                "phase_rad": round(each.trial.phase_rad, 4),
                "speed_m_s": round(_measure_speed(each), 5),
            }
            for name, each in swims.items()
        },
    }


def checksums(folder: Path) -> dict[str, str]:
    """Return the sha256 of every file of a dataset by its name in the folder, without results and the card."""
    files = {path.relative_to(folder): path for path in sorted(folder.rglob("*")) if path.is_file()}
    own = {name: path for name, path in files.items() if "results" not in name.parts and name.name[0] != "."}
    return {name.as_posix(): sha256_of(path) for name, path in own.items() if name != Path(CARD_FILE)}


def write_checksums(folder: Path) -> None:
    """Write the checksums into the card, whose text is written by hand."""
    text, _, _ = (folder / CARD_FILE).read_text(encoding="utf-8").rpartition(_TABLE)
    rows = "".join(f"| `{name}` | `{digest}` |\n" for name, digest in checksums(folder).items())
    write_whole(folder / CARD_FILE, text + _TABLE + rows)


if __name__ == "__main__":
    write_checksums(make_sample(Path(sys.argv[1] if len(sys.argv) > 1 else "datasets/sample")))
