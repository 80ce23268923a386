"""Rules that a diagnosis has to beat.

Three are trivial: where one of them does well, the benchmark is too easy. (Two of these know when to say nothing: by
all that is known to disturb a session.) The fourth weighs effects in the diagnosis' own space, and lacks only what a
diagnosis makes of that.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from scipy.stats import chi2

from benchmarks.cases import Failure, Records, Run, run_cases
from benchmarks.effects.folder import SuiteFolder
from benchmarks.effects.told import NONE, Told
from diagnosis import Discrepancy
from diagnosis.evidence import Belief
from diagnosis.explaining import explained
from diagnosis.ground import Ground
from fitting.coefficient_fit import fit_coefficients
from fitting.model.robot_doubt import doubts_of
from fitting.signatures import Signature, Whitened, signature_of
from fitting.signatures.session_row import PRIOR_SD, row_covariance
from fitting.signatures.view_of import with_picture
from fitting.structure import assumed
from fitting.trial import MeasuredTrial, measure_trial
from session import Session, TrialSpec, load_session
from session.tracks import load_tracks
from swimmer import Twin, load_robot
from swimmer.effects import Effect, catalogue

_ALARM_P = 0.01  # of the squares that the refitted twin leaves, below which a rule names something
_TINY = 1e-12
_JITTER = 1e-9  # of each variance: noise alone leaves some sums of a gait's numbers without any


@dataclass(frozen=True, eq=False)
class Evidence:
    """Of one session, from its fitted swims and dry runs."""

    left: np.ndarray  # (k,) what the refitted twin leaves of gaits, and of the commanded frequencies
    space: Whitened  # in which all that disturbs it has unit size
    noise: Whitened  # in which the noise of the tracks has, and how well a motor keeps a command; nothing else disturbs
    signatures: tuple[Signature, ...]  # of the catalogue


def evidence_of(folder: Path, discrepancy: Discrepancy, effects: Mapping[str, Effect]) -> Evidence:
    """Fits the plain twin and asks what every effect would do.

    Args:
        folder: of the session.
        discrepancy: what the refitted twin leaves in reality's base state.
        effects: the catalogue.

    Raises:
        InputError: the folder is no session.
        NotEnoughData: a swim cannot be measured.
    """
    session = load_session(folder)
    twin = Twin(load_robot(session.robot_file), session.markers, workers=1)
    fitted = [spec for spec in session.trials if spec.role == "fit"]
    trials, dry = ([_measured(session, spec, twin) for spec in fitted if spec.kind == kind] for kind in ("swim", "dry"))
    doubts = doubts_of(assumed(twin.robot).sources)
    at = np.array(fit_coefficients(trials, twin, doubts, seed=session.seed)[0].coefficients)
    ground = Ground.of(trials, twin, with_picture(session.camera, (*trials, *dry)), discrepancy, at, dry)
    found = tuple(signature_of(effect, ground.model, ground.camera, ground.at) for effect in effects.values())
    ground = explained(ground, found, Belief()).ground
    return Evidence(ground.left, ground.space, _noise_of(ground), found)


def _noise_of(ground: Ground) -> Whitened:
    covariance = row_covariance(ground.model, ground.model.noise)
    unseen = np.flatnonzero(np.diag(covariance) == 0.0)  # numbers of a marker that counts in no frame: all of them 0
    covariance[unseen, unseen] = 1.0
    diagonal = np.diag_indices_from(covariance)
    covariance[diagonal] *= 1 + _JITTER
    return Whitened.of(covariance, ground.slopes, PRIOR_SD)


def _measured(session: Session, spec: TrialSpec, twin: Twin) -> MeasuredTrial:
    assert spec.tracks is not None
    tracks = load_tracks(spec.tracks, session.markers, session.camera.fps)
    return measure_trial(spec, tracks, session.camera, twin.robot, session.warmup_s)


Rule = Callable[[Evidence], Told]


def largest_residual(evidence: Evidence) -> Told:
    """Names the effect that has the largest part of its own change where the largest part of the residual is."""
    left = evidence.space.freed(evidence.left) ** 2
    part = int(np.argmax(left))
    shares = {
        signature.effect.name: float(max(_share(row**2, part) for row in evidence.space.freed(signature.rows)))
        for signature in evidence.signatures
    }
    return _named(evidence, shares)


def raw_correlation(evidence: Evidence) -> Told:
    """Names the effect whose change, coefficients not refitted, goes best with the residual."""
    found = {}
    for signature in evidence.signatures:
        rows = signature.rows[np.isfinite(signature.rows).all(axis=1)]
        cosines = np.abs(rows @ evidence.left) / (np.linalg.norm(rows, axis=1) * np.linalg.norm(evidence.left) + 1e-300)
        found[signature.effect.name] = float(cosines.max(initial=0.0))
    return _named(evidence, found)


def lowest_bic(evidence: Evidence) -> Told:
    """The Bayesian information criterion (Schwarz 1978) over null and single effects.

    As whoever fits models to data has it at once: numbers are weighted by the noise of the tracks, and of what size
    the errors are the residual tells.
    """
    count = len(evidence.left)
    return _lowest_bic(evidence, evidence.noise, lambda squares: count * float(np.log(max(squares, _TINY) / count)))


def informed_bic(evidence: Evidence) -> Told:
    """The same in the diagnosis' own space: boxes, robot, starts and the twin's own error are known to disturb."""
    return _lowest_bic(evidence, evidence.space, lambda squares: squares)


def _lowest_bic(evidence: Evidence, space: Whitened, deviance: Callable[[float], float]) -> Told:
    count = len(evidence.left)
    bic = {NONE: deviance(space.length(evidence.left) ** 2)}
    for signature in evidence.signatures:
        (values,), distance, _ = space.together(evidence.left, [signature])
        bic[signature.effect.name] = deviance(distance**2) + len(values) * np.log(count)
    least = min(bic.values())
    weight = {name: float(np.exp(-(value - least) / 2)) for name, value in bic.items()}
    total = sum(weight.values())
    chances = {name: value / total for name, value in weight.items()}
    best = max(chances, key=lambda name: chances[name])
    return _told(best, chances)


RULES: Mapping[str, Rule] = {
    "largest residual": largest_residual,
    "BIC alone": lowest_bic,
    "raw correlation": raw_correlation,
    "informed BIC": informed_bic,
}


def judgements(suite: SuiteFolder) -> Records[dict[str, Told]]:
    """What the rules said of each session, by rule."""
    return Records(suite.rules, dict[str, Told])


def judge_suite(suite: SuiteFolder, run: Run) -> tuple[Failure, ...]:
    """Judges the sessions that the rules have not judged yet.

    Returns:
        Sessions that cannot be fitted; the next run tries them again.

    Raises:
        InputError: there is no whole suite, or no scheduler answers.
    """
    records = judgements(suite)
    todo = {name: name for name in records.missing(suite.names)}
    return run_cases(partial(_judged, suite), todo, run, records.keep)


def _judged(suite: SuiteFolder, name: str) -> dict[str, Told]:
    evidence = evidence_of(suite.sessions / name, Discrepancy.load(suite.discrepancy), catalogue())
    return {rule: judge(evidence) for rule, judge in RULES.items()}


def _named(evidence: Evidence, marks: Mapping[str, float]) -> Told:
    """The highest mark, where the residual is more than noise."""
    freedom = len(evidence.left) - len(evidence.space.precision)
    if chi2.sf(evidence.space.length(evidence.left) ** 2, freedom) > _ALARM_P:
        return _told(NONE, {NONE: 1.0})
    best = max(marks, key=lambda name: marks[name])
    total = sum(marks.values()) or 1.0
    return _told(best, {name: mark / total for name, mark in marks.items()})


def _told(best: str, chances: Mapping[str, float]) -> Told:
    return Told("no_gap" if best == NONE else "named", () if best == NONE else ((best,),), {NONE: 0.0, **chances})


def _share(squares: np.ndarray, part: int) -> float:
    return float(squares[part] / squares.sum()) if np.isfinite(squares).all() and squares.sum() > 0 else 0.0
