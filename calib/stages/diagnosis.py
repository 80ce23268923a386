"""The stage of the diagnosis, and the MJCF of the twin with the named effects.

`DiagnosisStage` leads from measured swims to ``results/diagnosis.json``. `write_affected_twin` writes the twin with the
effects that it fitted: MJCF, and a script for what no MJCF can hold.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar

import numpy as np

from calib.options import EffortName, Job
from calib.stages.fit import FitStage, mjcf_text, turn_start
from calib.stages.recordings import Recordings
from diagnosis.diagnose import Settings, diagnose, weigh_effects
from diagnosis.diagnosis_file import beside_exported_twin, diagnosis_result, effect_test_result, of_session
from diagnosis.discrepancy import Discrepancy, discrepancy_for
from diagnosis.held_out import SettledTwin
from diagnosis.linear_model import LinearModel, SessionData
from diagnosis.refit import Refit
from diagnosis.result import DIAGNOSIS, EFFECT_TEST, DiagnosisResult, EffectTestResult
from fitting.affected_trials import views_of
from fitting.calibration_file import doubted_trials
from fitting.phase import fit_phase
from reports.page import environment
from swimcal.effects.affected_twin import AffectedRuns, AffectedTwin
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect, View
from swimcal.errors import Fault, InputError, did_you_mean
from swimcal.mjcf import FluidCoefficients, add_scenery
from swimcal.results import Provenance, program_version, write_whole
from swimcal.runs import ENGINE
from swimcal.session_file import CameraSpec
from swimcal.stage import HasFingerprint, Stage
from swimcal.twin import Twin

_LONGEST = 120  # characters of a value in a message
_FORM = 42  # version of the files and of the computation


Found = TypeVar("Found")


@dataclass(frozen=True, eq=False)
class ReferenceSession:
    """A session of the same robot, camera and water, filmed before something changed.

    Attributes:
        job: the work on it.
        recordings: its measured trials.
        fit: its fit, whose twin foretells the changed session.
    """

    job: Job
    recordings: Recordings
    fit: FitStage

    @property
    def fingerprint(self) -> str:
        """A hash over all that a comparison takes from it."""
        return self.fit.fingerprint

    def check(self, job: Job) -> None:
        """Check that another session is of the same robot and camera.

        Raises:
            InputError: what differs, all of it at once.
        """
        own, other = self.job.session, job.session
        step = "A comparison needs the same robot, markers and camera in both; see docs/howto/compare-sessions.md."
        pairs = {
            "robot": (self.job.robot, job.robot, "another robot than the reference's"),
            "markers": (own.markers, other.markers, "other markers than the reference's"),
            "camera.scale_length_m": (
                round(own.camera.scale_length_m, 5),
                round(other.camera.scale_length_m, 5),
                "another distance from nose to neck than the reference's, so that all lengths would differ",
            ),
            "camera.calibration": (
                own.camera.calibration,
                other.camera.calibration,
                "another lens than the reference's",
            ),
        }
        faults = [
            Fault(str(other.folder), key, what, _in_short(there), _in_short(here), next_step=step)
            for key, (here, there, what) in pairs.items()
            if here != there
        ]
        if own.folder.resolve() == other.folder.resolve():
            what, found = "a session is its own reference", str(own.folder)
            faults.append(Fault("--reference", "", what, found, "the folder of another session"))
        if faults:
            raise InputError(faults)


def _in_short(value: object) -> str:
    text = ", ".join(value) if isinstance(value, tuple) else str(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"


class DiagnosisStage(Stage):
    """The stage of ``results/diagnosis.json``, and ``calibrated+<effects>.xml``.

    It also makes ``calibrated+everything.xml``, where the evidence supports all effects together.

    Args:
        job: the work on the session.
        recordings: the measured trials.
        fit: the fit, which has the coefficients of the plain twin.
        effort: "quick" or "full".
        without: names of effects that the catalogue is to lack.
        own: further effects that it is to have.
        reference: the session that this one is compared with; None without one.
    """

    def __init__(
        self,
        job: Job,
        recordings: Recordings,
        fit: FitStage,
        effort: EffortName,
        without: frozenset[str] = frozenset(),
        own: tuple[Effect, ...] = (),
        reference: ReferenceSession | None = None,
    ) -> None:
        self._job, self._recordings, self._fit, self._without, self._own = job, recordings, fit, without, own
        self._reference = reference
        parameters = {
            name: [list(parameter) for parameter in effect.parameters] for name, effect in self.effects.items()
        }
        self.effort = effort
        settings = {"form": _FORM, "effort": self.effort, "effects": parameters, "seed": job.session.seed}
        after: list[HasFingerprint] = [recordings, fit]
        after += [] if reference is None else [reference]
        super().__init__(job.results / "diagnosis.json", {}, settings, after)

    @cached_property
    def effects(self) -> dict[str, Effect]:
        """The catalogue without the effects that it is to lack, and with the user's own."""
        known = {name: effect for name, effect in catalogue().items() if name not in self._without}
        return known | {effect.name: effect for effect in self._own}

    @property
    def withheld(self) -> frozenset[str]:
        """The effects that the catalogue of the existing diagnosis lacked; empty where that cannot be read."""
        with suppress(InputError):
            return frozenset(self.read().withheld_from_catalogue) & set(catalogue())
        return frozenset()

    @property
    def compared_with(self) -> str | None:
        """The folder of the reference of the existing diagnosis, relative to the session's; None without one."""
        with suppress(InputError):
            reference = self.read().reference
            return None if reference is None else reference.session
        return None

    def make(self, discrepancy: Discrepancy | None = None) -> None:
        """Diagnose and write.

        Args:
            discrepancy: what a refitted twin leaves of features where nothing is wrong; default: what that twin leaves
                of the toolkit's second simulator.

        Raises:
            NotEnoughData: no swim has the role "fit".
            SimulationDiverged: the plain twin.
        """
        job, found = self._job, self._ask(diagnose, self.effects, discrepancy)
        job.note_incomplete(self.incomplete)
        if (kept := self.keep_aside()) is not None:
            job.notes.append(f"The previous diagnosis is kept in {kept}.")
        for path in job.results.glob("calibrated+*"):
            path.unlink()
        best = found.said.best
        twins = {} if best is None else {"+".join(effect.name for effect in best.effects): best}
        if found.everything is not None:
            twins["everything"] = found.everything[0].refit
        robot_file = job.session.robot_file
        models = [
            path
            for name, twin in twins.items()
            for path in write_affected_twin(job.results, found.weighed.linear, twin, name, robot_file)
        ]
        result = diagnosis_result(found, sorted(self._without), [path.name for path in models])
        if self._reference is None:
            result = beside_exported_twin(result, self._fit.result().forecasts)
        else:
            folder = os.path.relpath(self._reference.job.session.folder, job.session.folder)
            result = of_session(result, Path(folder).as_posix())
        written = (*DIAGNOSIS.write(job.results, self._provenance, result), *models)
        self.mark(written)
        job.made.extend(written)

    def test(self, names: Sequence[str]) -> EffectTestResult:
        """Test effects that a user names; writes ``results/supposed.json``, made anew every time.

        Raises:
            NotEnoughData: no swim has the role "fit", or an effect does nothing in these.
            SimulationDiverged: the plain twin.
        """
        effects = [self.effects[name] for name in dict.fromkeys(names)]
        result = effect_test_result(self._ask(weigh_effects, effects))
        EFFECT_TEST.write(self._job.results, self._provenance, result)
        return result

    def read(self) -> DiagnosisResult:
        """Read the content of ``diagnosis.json``.

        Raises:
            InputError: there is none of this version.
        """
        return DIAGNOSIS.read(self._job.results)

    @property
    def _provenance(self) -> Provenance:
        return replace(self._job.provenance, effort=self.effort)

    def _ask(
        self,
        question: Callable[..., Found],
        effects: Mapping[str, Effect] | Sequence[Effect],
        discrepancy: Discrepancy | None = None,
    ) -> Found:
        """Call `diagnose` or `weigh_effects` for this session."""
        job = self._job
        markers = self._fit.trials[0].markers
        # The neck is as far from the nose as the session says: no scale would explain another distance.
        robot = job.robot.with_scale_length(job.session.camera.scale_length_m)
        fits = [self._fit] if self._reference is None else [self._fit, self._reference.fit]
        robot = robot.with_time_step(min(fit.result().fit.time_step_s for fit in fits))
        twin = Twin(robot, markers, workers=job.options.workers)
        known = discrepancy_for(markers, job.robot) if discrepancy is None else discrepancy

        def of(fit: FitStage, camera: CameraSpec, recordings: Recordings) -> SessionData:
            found = fit.result()
            at, doubted = np.array(found.coefficients), doubted_trials(found)
            return SessionData(fit.trials, twin, camera, known, at, recordings.in_air, doubted)

        data = of(self._fit, job.session.camera, self._recordings)
        if (healthy := self._reference) is not None:
            reference = of(healthy.fit, healthy.job.session.camera, healthy.recordings)
            data = replace(data, at=reference.at, doubted=reference.doubted, reference=reference)
        return question(data, effects, Settings(self.effort, seed=job.session.seed), job.progress_of("diagnosis"))


def check_names(option: str, names: Iterable[str], known: Mapping[str, Effect]) -> None:
    """Raise an `InputError` for effects that are not known.

    Args:
        option: the option in the message, such as "--exclude".
        names: names as given.
        known: the known effects, by name.
    """
    what, expected, step = "no effect of the catalogue", "names of the catalogue", "docs/effects.md lists them."
    faults = [
        Fault(option, name, what, repr(name), expected, tuple(known), did_you_mean(name, known) or step)
        for name in names
        if name not in known
    ]
    if faults:
        raise InputError(faults)


def _angle_rad(view: View) -> float:
    """Return the angle in the pool of the direction that points down in the picture, rad."""
    return float(np.arctan2(view.down[1], view.down[0]))


def write_affected_twin(
    results: Path, linear: LinearModel, best: Refit, name: str, robot_file: Path | None
) -> list[Path]:
    """Write ``calibrated+<name>.xml``: robot, coefficients and all of the effects that a model can hold.

    Effects with an axis of the picture (a current) are in the frame of the first fit trial, whose keyframe heads along
    -x. One keyframe a fit trial starts the model as that trial started, in its heading to them. Where MJCF cannot hold
    all of the effects, a script of the same name runs the twin with them.

    Args:
        results: the folder of the results.
        linear: the linearised model of the diagnosis.
        best: the refit with the effects.
        name: names of the effects in the file's name.
        robot_file: the robot's TOML; None for the built-in robot.
    """
    affected = AffectedTwin(linear.twin, best.effects)
    views = views_of(linear.model, linear.camera, tuple(map(float, linear.at)))
    values, coefficients = affected.in_trial(views[0], best.values), FluidCoefficients(*map(float, best.at))
    names = [effect.name for effect in best.effects]
    parameters = ", ".join(
        f"{effect.name}.{parameter.name} = {value:.6g} {parameter.unit}"
        for effect, own in zip(best.effects, best.by_effect.values(), strict=True)
        for parameter, value in zip(effect.parameters, own, strict=True)
    )
    spec = add_scenery(affected.spec(coefficients, values), affected.robot)
    spec.add_text(name="calibrated_with", data=f"{program_version()}, MuJoCo {ENGINE}")
    spec.add_text(name="effects", data=f"{parameters}; in the frame of trial {linear.swims[0].name}")
    model = spec.compile()
    for trial, view in zip(linear.swims, views, strict=False):  # the views of dry runs come last
        own, hz = affected.in_trial(view, best.values), trial.frequency.hz
        phase = fit_phase(SettledTwin(affected, best.values, view), trial, coefficients)
        runs = AffectedRuns(
            best.at[None], np.array([hz]), np.array([phase]), trial.start_velocity[None], values=own[None]
        )
        position, velocity = affected.start(runs)
        # What is the same in every trial, as a wall beside the course, stays with the course.
        turned_rad = 0.0 if np.allclose(own, values) else _angle_rad(views[0]) - _angle_rad(view)
        start = turn_start(model, position[0], velocity[0], turned_rad)
        spec.add_key(name=trial.name, qpos=start[0], qvel=start[1], ctrl=[2 * np.pi * hz])
    paths = [results / f"calibrated+{name}.xml"]
    write_whole(paths[0], mjcf_text(spec))
    if not all(effect.in_mjcf() for effect in best.effects):
        template = environment("calib", escaped=False).get_template("affected_twin.py.j2")
        script = template.render(
            names=names,
            program=program_version(),
            trial=linear.swims[0].name,
            parameters=parameters,
            robot="None  # the built-in one" if robot_file is None else f"Path({str(robot_file)!r})",
            markers=linear.twin.markers,
            values=values.tolist(),
            coefficients=best.at.tolist(),
            axis=views[0].axis_m.tolist(),
            down=views[0].down.tolist(),
            half=float(views[0].half_height_m),
        )
        paths.append(paths[0].with_suffix(".py"))
        write_whole(paths[1], script)
    return paths
