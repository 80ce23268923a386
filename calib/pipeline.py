"""From a session folder to its results, stage by stage; what has not changed is not made again."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from calib.calibrated_mjcf import calibrated_mjcf
from calib.diagnosis_stage import DiagnosisStage
from calib.options import EFFORTS, EffortName, Options
from calib.posterior_stage import PosteriorStage
from calib.recordings import Recordings
from calib.structure_stage import StructureStage
from fitting import (
    Calibration,
    Comparison,
    Evidence,
    MeasuredTrial,
    MethodName,
    SearchRun,
    Structure,
    assemble,
    calibrate,
    calibration_payload,
    compare_methods,
    comparison_payload,
    evidence_payload,
    gather_evidence,
    read_comparison,
    read_evidence,
    read_fit,
    read_objective,
)
from reports import ReportContext, read_diagnosed, write_report
from session import (
    Provenance,
    Session,
    SwimcalError,
    file_hashes,
    fingerprint_of,
    is_current,
    load_session,
    mark_current,
    program_version,
    read_result_json,
    sha256_of,
    write_result_json,
    write_whole,
)
from swimmer import ENGINE, RobotSpec, Twin, check_engine, load_robot, model_sha256

if TYPE_CHECKING:
    from diagnosis import Discrepancy


def open_session(folder: Path) -> Session:
    """Reads and checks a session, its tracks, its robot and its markers included.

    Raises:
        InputError: all faults at once.
    """
    return load_session(folder, load_robot)


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
    def chosen(self) -> tuple[MethodName, Comparison]:
        """The search and what it minimises: as asked for, else those of the calibration that stands, else the usual.

        So that a fit by another search is reported, and not replaced by the usual one.
        """
        options = self.options
        methods = get_args(MethodName) if options.method is None else (options.method,)
        comparisons = get_args(Comparison) if options.comparison is None else (options.comparison,)
        possible = list(itertools.product(methods, comparisons))  # the usual ones come first
        return next((pair for pair in possible if self._stands(options.effort, *pair)), possible[0])

    @cached_property
    def fingerprint(self) -> str:
        """Of all that the calibration depends on."""
        return self._fingerprint(self.options.effort, *self.chosen)

    def _stands(self, effort: str, method: str, comparison: str) -> bool:
        return is_current(self.calibration_file, self._fingerprint(effort, method, comparison))

    def _fingerprint(self, effort: str, method: str, comparison: str) -> str:
        parameters = {"seed": self.session.seed, "effort": effort, "method": method, "comparison": comparison}
        parameters["form"] = 6  # of calibration.json and evidence.json
        return fingerprint_of({}, parameters, [self.recordings.fingerprint])

    @property
    def calibration_file(self) -> Path:
        """`results/calibration.json`."""
        return self.session.results / "calibration.json"

    @property
    def _mjcf_file(self) -> Path:
        return self.session.results / "calibrated.xml"

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
    def recordings(self) -> Recordings:
        """The session's tracks and videos."""
        return Recordings(self.session, self.robot, self.options, self.provenance)

    @property
    def notes(self) -> tuple[str, ...]:
        """What the reader should know about the trials that were left out."""
        return self.recordings.notes

    @cached_property
    def structures(self) -> StructureStage:
        """What is known of the robot before it swims, and where from."""
        return StructureStage(self.session, self.robot, self.recordings, self.options, self.provenance)

    @cached_property
    def structure(self) -> Structure:
        """The structure that the swims are fitted with, up to date."""
        structure = self.structures.structure
        self.made += self.structures.made
        return structure

    @property
    def trials(self) -> list[MeasuredTrial]:
        """All usable swims, measured."""
        return self.recordings.swims

    def fit(self) -> Path:
        """`results/calibration.json` and `results/calibrated.xml`, up to date, and the structure they build on."""
        self.recordings.tracks()
        if not is_current(self.calibration_file, self.fingerprint):
            self._calibrate()
        elif not self.structures.is_current:
            _ = self.structure
        return self.calibration_file

    @property
    def only_dry(self) -> bool:
        """Whether experiments out of the water are all there is."""
        return self.recordings.has_experiments and not self.recordings.has_swims

    def structured(self) -> Path:
        """`results/structure.json`, up to date: all that dry experiments alone can tell."""
        self.recordings.tracks()
        if not self.structures.is_current:
            _ = self.structure
        self.said.append(f"{self.session.name}: no swim to fit; what follows is from the dry experiments alone")
        return self.structures.file

    def calibrated(self) -> Calibration:
        """The calibration: made when inputs, program, engine or effort changed, else read back."""
        current = is_current(self.calibration_file, self.fingerprint)
        return self.read_calibration() if current else self._calibrate()

    def standing_calibration(self) -> Calibration | None:
        """The calibration that stands, whatever its effort and search; None where there is none of these inputs."""
        settings = itertools.product(EFFORTS, get_args(MethodName), get_args(Comparison))
        return self.read_calibration() if any(self._stands(*setting) for setting in settings) else None

    def read_calibration(self) -> Calibration:
        """Rebuilds the calibration from `calibration.json`: only the comparison is simulated again.

        Raises:
            ModelMismatch: it was made with another engine, or another robot than the session describes; what the
                session's dry experiments say of the robot stands in its structure.
        """
        data = read_result_json(self.calibration_file)
        check_engine(data, self.robot, str(self.calibration_file))
        fit, phases = read_fit(data)
        twin = self._twin()
        return assemble(self.trials, twin, fit, phases, self.structure, read_objective(data))

    @cached_property
    def posteriors(self) -> PosteriorStage:
        """How sure the calibration is."""
        return PosteriorStage(self.session, self.options, self.provenance, self.fingerprint)

    def posterior(self) -> Path:
        """`results/posterior.nc`, up to date, and its summary in `calibration.json`.

        Raises:
            NotConverged: draws that must not be relied on; nothing is written but the chain so far.
        """
        self.fit()
        if not self.posteriors.is_current:
            self.made += self.posteriors.make(self.calibrated(), self.trials, self._twin())
            mark_current(self.calibration_file, self.fingerprint, [self._mjcf_file])
        self.said += [f"! posterior: {doubt}" for doubt in self.posteriors.doubts]
        return self.posteriors.file

    def diagnoses(self, without: frozenset[str] = frozenset()) -> DiagnosisStage:
        """The gap, with a catalogue that lacks some effects."""
        options, stamp, recordings = self.options, self.provenance, self.recordings.fingerprint
        return DiagnosisStage(self.session, self.robot, options, stamp, recordings, without)

    def diagnosis(self, without: frozenset[str] = frozenset(), discrepancy: "Discrepancy | None" = None) -> Path:
        """`results/diagnosis.json`, up to date; the plain twin is that of the robot as described.

        Args:
            without: names that the catalogue is to lack.
            discrepancy: see `DiagnosisStage.make`.
        """
        stage = self.diagnoses(without)
        self.recordings.tracks()
        if not stage.is_current:
            stage.make(self.trials, discrepancy, self.recordings.out_of_water)
            self.made += stage.made
        return stage.file

    def supposition(self, names: Sequence[str]) -> Path:
        """`results/supposed.json`: what the swims say of effects that a user names."""
        stage = self.diagnoses()
        stage.check_supposed(names)
        self.recordings.tracks()
        return stage.suppose(names, self.trials, self.recordings.out_of_water)

    def standing_diagnosis(self) -> DiagnosisStage | None:
        """The diagnosis that stands, whatever its effort and what its catalogue lacked; None of these recordings."""
        options = [replace(self.options, effort=effort) for effort in get_args(EffortName)]
        told = self.provenance, self.recordings.fingerprint
        lacking = self.diagnoses().withheld
        stages = (DiagnosisStage(self.session, self.robot, each, *told, lacking) for each in options)
        return next((stage for stage in stages if stage.is_current), None)

    def evidence(self, calibration: Calibration) -> Evidence:
        """What stands beside the fit, up to date (see `Evidence`); other pairs of trials with full effort only."""
        if is_current(self.evidence_file, self.fingerprint):
            return read_evidence(read_result_json(self.evidence_file))
        twin = self._twin()
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
        twin = self._twin()
        runs = compare_methods(fitted, twin, seeds, budget_s, tell=self.options.tell)
        write_result_json(self.search_file, self.provenance, comparison_payload(runs))
        mark_current(self.search_file, self.recordings.fingerprint)
        self.made.append(self.search_file)
        return runs

    def report(self) -> Path:
        """`results/report.html`, up to date."""
        self.recordings.tracks()
        searches = self.search_file if is_current(self.search_file, self.recordings.fingerprint) else None
        extra = {} if searches is None else {"search": sha256_of(searches)}
        if self.posteriors.is_current:
            extra["posterior"] = sha256_of(self.posteriors.findings_file)
        if (diagnosis := self.standing_diagnosis()) is not None:
            extra["diagnosis"] = sha256_of(diagnosis.file)
        fingerprint = fingerprint_of(extra, {}, [self.fingerprint])
        if is_current(self.calibration_file, self.fingerprint) and is_current(self.report_file, fingerprint):
            return self.report_file
        calibration = self.calibrated()
        evidence = self.evidence(calibration)
        runs = () if searches is None else read_comparison(read_result_json(searches))
        self.options.tell("writing the report", None)
        context = ReportContext(
            self.session,
            calibration,
            self.provenance,
            self.notes,
            evidence=evidence,
            searches=runs,
            posterior=self.posteriors.read(),
            diagnosed=None if diagnosis is None else read_diagnosed(diagnosis.file, diagnosis.arrays_file),
        )
        write_report(self.report_file, context)
        mark_current(self.report_file, fingerprint, [self.evidence_file])
        self.made.append(self.report_file)
        return self.report_file

    def _twin(self) -> Twin:
        """Of the robot with its structure."""
        return Twin(self.structure.robot, self.trials[0].markers, workers=self.options.workers)

    def _calibrate(self) -> Calibration:
        def progress(share: float, best_m: float) -> None:
            tell(f"fitting the coefficients, {1000 * best_m:.1f} mm so far", share)

        tell = self.options.tell
        self._say_why_again()
        structure, trials = self.structure, self.trials  # in this order: it stands even where there is no swim
        tell("fitting the coefficients", 0.0)
        method, comparison = self.chosen
        calibration = calibrate(
            trials,
            structure,
            effort=EFFORTS[self.options.effort],
            seed=self.session.seed,
            workers=self.options.workers,
            method=method,
            comparison=comparison,
            progress=progress,
        )
        self.posteriors.remove()
        write_result_json(self.calibration_file, self.provenance, calibration_payload(calibration))
        write_whole(self._mjcf_file, calibrated_mjcf(calibration))
        mark_current(self.calibration_file, self.fingerprint, [self._mjcf_file])
        self.made += [self.calibration_file, self._mjcf_file]
        return calibration

    def _say_why_again(self) -> None:
        """Notes what differs from the calibration that stands there and is about to be replaced."""
        try:
            before = read_result_json(self.calibration_file)
        except (OSError, SwimcalError):
            return
        now = self.provenance.to_json() | dict(zip(("method", "objective"), self.chosen, strict=True))
        fit = before.get("fit", {})
        then = before | {"method": fit.get("method"), "objective": fit.get("objective", "published")}
        keys = ("program", "mujoco", "model_sha256", "inputs", "seed", "effort", "method", "objective")
        differ = [f"{key} {_short(then.get(key))} -> {_short(now[key])}" for key in keys if then.get(key) != now[key]]
        if differ:
            self.said.append(f"{self.calibration_file} was made otherwise ({'; '.join(differ)}) and is made again.")


def _short(value: object) -> str:
    """A value for a sentence: files and hashes are only named."""
    return "other files" if isinstance(value, dict) else str(value)[:12]


def program() -> str:
    """Name and versions, for `calib --version`."""
    return f"{program_version()}, MuJoCo {ENGINE}"
