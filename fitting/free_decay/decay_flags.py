"""When not to believe a fitted free decay."""

from collections.abc import Iterator

import numpy as np

from fitting.free_decay.decay_trial import DecayTrial
from fitting.free_decay.hinges import DecayFit
from session import Flag

LEAST_EXPLAINED = 0.98  # of the motion; a tail that decays like the twin leaves tracking errors only
LEAST_SEEN = 0.9  # of a marker's samples; a marker that leaves or merges is missing where it swings widest
FARTHEST_RAD = 1.2  # of a hinge; the published model stops it at 80 degrees (1.4 rad)
MISFIT_M = 0.0015  # rms distance that tracking errors explain, however small the swing
WRONG = ("head_moves", "poor_fit", "not_converged")  # flags of a decay that must not reach the swims
WORST_SE = (0.03, 0.3)  # relative standard errors of stiffness and damping that are worth a flag


def fault_of_decay(fit: DecayFit) -> str | None:
    """Why a free decay is not believed; None where it is."""
    if message := next((flag.message for flag in fit.flags if flag.kind in WRONG), None):
        return message
    se = fit.stiffness_se_n_m / fit.stiffness_n_m
    return None if se < WORST_SE[0] else f"it determines the stiffness to {100 * se:.0f} % only"


def decay_flags(trial: DecayTrial, fit: DecayFit, rejected: np.ndarray) -> Iterator[Flag]:
    """Doubts about a fit.

    Args:
        trial: the decay, n frames of k markers.
        fit: of it.
        rejected: (n, k) samples left out as too far from the twin.
    """
    for name, out in zip(trial.markers, rejected.T, strict=True):
        if out.any():
            at = trial.first_frame + np.flatnonzero(out)
            message = f"{int(out.sum())} samples of {name} are farther off than any tracking error; they are left out"
            yield Flag("jump", (name,), (int(at[0]), int(at[-1])), message)
    for name, weight in zip(trial.markers, trial.weight.T, strict=True):
        if (seen := float((weight > 0).mean())) < LEAST_SEEN:
            message = f"{name} is missing or not believed in {100 * (1 - seen):.0f} % of the decay's frames"
            yield Flag("clipped", (name,), message=message)
    if (farthest := float(np.abs(fit.start_rad[0]).max())) > FARTHEST_RAD:
        message = f"a hinge is bent by {np.degrees(farthest):.0f} degrees, near its stop: bend the tail less"
        yield Flag("clipped", message=message)
    if fit.explained < LEAST_EXPLAINED and fit.rms_m > MISFIT_M:
        message = f"the twin explains only {100 * fit.explained:.1f} % of the decay: its hinges, masses or clamp differ"
        yield Flag("poor_fit", message=message)
    if not fit.converged:
        yield Flag("not_converged", message="the fit of the whole decay did not settle")
    relative = (fit.stiffness_se_n_m / fit.stiffness_n_m, fit.damping_se_n_m_s / fit.damping_n_m_s)
    for name, se, worst in zip(("stiffness", "damping"), relative, WORST_SE, strict=True):
        if not se < worst:
            yield Flag("unidentifiable", message=f"the decay determines the {name} to {100 * se:.0f} % only")
