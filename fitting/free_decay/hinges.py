"""Stiffness and damping, the same in all hinges, from free decays, and the flags that tell when not to believe them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from fitting.free_decay.decay_trial import DecayTrial
from fitting.free_decay.lasting_noise import LastingNoise
from fitting.free_decay.spectrum import DecaySpectrum
from session import Flag, NotEnoughData
from swimmer import RobotSpec

LEAST_CHANCE = 0.01  # decays disagree if those of one robot are so far apart with less probability
LEAST_EXPLAINED = 0.98  # share of the motion; a tail that decays like the twin leaves tracking errors only
LEAST_SEEN = 0.9  # share of a marker's samples; one that leaves or merges is missing where it swings widest
FARTHEST_RAD = 1.2  # largest angle of a hinge; the published model stops it at 80 degrees (1.4 rad)
MISFIT_M = 0.0015  # rms distance that tracking errors explain, however small the swing
WRONG = ("head_moves", "poor_fit", "not_converged")  # flags of a decay that must not reach the swims
WORST_SE = (0.03, 0.3)  # relative standard errors of stiffness and damping that are worth a flag


def hinges_of(robot: RobotSpec) -> np.ndarray:
    """Return stiffness (N m/rad) and damping (N m s/rad) of a robot's hinges, (2,)."""
    return np.array([robot.tail.hinge_stiffness_n_m, robot.tail.hinge_damping_n_m_s])


def with_hinges(robot: RobotSpec, stiffness_n_m: float, damping_n_m_s: float) -> RobotSpec:
    """Return the robot with these hinges, N m/rad and N m s/rad."""
    stiffness, damping = float(stiffness_n_m), float(damping_n_m_s)
    return robot.changed(tail={"hinge_stiffness_n_m": stiffness, "hinge_damping_n_m_s": damping})


@dataclass(frozen=True, eq=False)
class DecayFit:
    """Fit of the hinges to one free decay.

    Attributes:
        name: name of the trial.
        stiffness_n_m, stiffness_se_n_m: stiffness of every hinge, N m/rad, with its standard error.
        damping_n_m_s, damping_se_n_m_s: damping of every hinge, N m s/rad, with its standard error.
        matched_stiffness_n_m: first estimate, the stiffness whose twin has the same peak and decay.
        spectrum: spectrum of the measured decay.
        noise: noise of the tracks, as the fit found it.
        start_rad: (2, h) hinge angles (rad) and rates (rad/s) in the first frame.
        time_s: (n,) from the first frame after the release, s.
        markers: names of the k markers.
        measured_m, simulated_m: (n, k) lateral motion less the boxes' offsets; nan where it does not count.
        rms_m: root mean square of their difference.
        explained: share of the motion about rest that the twin explains.
        converged: whether the fit settled.
        flags: when not to believe it, those of trial and spectrum among them.
    """

    name: str
    stiffness_n_m: float
    stiffness_se_n_m: float
    damping_n_m_s: float
    damping_se_n_m_s: float
    matched_stiffness_n_m: float
    spectrum: DecaySpectrum
    noise: LastingNoise
    start_rad: np.ndarray
    time_s: np.ndarray
    markers: tuple[str, ...]
    measured_m: np.ndarray
    simulated_m: np.ndarray
    rms_m: float
    explained: float
    converged: bool
    flags: tuple[Flag, ...]


@dataclass(frozen=True)
class HingeEstimate:
    """Stiffness (N m/rad) and damping (N m s/rad) of every hinge, with their standard errors."""

    stiffness_n_m: float
    stiffness_se_n_m: float
    damping_n_m_s: float
    damping_se_n_m_s: float
    decays: int
    flags: tuple[Flag, ...] = ()


def combine_decays(fits: Sequence[DecayFit]) -> HingeEstimate:
    """Return the weighted geometric mean of several decays.

    Where they scatter by more than their standard errors say, the combined ones grow by as much (Birge 1932).

    Raises:
        NotEnoughData: no decay.
    """
    if not fits:
        raise NotEnoughData("no free decay to take the stiffness from; expected at least one")
    values = np.array([(fit.stiffness_n_m, fit.damping_n_m_s) for fit in fits])  # (f, 2)
    errors = np.array([(fit.stiffness_se_n_m, fit.damping_se_n_m_s) for fit in fits]) / values
    weight = errors**-2.0
    mean = (weight * np.log(values)).sum(axis=0) / weight.sum(axis=0)  # (2,)
    scatter = (weight * (np.log(values) - mean) ** 2).sum(axis=0)
    birge = np.sqrt(np.maximum(scatter / max(len(fits) - 1, 1), 1.0))
    (stiffness, damping), relative = np.exp(mean), birge / np.sqrt(weight.sum(axis=0))
    flags = []
    for k, (name, unit) in enumerate((("stiffness", "N m/rad"), ("damping", "N m s/rad"))):
        if len(fits) > 1 and chi2.sf(scatter[k], len(fits) - 1) < LEAST_CHANCE:
            parts = zip(fits, values[:, k], errors[:, k], strict=True)
            listed = ", ".join(f"{fit.name} {value:.3g} ± {value * error:.1g}" for fit, value, error in parts)
            message = f"the decays disagree about the {name} by more than their errors, look at each of them: {listed}"
            flags.append(Flag("decays_disagree", message=f"{message} {unit}"))
    return HingeEstimate(
        stiffness_n_m=float(stiffness),
        stiffness_se_n_m=float(stiffness * relative[0]),
        damping_n_m_s=float(damping),
        damping_se_n_m_s=float(damping * relative[1]),
        decays=len(fits),
        flags=tuple(flags),
    )


def fault_of_decay(fit: DecayFit) -> str | None:
    """Return why a free decay is not believed; None where it is."""
    if message := next((flag.message for flag in fit.flags if flag.kind in WRONG), None):
        return message
    se = fit.stiffness_se_n_m / fit.stiffness_n_m
    return None if se < WORST_SE[0] else f"it determines the stiffness to {100 * se:.0f} % only"


def decay_flags(trial: DecayTrial, fit: DecayFit, rejected: np.ndarray) -> Iterator[Flag]:
    """List the doubts about the fit of a decay.

    Args:
        trial: the decay.
        fit: its fit.
        rejected: (n, k) samples that were rejected as too far from the twin.
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
