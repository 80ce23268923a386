"""The true free decays of a plan: the tail is held bent by a hand, then let go."""

from dataclasses import dataclass, replace

import numpy as np

from fitting.free_decay import DecayTwin
from session.errors import SimulationDiverged
from swimmer.mjcf import FREE_DECAY
from synthetic.plan import SyntheticPlan
from synthetic.trials import SyntheticDecay
from synthetic.view import check_in_image, in_image


@dataclass(frozen=True, eq=False)
class TrueDecay:
    """One free decay as planned, without any error of a tracker.

    Attributes:
        trial: the planned trial.
        time_s: (n,) times from the first frame, s.
        position_px: (n, m, 2) markers in the image, x to the right and y down.
    """

    trial: SyntheticDecay
    time_s: np.ndarray
    position_px: np.ndarray


def simulate_decays(plan: SyntheticPlan) -> tuple[TrueDecay, ...]:
    """Simulate all free decays of a plan: head clamped, in air, no tendons, hinges as the robot's file has them.

    Raises:
        session.InputError: the fish does not fit into the image.
        session.SimulationDiverged: the planned motion is unstable.
    """
    twin = DecayTwin(plan.swimmer, plan.markers, replace(FREE_DECAY, timestep_s=plan.air_timestep_s))
    true = tuple(_true_decay(plan, trial, twin) for trial in plan.free_decays)
    check_in_image([(decay.trial.name, decay.position_px) for decay in true], plan.camera)
    return true


def _true_decay(plan: SyntheticPlan, trial: SyntheticDecay, twin: DecayTwin) -> TrueDecay:
    time_s, tail = trial.time_s(plan.camera), plan.swimmer.tail
    start = np.stack([trial.bent_rad, np.zeros(twin.hinges)])[None]  # (1, 2, h)
    stiffness, damping = np.array([tail.hinge_stiffness_n_m]), np.array([tail.hinge_damping_n_m_s])
    marker_m = twin(stiffness, damping, start, np.maximum(time_s - trial.release_s, 0.0))[0]
    if not np.isfinite(marker_m).all():
        raise SimulationDiverged(
            f"trial {trial.name}: the free decay diverged; expected: a bounded swing. Try a smaller air_timestep_s or "
            "more hinge damping."
        )
    return TrueDecay(trial, time_s, in_image(marker_m, trial, plan))
