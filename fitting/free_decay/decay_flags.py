"""When not to believe a fitted free decay."""

from typing import NamedTuple

import numpy as np

from fitting.free_decay.decay_trial import DecayTrial
from session import Flag

LEAST_EXPLAINED = 0.98  # of the motion; a tail that decays like the twin leaves tracking errors only
LEAST_SEEN = 0.9  # of a marker's samples; a marker that leaves or merges is missing where it swings widest
FARTHEST_RAD = 1.2  # of a hinge; the published model stops it at 80 degrees (1.4 rad)
MISFIT_M = 0.0015  # rms distance that tracking errors explain, however small the swing
WORST_SE = (0.03, 0.3)  # relative standard errors of stiffness and damping that are worth a flag


class Match(NamedTuple):
    """How close the twin comes: rms distance (m), share of the motion explained, whether the fit settled."""

    rms_m: float
    explained: float
    converged: bool


def decay_flags(trial: DecayTrial, angle_rad: np.ndarray, relative_se: np.ndarray, match: Match) -> tuple[Flag, ...]:
    """Doubts about a fit.

    Args:
        trial: the decay.
        angle_rad: (h,) of the hinges in the first frame.
        relative_se: (2,) of stiffness and damping.
        match: how close the twin comes.
    """
    flags = [*_clipped(trial, angle_rad)]
    if match.explained < LEAST_EXPLAINED and match.rms_m > MISFIT_M:
        message = (
            f"the twin explains only {100 * match.explained:.1f} % of the decay: its hinges, masses or clamp differ"
        )
        flags.append(Flag("poor_fit", message=message))
    if not match.converged:
        flags.append(Flag("not_converged", message="the fit of the whole decay did not settle"))
    for name, se, worst in zip(("stiffness", "damping"), relative_se, WORST_SE, strict=True):
        if not se < worst:
            flags.append(Flag("unidentifiable", message=f"the decay tells the {name} to {100 * se:.0f} % only"))
    return tuple(flags)


def _clipped(trial: DecayTrial, angle_rad: np.ndarray) -> list[Flag]:
    """Swings that are cut off: markers missing in them, markers stuck at their widest, hinges at their stops."""
    flags = []
    for name, weight in zip(trial.markers, trial.weight.T, strict=True):
        if (seen := float((weight > 0).mean())) < LEAST_SEEN:
            message = f"{name} is missing or not believed in {100 * (1 - seen):.0f} % of the decay's frames"
            flags.append(Flag("clipped", (name,), message=message))
    if (farthest := float(np.abs(angle_rad).max())) > FARTHEST_RAD:
        message = f"a hinge is bent by {np.degrees(farthest):.0f} degrees, near its stop: bend the tail less"
        flags.append(Flag("clipped", message=message))
    return flags


def rejected_flags(trial: DecayTrial, rejected: np.ndarray) -> tuple[Flag, ...]:
    """Markers of which the fit left samples (n, k) out that lie too far from the twin."""
    flags = []
    for name, out in zip(trial.markers, rejected.T, strict=True):
        if out.any():
            at = trial.first_frame + np.flatnonzero(out)
            message = f"{int(out.sum())} samples of {name} lie where no tracking error puts them; they are left out"
            flags.append(Flag("jump", (name,), (int(at[0]), int(at[-1])), message))
    return tuple(flags)
