"""What a session shows to somebody who has its folder alone: what the refitted twin leaves, and what effects do."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from diagnosis import Discrepancy
from diagnosis.evidence import Belief
from diagnosis.explaining import explained
from diagnosis.ground import Ground
from fitting.signatures import Signature, Whitened, signature_of
from fitting.signatures.session_row import PRIOR_SD, row_covariance
from fitting.signatures.view_of import with_picture
from fitting.trial import MeasuredTrial, measure_trial
from session import Session, TrialSpec, load_session
from session.tracks import load_tracks
from swimmer import Twin, load_robot
from swimmer.effects import Effect

_JITTER = 1e-9  # of each variance: noise alone leaves some sums of a gait's numbers without any


@dataclass(frozen=True, eq=False)
class Evidence:
    """Of one session, from its fitted swims and dry runs.

    Attributes:
        left: (k,) what the refitted twin leaves of gaits, and of the commanded frequencies.
        space: in which all that disturbs it has unit size.
        noise: in which the noise of the tracks has, and how well a motor keeps a command; nothing else disturbs.
        signatures: of the catalogue.
    """

    left: np.ndarray
    space: Whitened
    noise: Whitened
    signatures: tuple[Signature, ...]


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
    ground = Ground.fitted(trials, twin, with_picture(session.camera, (*trials, *dry)), discrepancy, dry)
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
