"""What a session shows to somebody who has its folder alone: what the refitted twin leaves, and what effects do."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from fitting.posterior.box_size import BOX_SD_M, box_size
from fitting.posterior.session_model import START_PHASE_RAD, SessionModel
from fitting.posterior.trial_model import TrialModel
from fitting.signatures import Signature, Whitened, signature_of
from fitting.signatures.session_row import PRIOR_SD, left_row, nearest, row_covariance, row_slopes
from fitting.trial import MeasuredTrial, measure_trial
from session import Session, TrialSpec, load_session, load_tracks
from swimmer import Twin, load_robot
from swimmer.effects import Effect

_START = np.array([0.6, 3.0, 6.0, 4.0, 1.5])


@dataclass(frozen=True, eq=False)
class Evidence:
    """Of one session, from its fitted swims.

    Attributes:
        left: (k,) what the refitted twin leaves of gaits, and of the commanded frequencies.
        space: in which all that disturbs it has unit size.
        signatures: of the catalogue.
    """

    left: np.ndarray
    space: Whitened
    signatures: tuple[Signature, ...]


def evidence_of(folder: Path, discrepancy: np.ndarray, effects: Mapping[str, Effect]) -> Evidence:
    """Fits the plain twin and asks what every effect would do.

    Args:
        folder: of the session.
        discrepancy: (127, 127) of a gait in reality's base state.
        effects: the catalogue.

    Raises:
        InputError: the folder is no session.
        NotEnoughData: a swim cannot be measured.
    """
    session = load_session(folder)
    twin = Twin(load_robot(session.robot_file), session.markers, workers=1)
    fitted = [spec for spec in session.trials if spec.kind == "swim" and spec.role == "fit"]
    trials = [_measured(session, spec, twin) for spec in fitted]
    model = SessionModel(tuple(TrialModel(twin, trial, START_PHASE_RAD) for trial in trials))

    def covariance(at: np.ndarray) -> np.ndarray:
        disturbances = model.disturbances(at)
        left = left_row(model, at)[: -len(trials)]
        box_sd_m = box_size(left, len(trials), disturbances)
        return row_covariance(model, disturbances.of(max(box_sd_m, BOX_SD_M / 3)), discrepancy)

    at = nearest(model, _START, covariance)
    space = Whitened.of(covariance(at), row_slopes(model, at), PRIOR_SD)
    found = tuple(signature_of(effect, model, session.camera, at) for effect in effects.values())
    return Evidence(left_row(model, at), space, found)


def _measured(session: Session, spec: TrialSpec, twin: Twin) -> MeasuredTrial:
    assert spec.tracks is not None
    tracks = load_tracks(spec.tracks, session.markers, session.camera.fps)
    return measure_trial(spec, tracks, session.camera, twin.robot, session.warmup_s)
