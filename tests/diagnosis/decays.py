"""Free decays of the robot that the swims of `linear_models` are of."""

from __future__ import annotations

from dataclasses import replace

from fitting.free_decay import DecayTrial, measure_decay_trial
from tests.diagnosis.linear_models import CAMERA
from tests.fitting.exact_swims import ROBOT
from tests.fitting.free_decay.decays import Truth, decay_tracks

TAIL = ROBOT.tail


def decay(stiffer: float = 0.0, damped: float = 0.0, slower: float = 1.0) -> DecayTrial:
    """Of a robot with other hinges, by a camera whose clock is wrong."""
    stiffness, damping = TAIL.hinge_stiffness_n_m * (1 + stiffer), TAIL.hinge_damping_n_m_s * (1 + damped)
    tracks = decay_tracks(Truth(stiffness_n_m=stiffness, damping_n_m_s=damping))
    return measure_decay_trial("decay", replace(tracks, time_s=slower * tracks.time_s), CAMERA, ROBOT)
