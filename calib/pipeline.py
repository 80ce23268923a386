"""From a session folder to its results, stage by stage; what has not changed is not made again."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Literal

import numpy as np

from calib.calibrated_mjcf import calibrated_mjcf
from fitting import (
    FULL,
    QUICK,
    Calibration,
    Comparison,
    Evidence,
    MeasuredTrial,
    MethodName,
    SearchRun,
    assemble,
    calibrate,
    calibration_payload,
    compare_methods,
    comparison_payload,
    evidence_payload,
    gather_evidence,
    measure_trial,
    read_comparison,
    read_evidence,
    read_fit,
)
from reports import write_report
from session import (
    NotEnoughData,
    Provenance,
    Session,
    SwimcalError,
    Tracks,
    TrialSpec,
    file_hashes,
    fingerprint_of,
    is_current,
    load_session,
    load_tracks,
    mark_current,
    program_version,
    read_result_json,
    save_tracks,
    sha256_of,
    write_result_json,
    write_whole,
)
from swimmer import ENGINE, RobotSpec, Twin, check_engine, load_robot, model_sha256

EffortName = Literal["quick", "full"]
EFFORTS = {"quick": QUICK, "full": FULL}
Tell = Callable[[str, float | None], None]
"""Called with what is going on and the share done, None when unknown."""


def _silent(_message: str, _share: float | None) -> None:
    return


@dataclass(frozen=True)
class Options:
    """How a session is worked on.

    Attributes:
        effort: "quick" or "full".
        workers: threads; 0 for all cores.
        method: the search, see `fitting.METHODS`.
        comparison: what it minimises, see `fitting.Swims`.
        tell: receives progress.
    """

    effort: EffortName = "full"
    workers: int = 0
    method: MethodName = "gradient"
    comparison: Comparison = "published"
    tell: Tell = field(default=_silent)


def open_session(folder: Path) -> Session:
    """Reads and checks a session, its tracks, its robot and its markers included.

    Raises:
        InputError: all faults at once.
    """
    return load_session(folder, lambda file: tuple(load_robot(file).markers))


class Pipeline:
    """The stages of one session. Each first brings up to date what it depends on.

    Args:
        session: as read by `open_session`.
        options: effort, threads, progress.
    """

    def __init__(self, session: Session, options: Options | None = None) -> None:
        self.session = session
        self.options = options or Options()
        self.made: list[Path] = []
        self.said: list[str] = []

    @cached_property
    def robot(self) -> RobotSpec:
        """The session's robot."""
        return load_robot(self.session.robot_file)

    @cached_property
    def provenance(self) -> Provenance:
        """What every result of this run is stamped with."""
        inputs, sha256 = file_hashes(self.session), model_sha256(self.robot)
        return Provenance(ENGINE, sha256, inputs, self.session.seed, self.options.effort)

    @cached_property
    def data_fingerprint(self) -> str:
        """Of the recordings, the robot, the engine and the program."""
        stamp = self.provenance
        return fingerprint_of(stamp.inputs, {"mujoco": stamp.mujoco, "model": stamp.model_sha256})

    @cached_property
    def fingerprint(self) -> str:
        """Of all that the calibration depends on."""
        options = self.options
        parameters = {
            "seed": self.session.seed,
            "effort": options.effort,
            "method": options.method,
            "comparison": options.comparison,
        }
        return fingerprint_of({}, parameters, [self.data_fingerprint])

    @property
    def calibration_file(self) -> Path:
        """`results/calibration.json`."""
        return self.session.results / "calibration.json"

    @property
    def evidence_file(self) -> Path:
        """`results/evidence.json`: what stands beside the fit."""
        return self.session.results / "evidence.json"

    @property
    def search_file(self) -> Path:
        """`results/search.json`: the searches compared, there once `calib benchmark search` ran."""
        return self.session.results / "search.json"

    @property
    def report_file(self) -> Path:
        """`results/report.html`."""
        return self.session.results / "report.html"

    @cached_property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know about the trials that were left out."""
        left_out = [spec for spec in self.session.trials if not _is_usable(spec)]
        return tuple(f"Trial {spec.name} was left out: {_why_left_out(spec)}." for spec in left_out)

    @cached_property
    def trials(self) -> list[MeasuredTrial]:
        """All swims of the session that have tracks, measured; their tracks stand in `results/tracks`.

        Raises:
            NotEnoughData: no usable swim, or swims that are too short; all of them at once.
        """
        specs = [spec for spec in self.session.trials if _is_usable(spec)]
        if not specs:
            raise NotEnoughData(
                f'{self.session.name}: no swim with tracks. Expected at least one [[trial]] with kind = "swim" and a '
                f"tracks file; found {len(self.session.trials)} trials. {' '.join(self.notes)}"
            )
        measured, problems = [], []
        for spec in specs:
            self.options.tell(f"reading {spec.name}", None)
            tracks = self._tracks(spec)
            try:
                trial = measure_trial(spec, tracks, self.session.camera, self.robot, self.session.warmup_s)
            except NotEnoughData as problem:
                problems.append(str(problem) if spec.name in str(problem) else f"trial {spec.name}: {problem}")
                continue
            measured.append(trial)
            self._save_tracks(tracks, trial)
        if problems:
            raise NotEnoughData("\n".join(problems))
        return measured

    def tracks(self) -> tuple[Path, ...]:
        """`results/tracks/<trial>.csv` of every usable swim, up to date."""
        files = tuple(self._tracks_file(spec.name) for spec in self.session.trials if _is_usable(spec))
        if not all(is_current(file, self.fingerprint) for file in files):
            _ = self.trials
        return files

    def fit(self) -> Path:
        """`results/calibration.json` and `results/calibrated.xml`, up to date."""
        self.tracks()
        if not is_current(self.calibration_file, self.fingerprint):
            self._calibrate()
        return self.calibration_file

    def calibrated(self) -> Calibration:
        """The calibration: made when inputs, program, engine or effort changed, else read back."""
        current = is_current(self.calibration_file, self.fingerprint)
        return self.read_calibration() if current else self._calibrate()

    def read_calibration(self) -> Calibration:
        """Rebuilds the calibration from `calibration.json`: only the comparison is simulated again.

        Raises:
            ModelMismatch: it was made with another engine or model.
        """
        data = read_result_json(self.calibration_file)
        check_engine(data, self.robot, str(self.calibration_file))
        fit, phases = read_fit(data)
        twin = Twin(self.robot, self.trials[0].markers, workers=self.options.workers)
        return assemble(self.trials, twin, fit, phases)

    def evidence(self, calibration: Calibration) -> Evidence:
        """What stands beside the fit, up to date: a free yaw, profiles, and with full effort other pairs of trials."""
        if is_current(self.evidence_file, self.fingerprint):
            return read_evidence(read_result_json(self.evidence_file))
        twin = Twin(self.robot, self.trials[0].markers, workers=self.options.workers)
        evidence = gather_evidence(
            self.trials,
            twin,
            calibration.fit,
            with_pairs=self.options.effort == "full",
            seed=self.session.seed,
            tell=self.options.tell,
        )
        write_result_json(self.evidence_file, self.provenance, evidence_payload(evidence))
        mark_current(self.evidence_file, self.fingerprint)
        self.made.append(self.evidence_file)
        return evidence

    def compare_searches(self, seeds: int, budget_s: float) -> tuple[SearchRun, ...]:
        """Every search on this session's fit trials; kept in `results/search.json` for the report."""
        fitted = [trial for trial in self.trials if trial.role == "fit"]
        twin = Twin(self.robot, fitted[0].markers, workers=self.options.workers)
        runs = compare_methods(fitted, twin, seeds, budget_s, tell=self.options.tell)
        write_result_json(self.search_file, self.provenance, comparison_payload(runs))
        mark_current(self.search_file, self.data_fingerprint)
        self.made.append(self.search_file)
        return runs

    def report(self) -> Path:
        """`results/report.html`, up to date."""
        self.tracks()
        searches = self.search_file if is_current(self.search_file, self.data_fingerprint) else None
        extra = {} if searches is None else {"search": sha256_of(searches)}
        fingerprint = fingerprint_of(extra, {}, [self.fingerprint])
        if is_current(self.calibration_file, self.fingerprint) and is_current(self.report_file, fingerprint):
            return self.report_file
        calibration = self.calibrated()
        evidence = self.evidence(calibration)
        runs = () if searches is None else read_comparison(read_result_json(searches))
        self.options.tell("writing the report", None)
        write_report(
            self.report_file, self.session, calibration, self.provenance, self.notes, evidence=evidence, searches=runs
        )
        mark_current(self.report_file, fingerprint, [self.evidence_file])
        self.made.append(self.report_file)
        return self.report_file

    def _calibrate(self) -> Calibration:
        def progress(share: float, best_m: float) -> None:
            tell(f"fitting the coefficients, {1000 * best_m:.1f} mm so far", share)

        tell = self.options.tell
        self._say_why_again()
        tell("fitting the coefficients", 0.0)
        calibration = calibrate(
            self.trials,
            self.robot,
            effort=EFFORTS[self.options.effort],
            seed=self.session.seed,
            workers=self.options.workers,
            method=self.options.method,
            comparison=self.options.comparison,
            progress=progress,
        )
        mjcf_file = self.session.results / "calibrated.xml"
        write_result_json(self.calibration_file, self.provenance, calibration_payload(calibration))
        write_whole(mjcf_file, calibrated_mjcf(calibration))
        mark_current(self.calibration_file, self.fingerprint, [mjcf_file])
        self.made += [self.calibration_file, mjcf_file]
        return calibration

    def _say_why_again(self) -> None:
        """Notes what differs from the calibration that stands there and is about to be replaced."""
        try:
            before = read_result_json(self.calibration_file)
        except (OSError, SwimcalError):
            return
        now = self.provenance.to_json() | {"method": self.options.method}
        then = before | {"method": before.get("fit", {}).get("method")}
        keys = ("program", "mujoco", "model_sha256", "inputs", "seed", "effort", "method")
        differ = [f"{key} {_short(then.get(key))} -> {_short(now[key])}" for key in keys if then.get(key) != now[key]]
        if differ:
            self.said.append(f"{self.calibration_file} was made otherwise ({'; '.join(differ)}) and is made again.")

    def _tracks(self, spec: TrialSpec) -> Tracks:
        assert spec.tracks is not None
        return load_tracks(spec.tracks, self.session.markers, self.session.camera.fps)

    def _tracks_file(self, trial: str) -> Path:
        return self.session.results / "tracks" / f"{trial}.csv"

    def _save_tracks(self, tracks: Tracks, trial: MeasuredTrial) -> None:
        """The tracks as used: flagged samples keep their place, with confidence 0."""
        path = self._tracks_file(trial.name)
        if is_current(path, self.fingerprint):
            return
        confidence = np.where(trial.weight > 0, tracks.confidence, 0.0)
        save_tracks(path, Tracks(tracks.markers, tracks.time_s, tracks.position_px, confidence))
        mark_current(path, self.fingerprint)


def _short(value: object) -> str:
    """A value for a sentence: files and hashes are only named."""
    return "other files" if isinstance(value, dict) else str(value)[:12]


def _is_usable(spec: TrialSpec) -> bool:
    return spec.kind == "swim" and spec.tracks is not None


def _why_left_out(spec: TrialSpec) -> str:
    if spec.kind != "swim":
        return f"this version does not use {spec.kind} trials yet"
    return "it has no tracks, and this version does not track videos yet"


def program() -> str:
    """Name and versions, for `calib --version`."""
    return f"{program_version()}, MuJoCo {ENGINE}"
