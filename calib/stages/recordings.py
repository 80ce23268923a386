"""The trials of a session, measured: from their tracks, or from their videos."""

from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import xarray as xr

from calib.options import Job
from calib.stages.videos import Videos, of_each, spoiled, without_trial
from fitting.dry_run import DryTrial, measure_dry_run
from fitting.free_decay import FAR_OUT_PX, DecayTrial, measure_decay_trial
from fitting.left_out import carried_swims, odd_markers
from fitting.measure_trial import measure_trial
from fitting.motor_clock import MotorRecord, read_motor
from fitting.picture_scale import with_common_scale
from fitting.structure import DryExperiments
from fitting.trial import ExperimentsInAir, MeasuredTrial
from fitting.trial_checks import TAIL_FIRST
from swimcal.errors import FaultCollector, InputError, NotEnoughData
from swimcal.flags import Flag
from swimcal.results import sha256_of
from swimcal.robot_doubts import robot_doubts
from swimcal.session import TrialSpec
from swimcal.stage import Stage, fingerprint_of
from swimcal.tracks import UNSEEN, load_tracks, pixels_of, save_tracks, shared_frames
from tracking.boxes import ImpossibleBoxes
from tracking.camera import lens_flags
from tracking.exchanges import exchanged_apart
from tracking.foreign import with_even_clock
from tracking.quality import FLOOR_PX, check_tracks
from tracking.tracked import as_tracked, drop_repeat_flags, mask_untrusted

AnyTrial = MeasuredTrial | DryTrial | DecayTrial

HELD_OUT = 'its role in session.toml is "holdout"'
_MANY = 0.05  # share of a trial's samples from which a flag is told as a reason why the trial is left out
_TOLD = 2  # most flags that are told
_SHARED = 0.2  # share of its frames from which a swim that shares them with a fit trial is flagged

T = TypeVar("T", bound=AnyTrial)
Made = TypeVar("Made")


class Recordings:
    """The recordings of a session."""

    def __init__(self, job: Job) -> None:
        self._job, self._session, self._robot = job, job.session, job.robot
        self.videos = Videos(job)
        self._unmeasured: tuple[tuple[TrialSpec, str], ...] = ()
        self._motors: dict[str, MotorRecord | None] = {}
        self._given: dict[str, xr.Dataset] = {}

    @cached_property
    def fingerprint(self) -> str:
        """Fingerprint of the recordings and how their videos are tracked, the robot, the engine and the program.

        Raises:
            InputError: what is wrong with the boxes of all trials.
        """
        stamp = self._job.provenance
        trackers = {spec.name: self.videos.tracker_of(spec) for spec in self._filmed()}
        model = {"mujoco": stamp.mujoco, "model": stamp.model_sha256}
        settings = model | ({"trackers": trackers} if trackers else {})
        return fingerprint_of(stamp.inputs, settings)

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """Notes for the reader on the trials that were left out, and on what is doubtful of the robot's file."""
        left_out = [spec for spec in self._session.trials if spec not in self._usable]
        lost = [f"Trial {spec.name} was left out: it has neither tracks nor a video." for spec in left_out]
        return (*lost, *(f"Of the robot's file: {doubt}" for doubt in robot_doubts(self._robot)))

    @property
    def swims(self) -> list[MeasuredTrial]:
        """All usable swims of the session, measured; the tracks of all its trials are then in ``results/tracks``.

        Raises:
            InputError: videos or boxes cannot be used; all of them at once.
            NotEnoughData: no usable swim, or none to be fitted that can be measured; all of them at once.
        """
        if not self.has_swims:
            found = ", ".join(f"{spec.name} ({spec.kind})" for spec in self._session.trials)
            raise NotEnoughData(
                f'{self._session.name}: no swim with tracks. Expected at least one [[trial]] with kind = "swim" and a '
                f"tracks file or a video, for the fluid coefficients; found {found}. {' '.join(self.notes)}".rstrip()
            )
        return [trial for trial in self._measured if isinstance(trial, MeasuredTrial)]

    def swim(self, name: str) -> MeasuredTrial:
        """Measure one swim without the others; so it lacks the flags that come of comparing them.

        Raises:
            InputError, NotEnoughData: as `swims`, of this trial.
            StopIteration: no usable swim has this name.
        """
        spec = next(spec for spec in self._usable if spec.name == name and spec.kind == "swim")
        measured = self._measure(spec, self._recorded(spec))
        assert isinstance(measured, MeasuredTrial)
        return measured

    def look_at_trials(self) -> list[tuple[TrialSpec, AnyTrial | str]]:
        """Measure each trial given by tracks, and write nothing; why not where that is impossible."""
        looked: list[tuple[TrialSpec, AnyTrial | str]] = []
        for spec in self._usable:
            if spec.name in self._repeated:
                looked.append((spec, self._repeated[spec.name]))
            elif spec.tracks is not None:
                try:
                    looked.append((spec, self._measure_alone(spec, self._recorded(spec))))
                except NotEnoughData as problem:
                    looked.append((spec, self._reason(spec, problem)))
                except InputError as problem:
                    looked.append((spec, str(problem)))
        compared = iter(self._compared([trial for _, trial in looked if not isinstance(trial, str)]))
        return [(spec, trial if isinstance(trial, str) else next(compared)) for spec, trial in looked]

    @property
    def swims_left_out(self) -> dict[str, str]:
        """Why, by name, of the usable swims that cannot be measured."""
        _ = self._measured
        return {spec.name: why for spec, why in self._unmeasured if spec.kind == "swim"}

    @property
    def left_out(self) -> dict[str, str]:
        """Why, by name, of all usable trials that cannot be measured, whether others can or not."""
        with suppress(NotEnoughData):
            _ = self._measured
        return {spec.name: str(why) for spec, why in self._unmeasured}

    @property
    def experiments(self) -> DryExperiments:
        """All usable free decays and dry runs of the session that may be fitted, measured, and why others are not used.

        Raises:
            InputError, NotEnoughData: as `swims`; an experiment that cannot be measured stops nothing.
        """
        measured = self._measured
        held_out = {spec.name: spec for spec in self._usable if spec.kind != "swim" and spec.role == "holdout"}
        lost: dict[str, dict[str, str]] = {"free_decay": {}, "dry": {}}
        for spec, why in (*((spec, HELD_OUT) for spec in held_out.values()), *self._unmeasured):
            if spec.kind != "swim":
                lost[spec.kind][spec.name] = why
        decays = [trial for trial in measured if isinstance(trial, DecayTrial) and trial.name not in held_out]
        runs = [trial for trial in measured if isinstance(trial, DryTrial) and trial.name not in held_out]
        return DryExperiments(decays, runs, lost["free_decay"], lost["dry"])

    @property
    def in_air(self) -> ExperimentsInAir:
        """All usable free decays and dry runs that may be fitted, as a diagnosis reads them: runs measured as swims.

        Raises:
            InputError, NotEnoughData: as `swims`.
        """
        runs = []
        for spec in self._usable:
            if spec.kind == "dry" and spec.role == "fit":
                with suppress(NotEnoughData):  # one that cannot be measured is left out
                    runs.append(self._measure_swim(spec, self._recorded(spec)))
        return ExperimentsInAir(runs, self.experiments.decays)

    @property
    def has_swims(self) -> bool:
        """Return whether there is a usable swim."""
        return any(spec.kind == "swim" for spec in self._usable)

    @property
    def has_experiments(self) -> bool:
        """Return whether there is a usable free decay or dry run."""
        return any(spec.kind != "swim" for spec in self._usable)

    @property
    def recorded(self) -> dict[str, xr.Dataset]:
        """Tracks of a camera, by trial; videos are tracked, unless their tracks are current, or they cannot be read.

        Raises:
            InputError: what is wrong with any of them.
        """
        found = {}
        for spec in self._usable:
            with suppress(NotEnoughData):
                found[spec.name] = self._recorded(spec)
        return found

    def tracks(self) -> tuple[Path, ...]:
        """Bring ``results/tracks/<trial>.csv`` of every usable trial up to date."""
        filmed = self._filmed()  # raises what is wrong with any of them, before the first is tracked
        for spec in filmed:
            if not self.videos.are_current(spec):
                self.videos.tracks(spec)
        if not self._are_saved:
            _ = self._measured
        return tuple(self._file(spec.name) for spec in self._usable if spec.tracks is not None or spec in filmed)

    def _filmed(self) -> list[TrialSpec]:
        """Find the trials that are tracked here, without those whose video or boxes cannot be used.

        Raises:
            InputError: what is wrong with the boxes of any of them.
        """
        filmed = [spec for spec in self._usable if spec.tracks is None]
        readable = of_each(filmed, partial(_or_left_out, self.videos.boxes)).made
        return [spec for spec in filmed if spec.name in readable]

    @property
    def are_current(self) -> bool:
        """Return whether the tracks in ``results/tracks`` are of these recordings, which were checked on writing.

        Raises:
            InputError: as `fingerprint`.
        """
        filmed = (spec for spec in self._usable if spec.tracks is None)
        return self._are_saved and all(map(self.videos.are_current, filmed))

    @property
    def _are_saved(self) -> bool:
        return all(self._stage(spec).is_current for spec in self._usable if spec.tracks is not None)

    @cached_property
    def _usable(self) -> tuple[TrialSpec, ...]:
        """Those that a camera saw."""
        return tuple(spec for spec in self._session.trials if spec.tracks is not None or spec.video is not None)

    @cached_property
    def _measured(self) -> list[AnyTrial]:
        """All usable trials that can be measured, in the order of the session.

        Raises:
            NotEnoughData: no swim that is to be fitted can be measured, or nothing at all; several, all tail first.
        """
        measured, problems, faults = [], [], FaultCollector()
        for spec in self._usable:
            if spec.name in self._repeated:
                problems.append((spec, self._repeated[spec.name]))
                continue
            self._job.progress(f"reading {spec.name}")
            try:
                with faults.nested():
                    measured.append(self._measure(spec, self._recorded(spec)))
            except NotEnoughData as problem:
                problems.append((spec, self._reason(spec, problem)))
        faults.raise_if_any()
        self._unmeasured = tuple(problems)
        fitted = any(isinstance(trial, MeasuredTrial) and trial.role == "fit" for trial in measured)
        lacking = not fitted and any(spec.kind == "swim" and spec.role == "fit" for spec, _ in problems)
        if problems and (lacking or not measured):
            raise NotEnoughData("\n".join(f"trial {spec.name}: {why}" for spec, why in problems))
        for spec in (spec for spec, _ in problems if spec.tracks is not None):
            tracks = mask_untrusted(self._recorded(spec))
            self._save(spec, tracks, partial(np.ones, tracks.confidence.shape))
        _check_direction([trial for trial in measured if isinstance(trial, MeasuredTrial)])
        return self._compared(measured)

    def _compared(self, measured: Sequence[AnyTrial]) -> list[AnyTrial]:
        """Give the swims among trials one scale, and flag those that are unlike the others."""
        swims = [trial for trial in measured if isinstance(trial, MeasuredTrial)]
        scaled = {trial.name: trial for trial in with_common_scale(swims, self._session.camera.scale_length_m)}
        everyone = list(scaled.values())
        compared = [scaled.get(trial.name, trial) for trial in measured]
        for found in (odd_markers(everyone, self._robot), carried_swims(everyone), _shared(everyone)):
            compared = [
                replace(trial, flags=(*trial.flags, found[trial.name])) if trial.name in found else trial
                for trial in compared
            ]
        return compared

    def _reason(self, spec: TrialSpec, problem: NotEnoughData) -> str:
        """Say why a trial cannot be measured, and which flags took most samples from it."""
        why = without_trial(spec.name, problem)
        try:
            recorded = self._recorded(spec)
        except (InputError, NotEnoughData):
            return why
        tracks = mask_untrusted(recorded)
        flags = (*recorded.flags, *check_tracks(tracks, self._robot, FLOOR_PX).flags)
        samples = {flag: len(flag.markers) * (flag.frames[1] - flag.frames[0] + 1) for flag in flags if flag.frames}
        told = (flag for flag in samples if samples[flag] > _MANY * tracks.confidence.size and flag.message not in why)
        worst = sorted(told, key=lambda flag: -samples[flag])[:_TOLD]
        return ". ".join([why.removesuffix("."), *(f"{flag.kind}: {flag.message}" for flag in worst)])

    @cached_property
    def _repeated(self) -> dict[str, str]:
        """Why, by name, of trials whose recording is that of another one: one file under several names.

        Where all their commands agree one of them stays, a fit trial if there is one. Where they do not, nobody knows
        whose recording it is.
        """
        of_size, why = defaultdict(list), dict[str, str]()
        for spec in sorted(self._usable, key=lambda spec: spec.role != "fit"):
            of_size[_file_of(spec).stat().st_size].append(spec)
        for alike in (each for each in of_size.values() if len(each) > 1):
            of_content = defaultdict(list)
            for spec in alike:
                of_content[sha256_of(_file_of(spec))].append(spec)
            for first, *others in of_content.values():
                said = "its recording is that of {}: give each its own, or remove one"
                why |= {spec.name: said.format(first.name) for spec in others}
                if any(spec.commanded_hz != first.commanded_hz for spec in others):
                    why[first.name] = said.format(others[0].name)
        return why

    def _recorded(self, spec: TrialSpec) -> xr.Dataset:
        if spec.tracks is None:
            return _or_left_out(self.videos.tracks, spec)
        if spec.name not in self._given:
            self._given[spec.name] = self._load(spec, spec.tracks)
        return self._given[spec.name]

    def _load(self, spec: TrialSpec, file: Path) -> xr.Dataset:
        """Read the tracks of a trial, with the flags of an uneven clock and of markers that are exchanged."""
        session = self._session
        fps = session.camera_of(spec).fps
        tracks, uneven = with_even_clock(load_tracks(file, session.markers, fps, rename=session.rename, seen=False))
        tracked = as_tracked(tracks)
        return tracked.assign_attrs(flags=(*uneven, *exchanged_apart(tracked, self._robot)))

    def _measure(self, spec: TrialSpec, recorded: xr.Dataset) -> AnyTrial:
        """Measure one trial; tracks that are not our own are saved as they are used."""
        trial = self._measure_alone(spec, recorded)
        tracks = mask_untrusted(recorded).isel(time=slice(recorded.first_frame, None))
        floor_px = FAR_OUT_PX if spec.kind == "free_decay" else FLOOR_PX
        if isinstance(trial, MeasuredTrial):
            self._save(spec, tracks, lambda: trial.weight_of(len(tracks.time.values)))
        else:
            self._save(spec, tracks, lambda: check_tracks(tracks, self._robot, floor_px).weight)
        return trial

    def _measure_alone(self, spec: TrialSpec, recorded: xr.Dataset) -> AnyTrial:
        """Measure one trial by its kind."""
        tracks = mask_untrusted(recorded).isel(time=slice(recorded.first_frame, None))
        if np.isnan(pixels_of(tracks)).all():
            raise NotEnoughData(f"trial {spec.name}: {UNSEEN}. Track it again, or take it out of session.toml")
        camera, robot = self._session.camera_of(spec), self._robot
        if spec.kind == "free_decay":
            decay = measure_decay_trial(spec.name, tracks, camera, robot)
            decay = replace(decay, first_frame=decay.first_frame + recorded.first_frame)
            return self._flagged(decay, recorded, decay.metres_per_px)
        if spec.kind == "dry":
            motor = self._motor(spec, tracks)
            run = measure_dry_run(spec, tracks, camera, robot, self._session.warmup_s, motor)
            return self._flagged(run, recorded)
        return self._measure_swim(spec, recorded)

    def _measure_swim(self, spec: TrialSpec, recorded: xr.Dataset) -> MeasuredTrial:
        tracks = mask_untrusted(recorded).isel(time=slice(recorded.first_frame, None))
        motor = self._motor(spec, tracks)
        swim = measure_trial(spec, tracks, self._session.camera_of(spec), self._robot, self._session.warmup_s, motor)
        return self._flagged(swim, recorded, swim.metres_per_px)

    def _motor(self, spec: TrialSpec, tracks: xr.Dataset) -> MotorRecord | None:
        """Read the motor log of a trial, once: a dry run is measured twice, for the structure and as a swim."""
        if spec.name not in self._motors:
            self._motors[spec.name] = read_motor(spec, tracks, self._session.camera_of(spec), self._robot)
        return self._motors[spec.name]

    def _flagged(self, trial: T, recorded: xr.Dataset, metres_per_px: float | None = None) -> T:
        """Return the trial with the flags of tracker or exchange added, and of the lens if it was filmed."""
        if recorded.picture_px is None:
            return replace(trial, flags=(*recorded.flags, *trial.flags)) if recorded.flags else trial
        of_lens = lens_flags(self._session.camera, mask_untrusted(recorded), recorded.picture_px, metres_per_px)
        own = drop_repeat_flags(recorded, (flag.later(recorded.first_frame) for flag in trial.flags))
        flags = (*recorded.flags, *own, *of_lens)
        return replace(trial, flags=tuple(dict.fromkeys(flags)))

    def _file(self, trial: str) -> Path:
        return self._session.results / "tracks" / f"{trial}.csv"

    def _stage(self, spec: TrialSpec) -> Stage:
        return Stage(self._file(spec.name), {}, {}, [self])

    def _save(self, spec: TrialSpec, tracks: xr.Dataset, weight: Callable[[], np.ndarray]) -> None:
        """Write the tracks as they are used: a sample that does not count keeps its place, with confidence 0."""
        stage = self._stage(spec)
        if spec.tracks is None or stage.is_current:
            return
        confidence = np.where(weight() > 0, tracks.confidence.values, 0.0)
        save_tracks(stage.file, tracks.assign(confidence=(("time", "keypoint"), confidence)))
        stage.mark()


def _shared(swims: Sequence[MeasuredTrial]) -> dict[str, Flag]:
    """Flag each swim, by its name, that shares frames with a fit trial: both are cut from one recording, or are one."""
    flags, fitted = dict[str, Flag](), list[MeasuredTrial]()
    for swim in sorted(swims, key=lambda swim: swim.role != "fit"):
        count = len(swim.time_s)
        shared = {other.name: shared_frames(swim.tracks, other.tracks) for other in fitted}
        first = max(shared, key=lambda name: shared[name], default="")
        if first and shared[first] > _SHARED * count:
            why = "they are fitted twice" if swim.role == "fit" else "they were fitted, so they check no forecast"
            message = f"{shared[first]} of its {count} frames are frames of {first}, too: {why}"
            flags[swim.name] = Flag("shared_frames", message=message)
        if swim.role == "fit":
            fitted.append(swim)
    return flags


def _check_direction(swims: Sequence[MeasuredTrial]) -> None:
    """Check that not all of several swims go tail first.

    Raises:
        NotEnoughData: they do: what follows would be fitted to a robot that swims backward.
    """
    backward = [swim for swim in swims if any(flag.kind == TAIL_FIRST for flag in swim.flags)]
    if len(backward) > 1 and len(backward) == len(swims):
        speeds = ", ".join(f"{swim.name} ({-1000 * swim.speed:.0f} mm/s)" for swim in backward)
        raise NotEnoughData(
            f"every swim goes tail first: {speeds}. Are the names of the markers in the reverse order, from tail to "
            "nose, or nose and neck exchanged? Set [markers] names right, or the headers of the tracks."
        )


def _file_of(spec: TrialSpec) -> Path:
    file = spec.tracks or spec.video
    assert file is not None
    return file


def _or_left_out(make: Callable[[TrialSpec], Made], spec: TrialSpec) -> Made:
    """Make something of a trial.

    Raises:
        NotEnoughData: its boxes are no pose of the robot, as with two names exchanged: the other trials go on.
    """
    try:
        return make(spec)
    except ImpossibleBoxes as problem:
        raise spoiled(spec, Path(problem.faults[0].file), problem) from problem
