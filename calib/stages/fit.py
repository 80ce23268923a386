"""The stages of structure, calibrated twin (``calibration.json``), published fit and posterior.

`StructureStage` evaluates the dry experiments, `FitStage` fits the twin, `PublishedStage` repeats the published
search, `PosteriorStage` draws from the posterior about a fit. `calibrated_mjcf` and `nominal_mjcf` are the twin as
MJCF, fitted and as described.

emcee and ArviZ take a second to load: they are imported where they are needed.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco
import numpy as np
from threadpoolctl import threadpool_limits

from calib.options import PUBLISHED_S, STARTS, EffortName, Job
from calib.stages.recordings import Recordings
from fitting.calibration import (
    CalibratedTrial,
    Calibration,
    calibrate,
    calibrate_as_published,
    calibrate_at,
    compare_trial,
)
from fitting.calibration_file import (
    CALIBRATION,
    PUBLISHED,
    CalibrationResult,
    PublishedResult,
    calibration_result,
    published_result,
)
from fitting.ebt import FORMS
from fitting.mode import Mode, mode_at
from fitting.picture_scale import at_scale
from fitting.progress import part_of
from fitting.session_model import SessionModel
from fitting.structure import (
    BUILT_IN,
    STRUCTURE,
    Structure,
    assumed,
    identify_structure,
    read_structure,
    uncertainties_of,
    with_sources,
)
from fitting.trial import MeasuredTrial
from swimcal.errors import NotConverged, SwimcalError
from swimcal.mjcf import PUBLISHED_COEFFICIENTS, add_scenery, build_mjcf
from swimcal.results import Provenance, program_version, read_provenance, write_whole, writing_whole
from swimcal.robot import RobotSpec
from swimcal.runs import ENGINE, Runs, check_engine, model_sha256
from swimcal.stage import Stage
from swimcal.twin import Twin

if TYPE_CHECKING:
    from fitting.coefficient_fit import Marginal
    from fitting.posterior.summary import PosteriorSummary

EFFECTIVE = {"quick": 100, "full": 400}
"""Number of effective draws of every coefficient, by effort."""

_FORM = 31  # version of calibration.json, and of the search that fills it
_FORM_OF_POSTERIOR = 17  # version of the posterior's files and of their computation
_STEADY_BEATS = 20  # after which a swim is steady
_HOW_TO_USE = f"""
Made for MuJoCo {ENGINE}. Releases compute different fluid forces: in MuJoCo 3 this file loads, but swims another way.
The robot swims towards -x. The control is the speed of the crank, rad/s: 2 pi for one beat a second. Start from a
keyframe. Contacts are switched off, as no wall belongs to the robot. To switch them on, delete constraint="disable"
and contact="disable" below; give the robot's geoms contype="1" conaffinity="2", and walls contype="2" conaffinity="1",
so that the robot does not touch itself.
"""
_UPON = ("posterior.nc", "diagnosis.json", "report.html")  # results that rest on a fit


class StructureStage(Stage):
    """The stage of ``results/structure.json`` and its arrays; neither file is there without a dry experiment."""

    def __init__(self, job: Job, recordings: Recordings) -> None:
        super().__init__(job.results / STRUCTURE.name, {}, {"form": 3}, [recordings])
        self._job, self._recordings = job, recordings

    def current(self) -> Structure:
        """Return what the dry experiments determine, up to date, and what had to be assumed.

        Raises:
            InputError, NotEnoughData: what is wrong with the trials, all of them at once.
        """
        job = self._job
        if not self._recordings.has_experiments:
            return assumed(job.robot, self._origin)
        self.ensure(self._make)
        return read_structure(job.results, job.robot, self._recordings.experiments.runs)

    @property
    def is_up_to_date(self) -> bool:
        """Return whether the files are current, or there is no dry experiment to write about."""
        return self.is_current or not self._recordings.has_experiments

    @property
    def _origin(self) -> str:
        file = self._job.session.robot_file
        return BUILT_IN if file is None else file.name

    def _make(self) -> tuple[Path, ...]:
        job, experiments = self._job, self._recordings.experiments
        job.note_incomplete(self.incomplete)
        found = identify_structure(experiments, job.robot, self._origin, job.options.workers, job.progress)
        written = STRUCTURE.write(job.results, job.provenance, found)
        job.made.extend(written)
        for source in found.sources:
            job.progress(source.sentence)
        return written


class FitStage(Stage):
    """The stage of the five coefficients, elongated body theory, and every trial with the twin."""

    def __init__(self, job: Job, recordings: Recordings, structures: StructureStage, effort: EffortName) -> None:
        self._job, self._recordings, self._structures = job, recordings, structures
        self.effort = effort
        settings = {"seed": job.session.seed, "effort": effort, "form": _FORM}
        super().__init__(job.results / CALIBRATION.name, {}, settings, [recordings])

    def current(self) -> Calibration:
        """Return the calibration, up to date: searched for, or read back and every trial simulated again.

        Raises:
            NotEnoughData: no fit trial, or trials without a usable sample; all of them at once.
        """
        return self.read() if self.is_current else self._calibrate()

    def read(self) -> Calibration:
        """Read the calibration in `calibration.json`: only the comparison is simulated again.

        Raises:
            ModelMismatch: it was made with another engine, or another robot than the session describes; what the
                session's dry experiments determine is in its structure.
        """
        job, made_with = self._job, read_provenance(self.file)
        check_engine(made_with, job.robot, str(self.file))
        result = CALIBRATION.read(job.results)
        phases = {name: trial.phase_rad for name, trial in result.trials.items()}
        structure = self._structures.current().with_time_step(result.fit.time_step_s)
        trials = self.trials
        twin = Twin(structure.robot, trials[0].markers, workers=job.options.workers)
        others = result.forecasts, result.sways, result.left_out
        return calibrate_at(trials, twin, result.fit, phases, structure, *others)

    def read_trial(self, name: str) -> CalibratedTrial:
        """Simulate one swim of this fit with its twin again; no other trial is measured.

        The speeds by elongated body theory are those that the fit keeps.

        Raises:
            ModelMismatch: as `read`.
        """
        check_engine(read_provenance(self.file), self._job.robot, str(self.file))
        result = self.result()
        measured = at_scale(self._recordings.swim(name), result.trials[name].metres_per_px)
        hz = [trial.frequency_hz for trial in result.trials.values() if trial.role == "fit"]
        twin = Twin(self.robot, measured.markers, workers=self._job.options.workers)
        phase_rad = result.trials[name].phase_rad
        found = compare_trial(twin, measured, result.coefficients, {}, phase_rad, (min(hz), max(hz)))
        kept = result.forecasts.trials[name].forecasts
        theory = {form.name: kept[f"ebt_{form.name}"].speed for form in FORMS if f"ebt_{form.name}" in kept}
        return replace(found, speeds={**found.speeds, **theory})

    @property
    def trials(self) -> list[MeasuredTrial]:
        """The measured swims that take part in this fit."""
        taken = self.result().trials
        return [trial for trial in self._recordings.swims if trial.name in taken]

    def result(self) -> CalibrationResult:
        """Read the content of `calibration.json`.

        Raises:
            InputError: there is none of this version.
        """
        return CALIBRATION.read(self._job.results)

    def add_posterior(self, marginals: Mapping[str, Marginal]) -> None:
        """Put the posterior of the coefficients into `calibration.json`; everything else stays as it is."""
        job = self._job
        written = CALIBRATION.write(job.results, self._provenance, replace(self.result(), posterior=marginals))
        self.mark((*written, self.mjcf_file))

    @property
    def robot(self) -> RobotSpec:
        """The robot with what its dry experiments determined and the twin's time step, as the fit keeps them."""
        result = self.result()
        return with_sources(self._job.robot, result.structure.values()).with_time_step(result.fit.time_step_s)

    @property
    def mjcf_file(self) -> Path:
        """The path of ``calibrated.xml``."""
        return self.file.with_name("calibrated.xml")

    @property
    def name(self) -> str:
        """The name of the fit, in words."""
        return f"fit of {self.effort} effort"

    @property
    def _provenance(self) -> Provenance:
        return replace(self._job.provenance, effort=self.effort)

    def _calibrate(self) -> Calibration:
        job = self._job
        self._report_why_again()
        structure, trials = self._structures.current(), self._recordings.swims  # the structure needs no swim
        starts, workers = STARTS[self.effort], job.options.workers
        left_out = self._recordings.swims_left_out
        tell = job.progress_of("fit")
        calibration = calibrate(trials, structure, starts, job.session.seed, workers, tell, left_out)
        mjcf = calibrated_mjcf(calibration)
        if (step_s := calibration.robot.time_step_s) != structure.robot.time_step_s:
            coarse_ms = 1000 * structure.robot.time_step_s
            job.notes.append(
                f"The twin's time step is {1000 * step_s:g} ms: with {coarse_ms:g} ms it swims at another speed. "
                f"Simulations take {structure.robot.time_step_s / step_s:.0f} times as long."
            )
        if (kept := self.keep_aside(job.results / name for name in _UPON)) is not None:
            job.notes.append(f"The previous fit, with what depends on it, is kept in {kept}.")
        written = (*CALIBRATION.write(job.results, self._provenance, calibration_result(calibration)), self.mjcf_file)
        write_whole(self.mjcf_file, mjcf)
        self.mark(written)
        job.made.extend(written)
        return calibration

    def _report_why_again(self) -> None:
        """Report what differs from the calibration that is about to be replaced."""
        job = self._job
        job.note_incomplete(self.incomplete)
        try:
            made_with = read_provenance(self.file)
        except SwimcalError:
            return
        then, now = made_with.to_json(), self._provenance.to_json()
        differ = [_describe_difference(key, then[key], now[key]) for key in now if then[key] != now[key]]
        if differ:
            job.progress(f"refitting: the existing fit {'; it '.join(differ)}", 0.0)


class PublishedStage(Stage):
    """The stage of ``results/published.json``: the published search, for comparison; the fit stays as it is."""

    def __init__(self, job: Job, recordings: Recordings, structures: StructureStage, effort: EffortName) -> None:
        self._job, self._recordings, self._structures, self.effort = job, recordings, structures, effort
        settings = {"seed": job.session.seed, "effort": effort, "form": 3}
        super().__init__(job.results / PUBLISHED.name, {}, settings, [recordings])

    def make(self) -> None:
        """Search and write what was found.

        Raises:
            SimulationDiverged: no point that swims forward was found.
        """
        job, structure = self._job, self._structures.current()
        budget_s, workers = PUBLISHED_S[self.effort], job.options.workers
        tell = job.progress_of("published search")
        found = calibrate_as_published(self._recordings.swims, structure, budget_s, job.session.seed, workers, tell)
        self.keep_aside()
        written = PUBLISHED.write(job.results, replace(job.provenance, effort=self.effort), published_result(*found))
        self.mark(written)
        job.made.extend(written)

    def read(self) -> PublishedResult:
        """Read what was found."""
        return PUBLISHED.read(self._job.results)


def _describe_difference(key: str, then: object, now: object) -> str:
    """Say what the existing fit was made with: for inputs their names."""
    if key == "effort":
        return f"used --effort {then}; you asked for {now}"
    if isinstance(then, dict) and isinstance(now, dict):
        names = [name for name in sorted({*then, *now}) if then.get(name) != now.get(name)]
        return f"was made with other {key} ({', '.join(names[:3])}{' and others' if len(names) > 3 else ''})"
    return f"was made with other {key} ({str(then)[:12]}, now {str(now)[:12]})"


# The posterior.


class PosteriorStage(Stage):
    """The stage of ``results/posterior.nc`` and ``posterior.json``, and of `posterior` in ``calibration.json``."""

    def __init__(self, job: Job, fit: FitStage, effort: EffortName) -> None:
        self._job, self._fit, self.effort = job, fit, effort
        file = job.results / "posterior.nc"
        super().__init__(file, {}, {"form": _FORM_OF_POSTERIOR, "effort": self.effort}, [fit])

    @threadpool_limits.wrap(limits=1, user_api="blas")  # several threads round sums differently, and so the bands
    def make(self) -> None:
        """Sample the posterior about the fit and write it.

        Raises:
            ModelMismatch: the fit was made with another engine or robot.
            NotConverged: too few effective draws, or chains that disagree; nothing is written.
        """
        from fitting.posterior.posterior import sample_posterior, save_draws
        from fitting.posterior.summary import SUMMARY, summarise

        job, trials = self._job, self._fit.trials
        check_engine(read_provenance(self._fit.file), job.robot, str(self._fit.file))
        tell = job.progress_of("posterior")
        tell("building the model about the fit", 0.0)
        twin = Twin(self._fit.robot, trials[0].markers, workers=job.options.workers)
        mode = mode_of(self._fit.result(), trials, twin)
        posterior = sample_posterior(mode, EFFECTIVE[self.effort], job.session.seed, part_of(tell, 0.06, 0.62))
        if posterior.draws.flags:
            why = posterior.draws.flags[0].message
            raise NotConverged(
                f"{self.file}: not written, nor are intervals reported; found: {why}. Look into the flags of the fit "
                "trials, leave out faulty ones, or try another [fit] seed in session.toml."
            )
        summary = summarise(posterior, trials, job.session.seed, part_of(tell, 0.62, 1.0))
        provenance = replace(job.provenance, effort=self.effort)
        stamp = {key: value for key, value in provenance.to_json().items() if isinstance(value, str | int)}
        job.note_incomplete(self.incomplete)
        if (kept := self.keep_aside()) is not None:
            job.notes.append(f"The previous posterior is kept in {kept}.")
        with writing_whole(self.file) as part:
            save_draws(part, posterior, stamp)
        written = (self.file, *SUMMARY.write(job.results, provenance, summary))
        self._fit.add_posterior(posterior.marginals)
        self.mark(written)
        job.made.extend(written)

    def read(self, draws: bool = True) -> PosteriorSummary | None:
        """Read the summary of the posterior of this calibration, with its draws or without.

        None where there is none.
        """
        from fitting.posterior.summary import read_summary

        return read_summary(self._job.results, draws) if self.is_current else None


def mode_of(found: CalibrationResult, trials: Iterable[MeasuredTrial], twin: Twin) -> Mode:
    """Rebuild the mode that a fit keeps, where it lies, without a search.

    Args:
        found: the fit.
        trials: the trials that take part in it.
        twin: the twin of the calibrated robot.
    """
    fitted = sorted((trial for trial in trials if trial.role == "fit"), key=lambda trial: trial.name)
    model = SessionModel.of(twin, fitted, uncertainties_of(found.structure.values()), with_course=True)
    fit = found.fit
    return mode_at(model, np.array(fit.coefficients), fit.components, fit.roll, fit.ends)


# The twin as MJCF.


def calibrated_mjcf(calibration: Calibration) -> str:
    """Write the text of `results/calibrated.xml`.

    One keyframe a fit trial, named like it, starts the twin as that trial started: swimming, with the crank turning
    at the measured frequency (its control is part of the keyframe). The keyframe `steady_swim` starts it in the steady
    swim at the frequency of the first of them.
    """
    robot = calibration.robot
    spec = add_scenery(build_mjcf(robot, calibration.coefficients), robot)
    made_with = f"{program_version()}, MuJoCo {ENGINE}, model {model_sha256(robot)}"
    spec.add_text(name="calibrated_with", data=made_with)
    for trial in calibration.trials:
        if trial.measured.role == "fit":
            start = (trial.simulated_hz, trial.phase_rad, trial.measured.start_velocity)
            _add_keyframe(spec, robot, trial.measured.name, *start)
    _add_steady_swim(spec)
    return mjcf_text(spec)


def nominal_mjcf(robot: RobotSpec) -> str:
    """Write the MJCF of a robot with the published coefficients; its keyframe `swim` turns the crank at 1 Hz."""
    spec = add_scenery(build_mjcf(robot), robot)
    _add_keyframe(spec, robot, "swim", 1.0, 0.0, np.zeros(3))
    return mjcf_text(spec)


def mjcf_text(spec: mujoco.MjSpec) -> str:
    """Convert a model to text, with how to use it on top, and check that it loads."""
    spec.comment = _HOW_TO_USE
    spec.compile()
    text: str = spec.to_xml()
    mujoco.MjModel.from_xml_string(text)  # raises if the text does not load
    return text


def _add_keyframe(
    spec: mujoco.MjSpec, robot: RobotSpec, name: str, hz: float, phase_rad: float, velocity: np.ndarray
) -> None:
    coefficients = np.array([PUBLISHED_COEFFICIENTS], float)  # they have no influence on the start
    runs = Runs(coefficients, np.array([hz]), np.array([phase_rad]), velocity=velocity[None])
    qpos, qvel = Twin(robot, markers=("nose", "neck")).start(runs)
    spec.add_key(name=name, qpos=qpos[0], qvel=qvel[0], ctrl=[2 * np.pi * hz])


def turn_start(
    model: mujoco.MjModel, qpos: np.ndarray, qvel: np.ndarray, by_rad: float
) -> tuple[np.ndarray, np.ndarray]:
    """Turn a state of the twin about the origin of the pool, anticlockwise seen from above; return place and velocity.

    Args:
        model: the twin.
        qpos: (nq,) its place.
        qvel: (nv,) its velocity.
        by_rad: the angle, rad.
    """
    qpos, qvel = qpos.copy(), qvel.copy()
    turn = np.array([[np.cos(by_rad), -np.sin(by_rad)], [np.sin(by_rad), np.cos(by_rad)]])
    place = [model.joint(name).qposadr[0] for name in ("surge", "sway")]
    moving = [model.joint(name).dofadr[0] for name in ("surge", "sway")]
    qpos[place], qvel[moving] = turn @ qpos[place], turn @ qvel[moving]
    qpos[model.joint("yaw").qposadr[0]] += by_rad
    return qpos, qvel


def _add_steady_swim(spec: mujoco.MjSpec) -> None:
    """Add a keyframe with the state after some beats from the first keyframe, moved back to the origin, along -x."""
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, 0)
    beat_s = 2 * np.pi / data.ctrl[0]
    mujoco.mj_step(model, data, nstep=round(_STEADY_BEATS * beat_s / model.opt.timestep))
    if not np.isfinite(data.qpos).all() or data.time < beat_s:  # it blew up, and was reset
        return
    qpos, qvel = turn_start(model, data.qpos, data.qvel, -float(data.joint("yaw").qpos[0]))
    qpos[[model.joint(name).qposadr[0] for name in ("surge", "sway", "yaw")]] = 0.0
    qpos[model.joint("crank").qposadr[0]] %= 2 * np.pi
    spec.add_key(name="steady_swim", qpos=qpos, qvel=qvel, ctrl=data.ctrl.copy())
