"""The pipeline from a session folder to its results, stage by stage; what has not changed is not made again.

Its last stage, `ReportStage`, makes ``results/report.html`` from the results of all others.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TypeVar, get_args

from calib.options import EffortName, Job, Options
from calib.progress_bar import progress_bar
from calib.stages.diagnosis import DiagnosisStage, ReferenceSession, check_names
from calib.stages.fit import FitStage, PosteriorStage, PublishedStage, StructureStage
from calib.stages.recordings import Recordings
from diagnosis.discrepancy import Discrepancy
from diagnosis.result import EffectTestResult
from fitting.calibration import Calibration
from fitting.structure import Structure
from reports.context import ReportContext, read_swims, swims_files
from reports.report import write_report
from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect
from swimcal.errors import Fault, InputError, SwimcalError
from swimcal.results import read_provenance, sha256_of
from swimcal.robot import load_robot
from swimcal.session import Session, load_session
from swimcal.stage import Stage, session_lock

AnyStage = TypeVar("AnyStage", bound=Stage)


def open_session(folder: Path, needs_commands: bool = True) -> Session:
    """Read and check a session, its tracks, its robot and its markers included; all faults at once.

    Tracks and motor logs whose hashes are those of earlier results were checked for these, and are not read again.

    Args:
        folder: the session folder.
        needs_commands: whether driven trials need their commands, which everything but tracking does.
    """
    with suppress(InputError):  # it is raised below with all other faults
        session = load_session(folder, load_robot, check_tracks=False, needs_commands=needs_commands)
        if Recordings(Job(session, Options())).are_current:
            return session
    return load_session(folder, load_robot, needs_commands=needs_commands)


def _current(stage_of: Callable[[EffortName], AnyStage]) -> AnyStage | None:
    """Find the stage whose results are current, whatever its effort; None where there is none."""
    return next((stage for stage in map(stage_of, get_args(EffortName)) if stage.is_current), None)


class ReportStage(Stage):
    """The report of a fit, with its posterior and the diagnosis where they are current, and policies where trained."""

    def __init__(
        self,
        job: Job,
        fit: FitStage,
        published: PublishedStage | None,
        posterior: PosteriorStage | None,
        diagnosis: DiagnosisStage | None,
    ) -> None:
        inputs = {}
        if published is not None:
            inputs["published"] = sha256_of(published.file)
        if posterior is not None:
            inputs["posterior"] = sha256_of(posterior.file.with_suffix(".json"))
        if diagnosis is not None:
            inputs["diagnosis"] = sha256_of(diagnosis.file)
        inputs |= {file.name: sha256_of(file) for file in swims_files(job.results)}
        super().__init__(job.results / "report.html", inputs, {}, [fit])
        self._fit = fit
        self._job, self._published, self._posterior, self._diagnosis = job, published, posterior, diagnosis

    def make(self, calibration: Calibration, notes: tuple[str, ...], damaged: Mapping[str, str]) -> None:
        """Write the report, with notes for the reader and the file of each result that cannot be read.

        Args:
            calibration: the calibration to report on.
            notes: sentences for the reader, such as what was left out.
            damaged: the file of "posterior" or "diagnosis" that cannot be read, where there is one.
        """
        job = self._job
        job.progress("writing the report")
        context = ReportContext(
            job.session,
            calibration,
            replace(job.provenance, effort=self._fit.effort),
            notes,
            published=None if self._published is None else self._published.read(),
            posterior=None if self._posterior is None else self._posterior.read(),
            diagnosed=None if self._diagnosis is None else self._diagnosis.read(),
            diagnosis_effort="" if self._diagnosis is None else self._diagnosis.effort,
            policies=read_swims(job.results),
            damaged=damaged,
        )
        write_report(self.file, context)
        self.mark()
        job.made.append(self.file)


class Pipeline:
    """The stages of one session. Each first brings up to date what it depends on."""

    def __init__(self, session: Session, options: Options | None = None) -> None:
        self.job = Job(session, options or Options())
        self.session, self.options, self.made, self.notes = session, self.job.options, self.job.made, self.job.notes

    @cached_property
    def recordings(self) -> Recordings:
        """The session's tracks and videos."""
        return Recordings(self.job)

    @property
    def only_dry(self) -> bool:
        """Return whether the session has dry experiments and no swims."""
        return self.recordings.has_experiments and not self.recordings.has_swims

    @property
    def dry_note(self) -> str:
        """The note for the user where `only_dry`."""
        return f"{self.session.name}: no swim trial to fit; what follows is from the dry experiments alone"

    @cached_property
    def structures(self) -> StructureStage:
        """The stage of the structure: what is known of the robot before it swims, and where from."""
        return StructureStage(self.job, self.recordings)

    @cached_property
    def structure(self) -> Structure:
        """The structure that the swims are fitted with, up to date."""
        return self.structures.current()

    @cached_property
    def fits(self) -> FitStage:
        """The stage of the fit of the requested effort.

        Without an effort it is that of the existing fit, and full effort where there is none.
        """
        if self.options.effort is None and (stage := self.current_fit) is not None:
            return stage
        return self._fit_of(self.options.effort or self._effort_of_file or "full")

    @property
    def _effort_of_file(self) -> EffortName | None:
        """The effort of the existing fit, even if it is out of date; None where it cannot be read."""
        try:
            made_with = read_provenance(self._fit_of("full").file)
        except SwimcalError:
            return None
        return next((effort for effort in get_args(EffortName) if effort == made_with.effort), None)

    @property
    def current_fit(self) -> FitStage | None:
        """The current fit, whatever its effort; None where there is none of these recordings."""
        return _current(self._fit_of)

    def current_published(self) -> PublishedStage | None:
        """Find the current published search, whatever its effort; None where there is none of these recordings."""
        return _current(self._published_of)

    def the_fit(self) -> FitStage:
        """Return the current fit.

        Raises:
            InputError: there is none, or it was made from other recordings.
        """
        if (stage := self.current_fit) is not None:
            return stage
        what, found, expected, aside = "there is no fit", "", "", ""
        if self.fits.file.is_file():
            what, expected, aside = "the fit is out of date", "the fit of these recordings", "; it is kept aside"
            found = self.outdated_fit
        if (cut := self.fits.incomplete) is not None:
            what, found = "the fit is incomplete", f"{cut.name}, whose end is missing or damaged"
        step = f"Run `calib fit {self.session.in_shell}`{aside}."
        raise InputError([Fault(str(self.fits.file), "", what, found, expected, next_step=step)])

    @property
    def outdated_fit(self) -> str:
        """Describe a fit that is not current: from before some files changed, of another program, or damaged."""
        before: Mapping[str, str] = {}
        with suppress(SwimcalError):
            before = read_provenance(self.fits.file).inputs
        now = self.job.provenance.inputs
        changed = [name for name in {**before, **now} if before.get(name) != now.get(name)] if before else []
        if not changed:
            return "one of another program, edited by hand, or not whole"
        edits = {spec.edits.resolve(): spec.name for spec in self.session.trials if spec.edits is not None}
        edited = {name: edits.get((self.session.folder / name).resolve()) for name in changed}
        told = [f"{name} (tracks of {trial}, edited by hand)" if trial else name for name, trial in edited.items()]
        return f"one from before a change of {', '.join(told)}"

    def current_posterior(self, fit: FitStage) -> PosteriorStage | None:
        """Find the posterior of the current fit, whatever its effort; None where there is none."""
        return _current(lambda effort: PosteriorStage(self.job, fit, effort))

    def fit(self) -> Path:
        """Bring `results/calibration.json` and `results/calibrated.xml` up to date, and the structure they build on."""
        self.recordings.tracks()
        if not self.fits.is_current:
            self.fits.current()
        elif not self.structures.is_up_to_date:
            _ = self.structure
        return self.fits.file

    def published(self) -> Path:
        """Bring `results/published.json` up to date: what the published search leads to, for comparison."""
        stage = self._published_of(self.fits.effort)
        if not stage.is_current:
            stage.make()
        return stage.file

    def structured(self) -> Path:
        """Bring `results/structure.json` up to date: all that dry experiments alone determine."""
        self.recordings.tracks()
        _ = self.structure
        self.notes.append(self.dry_note)
        return self.structures.file

    def posterior(self) -> PosteriorStage:
        """Bring `results/posterior.nc` of the current fit up to date, and its summary in `calibration.json`.

        Where there is no fit, one of this effort is made first.

        Raises:
            NotConverged: draws that must not be relied on; nothing is written.
        """
        if self.only_dry:
            _ = self.recordings.swims  # raises what is missing
        fit = self._fit_to_build_on()
        standing = None if self.options.effort else self.current_posterior(fit)
        stage = standing or PosteriorStage(self.job, fit, self.options.effort or fit.effort)
        if not stage.is_current:
            stage.make()
        return stage

    def _fit_to_build_on(self) -> FitStage:
        """Return the current fit; where there is none, one of this effort is made first."""
        if (fit := self.current_fit) is None:
            lacking = "no" if self.fits.incomplete is None else "only an incomplete"
            self.notes.append(f"There was {lacking} fit of these recordings; a {self.fits.name} was made first.")
            self.job.progress(f"{lacking} fit of these recordings yet: a {self.fits.name} comes first", 0.0)
            self.fit()
            fit = self.fits
        return fit

    def diagnosis(
        self,
        without: frozenset[str] = frozenset(),
        discrepancy: Discrepancy | None = None,
        own: tuple[Effect, ...] = (),
        reference: Path | None = None,
    ) -> DiagnosisStage:
        """Bring `results/diagnosis.json` up to date.

        The plain twin is the robot as described, with the fit's coefficients. Where there is no fit, one of this effort
        is made first.

        Args:
            without: names of effects that the catalogue is to lack.
            discrepancy: as for `DiagnosisStage.make`.
            own: further effects that the catalogue is to have.
            reference: folder of a session of the same robot, camera and water before something changed; where it has
                no fit, one of this effort is made first.
        """
        check_names("--exclude", sorted(without), catalogue())
        self.recordings.tracks()
        healthy = None if reference is None else self._compare_with(reference)
        fit = self._fit_to_build_on()
        standing = None
        if self.options.effort is None:
            standing = _current(lambda effort: self._diagnosis_of(fit, effort, without, own, healthy))
        stage = standing or self._diagnosis_of(fit, self._effort_of_diagnosis(fit), without, own, healthy)
        if not stage.is_current:
            stage.make(discrepancy)
        return stage

    def effect_test(self, names: Sequence[str]) -> EffectTestResult:
        """Test effects that a user names; the outcome is also in `results/supposed.json`."""
        check_names("--test", names, catalogue())
        if not names:
            expected, choices = "at least one effect of the catalogue", tuple(catalogue())
            raise InputError([Fault("effects", "", "no effect is named", expected=expected, choices=choices)])
        self.recordings.tracks()
        fit = self._fit_to_build_on()
        return self._diagnosis_of(fit, self._effort_of_diagnosis(fit)).test(names)

    def current_diagnosis(self) -> DiagnosisStage | None:
        """Find the diagnosis of the current fit, whatever its effort and what its catalogue lacked.

        None without one.
        """
        if (fit := self.current_fit) is None:
            return None
        standing, healthy = self._diagnosis_of(fit, fit.effort), None
        if (compared_with := standing.compared_with) is not None:
            with suppress(SwimcalError):  # a reference that is gone leaves nothing current
                other = Pipeline(open_session(self.session.folder / compared_with), self.options)
                healthy = ReferenceSession(other.job, other.recordings, other.the_fit())
            if healthy is None:
                return None
        withheld = standing.withheld
        return _current(lambda effort: self._diagnosis_of(fit, effort, withheld, reference=healthy))

    def _compare_with(self, folder: Path) -> ReferenceSession:
        """Return a reference session with a current fit, and refuse one of another robot or camera."""
        other = Pipeline(open_session(folder), self.options)
        unfitted = ReferenceSession(other.job, other.recordings, other.fits)
        unfitted.check(self.job)
        with session_lock(other.session.folder):
            other.recordings.tracks()
            return replace(unfitted, fit=other._fit_to_build_on())

    @property
    def standing(self) -> str:
        """The current results and their efforts, in words; for the others the command that makes them.

        Raises:
            InputError: there is no fit of these recordings.
        """
        fit, damaged = self.the_fit(), self.damaged
        stages = (
            ("posterior", self.current_posterior(fit), "posterior.nc", "posterior"),
            ("diagnosis", self.current_diagnosis(), "diagnosis.json", "diagnose"),
        )
        parts = [fit.name]
        for name, stage, file, command in stages:
            lacking = f"{name} is out of date" if (self.job.results / file).exists() else f"no {name}"
            lacking = f"{name} is incomplete" if name in damaged else lacking
            step = f"{lacking} (`calib {command} {self.session.in_shell}`)"
            parts.append(step if stage is None else f"{name} of {stage.effort} effort")
        return ", ".join(parts)

    @property
    def damaged(self) -> Mapping[str, str]:
        """The file of "posterior" or "diagnosis" whose end is missing, by the result that it keeps from being read.

        Raises:
            InputError: there is no fit of these recordings.
        """
        fit = self.the_fit()
        stages = {
            "posterior": PosteriorStage(self.job, fit, fit.effort),
            "diagnosis": self._diagnosis_of(fit, fit.effort),
        }
        cut = {name: stage.incomplete for name, stage in stages.items()}
        return {name: file.name for name, file in cut.items() if file is not None}

    def report(self) -> Path:
        """Bring `results/report.html` up to date with the current results; nothing else is computed.

        Raises:
            InputError: there is no fit of these recordings.
        """
        fit = self.the_fit()
        stage = self._report_of(fit)
        if not stage.is_current:
            stage.make(fit.read(), self.recordings.notes, self.damaged)
        return stage.file

    def current_report(self) -> Path | None:
        """Return `results/report.html`; None where it does not show the current results, or there is no fit."""
        fit = self.current_fit
        return None if fit is None or not (stage := self._report_of(fit)).is_current else stage.file

    def _report_of(self, fit: FitStage) -> ReportStage:
        others = self.current_published(), self.current_posterior(fit), self.current_diagnosis()
        return ReportStage(self.job, fit, *others)

    def _fit_of(self, effort: EffortName) -> FitStage:
        return FitStage(self.job, self.recordings, self.structures, effort)

    def _diagnosis_of(
        self,
        fit: FitStage,
        effort: EffortName,
        without: frozenset[str] = frozenset(),
        own: tuple[Effect, ...] = (),
        reference: ReferenceSession | None = None,
    ) -> DiagnosisStage:
        return DiagnosisStage(self.job, self.recordings, fit, effort, without, own, reference)

    def _effort_of_diagnosis(self, fit: FitStage) -> EffortName:
        """Choose the effort of a diagnosis: as requested, else of the existing diagnosis, else of the fit."""
        if self.options.effort is not None:
            return self.options.effort
        standing = self.current_diagnosis()
        return fit.effort if standing is None else standing.effort

    def _published_of(self, effort: EffortName) -> PublishedStage:
        return PublishedStage(self.job, self.recordings, self.structures, effort)


@contextmanager
def working(
    folder: Path, quiet: bool, options: Options | None = None, needs_commands: bool = True
) -> Iterator[Pipeline]:
    """Lock a session for the block and give it its pipeline, with progress unless quiet.

    Args:
        folder: the session folder.
        quiet: show no progress.
        options: options of the work.
        needs_commands: whether driven trials need their commands, which everything but tracking does.
    """
    session = open_session(folder, needs_commands)
    with session_lock(session.folder), progress_bar(quiet) as progress:
        yield Pipeline(session, replace(options or Options(), progress=progress))
