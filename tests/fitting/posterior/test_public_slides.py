"""On the public tracks markers slide along the fish, in proportion to its speed: what a near camera does."""

from __future__ import annotations

import numpy as np

from fitting import measure_trial
from fitting.posterior.gait import Gait, places_of_slides
from session import FISHSIM_MARKERS, CameraSpec, TrialSpec, load_tracks
from swimmer import load_robot
from tests.session.sample import FISHSIM, needs_fishsim

TRIALS = ("f0_75", "f1_00", "f1_25", "f1_75")  # the slowest swims at 20 mm/s, too slowly to tell
TAIL = slice(3, 8)


@needs_fishsim
def test_high_markers_run_ahead_and_the_tail_falls_behind() -> None:
    found = []  # of each trial, by which share of its speed each marker slides forward
    for name in TRIALS:
        camera = CameraSpec(fps=60.0, scale_length_m=0.142, calibration=None, file=None)
        tracks = load_tracks(FISHSIM / f"{name}.csv", FISHSIM_MARKERS, 60.0)
        spec = TrialSpec(name, "swim", commanded_hz=float(name[1:].replace("_", ".")))
        trial = measure_trial(spec, tracks, camera, load_robot(), 1.0)
        gait = Gait.of(trial, with_course=True)(trial.position_m[trial.kept])
        found.append(gait[places_of_slides(len(gait))] / gait[0])
    over_speed = np.array(found)  # (t, 9)
    dorsal, caudal = (FISHSIM_MARKERS.index(name) for name in ("dorsal_fin", "caudal_fin"))
    assert (over_speed[:, [dorsal, caudal]] > 0.012).all()
    assert (over_speed[:, TAIL].mean(axis=1) < -0.01).all()
    assert np.corrcoef(over_speed).min() > 0.85
