"""Dry experiments of a robot that is not as its description says, made once at a finer step than any fit's."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from fitting.crank_fit import crank_response, fit_crank
from fitting.crank_surface import CrankGrid
from fitting.dry_run import measure_dry_run, with_arm
from fitting.free_decay import measure_decay_trial
from fitting.hinges import with_hinges
from fitting.structure import DryExperiments
from swimcal.robot import RobotSpec, load_robot
from swimcal.session import TrialSpec, load_session
from swimcal.tracks import load_tracks
from swimsynth.plan import SyntheticDecay, SyntheticPlan, SyntheticTrial
from swimsynth.session import make_session

DESCRIBED = load_robot()
FEW_POINTS = CrankGrid(arms=13, speeds=21, phases=30)
TRUE = {"hinge_stiffness": 0.75, "hinge_damping": 0.028, "crank_arm": 0.0375}


def with_few_points(patch: pytest.MonkeyPatch) -> None:
    """A coarse table and grid of the published search, from which the joint fit of the crank begins."""
    patch.setattr("fitting.structure.crank_response", partial(crank_response, grid=FEW_POINTS))
    patch.setattr("fitting.structure.fit_crank", partial(fit_crank, grid=FEW_POINTS))


def robot_with(numbers: Mapping[str, float]) -> RobotSpec:
    """The described robot with these numbers."""
    hinged = with_hinges(DESCRIBED, numbers["hinge_stiffness"], numbers["hinge_damping"])
    return with_arm(hinged, numbers["crank_arm"])


PLAN = SyntheticPlan(
    robot=robot_with(TRUE),
    trials=(
        SyntheticTrial(name="slow", frequency_hz=0.8, commanded_hz=0.82, seconds=2.8, phase_rad=1.0),
        SyntheticTrial(name="fast", frequency_hz=1.3, commanded_hz=1.35, seconds=2.5, role="holdout"),
    ),
    dry_runs=(
        SyntheticTrial(name="dry_slow", frequency_hz=0.6, commanded_hz=0.62, seconds=5.0, phase_rad=2.0),
        SyntheticTrial(name="dry_fast", frequency_hz=1.0, commanded_hz=1.03, seconds=5.0, phase_rad=0.5),
    ),
    free_decays=(SyntheticDecay(name="pull"),),
    run_in_s=3.0,
)
"""Two swims, two dry runs and a free decay."""


@lru_cache(maxsize=1)
def measured() -> DryExperiments:
    """Those of `PLAN`."""
    with TemporaryDirectory() as folder:
        session = load_session(make_session(Path(folder) / "session", PLAN))
        tracks = {spec.name: load_tracks(_file(spec), session.markers, session.camera.fps) for spec in session.trials}
    camera = session.camera
    decays = [spec.name for spec in session.trials if spec.kind == "free_decay"]
    runs = [spec for spec in session.trials if spec.kind == "dry"]
    return DryExperiments(
        [measure_decay_trial(name, tracks[name], camera, DESCRIBED) for name in decays],
        [measure_dry_run(spec, tracks[spec.name], camera, DESCRIBED) for spec in runs],
    )


def _file(spec: TrialSpec) -> Path:
    assert spec.tracks is not None
    return spec.tracks
