"""Diagnosis of pairs of sessions by `calib diagnose --reference`, and its scores.

Only `score_pairs` opens the answers. The detectability d of a change is its distance, given the reference, from the
nearest other effect or none, refitted: whitened by all that disturbs the difference of the two sessions.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from threadpoolctl import threadpool_limits

from benchmarks.cases import Failure, Run, run_cases
from benchmarks.effects.closest_fit import closest_fit_of
from benchmarks.effects.folder import DIAGNOSIS
from benchmarks.effects.pairs import CHANGED, REFERENCE, PairAnswer
from benchmarks.effects.scored_diagnosis import Diagnosis, read_diagnosis
from benchmarks.effects.suite import WARMUP_S
from benchmarks.scores import Measure, Scores, Share, Table
from calib.options import Options
from calib.pipeline import Pipeline, open_session
from diagnosis.discrepancy import discrepancy_for
from diagnosis.linear_model import LinearModel, SessionData
from diagnosis.reference import Comparison
from fitting.measure_trial import measure_trial
from fitting.signatures import residual_row, signature_of
from fitting.trial import MeasuredTrial
from fitting.trial_model import TrialModel
from swimcal.effects.catalogue import catalogue
from swimcal.results import from_plain, write_whole
from swimcal.session import TrialSpec
from swimcal.tracks import as_tracks
from swimcal.twin import Twin

CLEAR = 4.0
"""Detectability from which the changed effect should be named first."""
_SURE = 0.9  # A probability above this is sure.
_DETECTED = "detectability.json"  # file of the detectabilities that were computed, in the folder of the answers


@dataclass(frozen=True)
class PairCase:
    """Answer and diagnosis of one pair.

    Attributes:
        answer: what was changed.
        detectability: d of the change; 0 of a healthy pair.
        told: the diagnosis.
    """

    answer: PairAnswer
    detectability: float
    told: Diagnosis

    @property
    def alarm(self) -> bool:
        """Whether a change is told."""
        return self.told.verdict != "no_gap"

    @property
    def first(self) -> str | None:
        """The first name of the first group; None where nothing is named."""
        return self.told.groups[0][0] if self.told.groups else None

    @property
    def right(self) -> bool:
        """Whether the changed effect is named first."""
        return self.first is not None and self.first == self.answer.effect

    @property
    def sure_and_wrong(self) -> bool:
        """Whether another effect has a probability above 0.9."""
        return any(chance > _SURE and name != self.answer.effect for name, chance in self.told.probability_of.items())


def diagnose_pairs(folder: Path, run: Run) -> tuple[Failure, ...]:
    """Diagnose the pairs that have no diagnosis yet, as `calib diagnose CHANGED --reference REFERENCE` does."""
    pairs = {path.parent.name: path.parent for path in sorted(folder.glob(f"*/{CHANGED}"))}
    todo = {name: pair for name, pair in pairs.items() if not (pair / CHANGED / DIAGNOSIS).exists()}
    return run_cases(diagnose_pair, todo, run)


@threadpool_limits.wrap(limits=1, user_api="blas")  # small matrices, for which threads only wait
def diagnose_pair(pair: Path) -> None:
    """Diagnose one pair at quick effort, on one core."""
    Pipeline(open_session(pair / CHANGED), Options("quick", workers=1)).diagnosis(reference=pair / REFERENCE)


def score_pairs(folder: Path) -> tuple[PairCase, ...]:
    """Read answers and diagnoses of all pairs that are diagnosed.

    Raises:
        InputError: a diagnosis is not by the contract.
    """
    file = folder / "answers" / _DETECTED
    known: dict[str, float] = json.loads(file.read_bytes()) if file.exists() else {}
    cases = []
    for path in sorted((folder / "answers").glob("p*.json")):
        found = folder / path.stem / CHANGED / DIAGNOSIS
        if not found.exists():
            continue
        answer = from_plain(PairAnswer, json.loads(path.read_bytes()))
        simulated = path.with_suffix(".npz").exists()  # Of a real swim nobody has the one without noise.
        if answer.effect is not None and simulated and path.stem not in known:
            known[path.stem] = round(detectability(folder / path.stem, path.with_suffix(".npz"), answer.effect), 2)
            write_whole(file, json.dumps(known, indent=1) + "\n")
        cases.append(PairCase(answer, known.get(path.stem, 0.0), read_diagnosis(found)))
    return tuple(cases)


def scores_of(cases: Sequence[PairCase], command: str) -> Scores:
    """Return the table of the scores."""
    healthy = [case for case in cases if case.answer.effect is None]
    changed = [case for case in cases if case.answer.effect is not None]
    clear = [case for case in changed if case.detectability >= CLEAR]
    measures = {
        "alarms": Measure("healthy pairs: false alarms", Share.among(healthy, lambda c: c.alarm), "1 of 20"),
        "names": Measure("healthy pairs: an effect named", Share.among(healthy, lambda c: bool(c.told.groups)), "0"),
        "first": Measure(f"changed, d >= {CLEAR:g}: named first", Share.among(clear, lambda c: c.right), "80 %"),
        "any": Measure("changed, any d: named first", Share.among(changed, lambda c: c.right)),
        "wrong": Measure("wrong and sure (above 0.9)", Share.among(cases, lambda c: c.sure_and_wrong), "0"),
    }
    rows = tuple(
        (
            case.answer.pair,
            case.answer.effect or "nothing",
            f"{case.detectability:.1f}",
            case.told.verdict,
            "; ".join(" or ".join(group) for group in case.told.groups),
            f"{case.told.probabilities.get(case.answer.effect or '', 0.0):.2f}",
        )
        for case in cases
    )
    each = Table("Every pair.", ("pair", "changed", "d", "verdict", "named", "probability of the truth"), rows)
    table = Table.of("Pairs of a healthy and a second session.", {"found": measures})
    data = "pairs of real trials" if all(case.answer.generator == "real" for case in cases) else "synthetic pairs"
    return Scores("Reference sessions", data if cases else "no pairs", command, (table, each))


@threadpool_limits.wrap(limits=1, user_api="blas")
def detectability(pair: Path, truth: Path, effect: str) -> float:
    """Compute the d of a change from recordings without noise, with and without it."""
    both = _Both(pair)
    given = both.model
    films = np.load(truth)
    rows = [
        residual_row(
            replace(
                given.model,
                trials=tuple(both.seen(each, films[f"{kind}/{each.trial.name}"]) for each in given.model.trials),
            ),
            given.at,
        )
        for kind in ("true", "clean")
    ]
    change = rows[0] - rows[1]
    signatures = both.comparison.of_changed
    distances = {each.effect.name: closest_fit_of(given.space, change, [each]).distance for each in signatures}
    own = distances.pop(effect, 0.0)
    nearest = min([*distances.values(), closest_fit_of(given.space, change, []).distance])
    return float(np.sqrt(max(nearest**2 - own**2, 0.0)))


class _Both:
    """Both sessions of a pair with the model of the second, given the first."""

    def __init__(self, pair: Path) -> None:
        self._reference, self._changed = (
            Pipeline(open_session(pair / name), Options("quick", workers=1)) for name in (REFERENCE, CHANGED)
        )

    @cached_property
    def comparison(self) -> Comparison:
        """The comparison, with what each effect does."""
        reference = self._data(self._reference)
        both = Comparison.of(replace(self._data(self._changed), at=reference.at, reference=reference))
        joint = both.joint
        effects = catalogue().values()
        return both.with_signatures([signature_of(each, joint.model, joint.camera, joint.at) for each in effects])

    @property
    def model(self) -> LinearModel:
        """The model of the changed session, given the reference."""
        return self.comparison.model_of("changed", self.comparison.sizes)

    def seen(self, model: TrialModel, position_px: np.ndarray) -> TrialModel:
        """Return the model of a trial with other tracks."""
        trial = model.trial
        tracks = as_tracks(trial.markers, trial.time_s, position_px, np.ones(position_px.shape[:2]))
        job = self._changed.job
        spec = TrialSpec(name=trial.name, kind="swim", commanded_hz=trial.commanded_hz, role="fit")
        other = measure_trial(spec, tracks, job.session.camera, job.robot, WARMUP_S)
        return TrialModel.of(model.twin, other, model.doubted, with_course=True)

    def _data(self, pipeline: Pipeline) -> SessionData:
        pipeline.recordings.tracks()
        trials: Sequence[MeasuredTrial] = pipeline.recordings.swims
        job, markers = pipeline.job, trials[0].markers
        at = np.array(pipeline.the_fit().result().coefficients)
        twin = Twin(job.robot, markers, workers=1)
        return SessionData(trials, twin, job.session.camera, discrepancy_for(markers, job.robot), at)
