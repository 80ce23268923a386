"""Stiffness and damping, the same in all hinges, from free decays."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from fitting.free_decay.lasting_noise import LastingNoise
from fitting.free_decay.spectrum import DecaySpectrum
from session import Flag, NotEnoughData
from swimmer import RobotSpec

LEAST_CHANCE = 0.01  # of decays of one robot being as far apart, below which they disagree


def hinges_of(robot: RobotSpec) -> np.ndarray:
    """(2,) stiffness (N m/rad) and damping (N m s/rad)."""
    return np.array([robot.tail.hinge_stiffness_n_m, robot.tail.hinge_damping_n_m_s])


def with_hinges(robot: RobotSpec, stiffness_n_m: float, damping_n_m_s: float) -> RobotSpec:
    """The robot with these, N m/rad and N m s/rad."""
    hinges = {"hinge_stiffness_n_m": float(stiffness_n_m), "hinge_damping_n_m_s": float(damping_n_m_s)}
    return robot.model_copy(update={"tail": robot.tail.model_copy(update=hinges)})


@dataclass(frozen=True, eq=False)
class DecayFit:
    """The hinges from one free decay.

    Attributes:
        name: of the trial.
        stiffness_n_m, stiffness_se_n_m: of every hinge, N m/rad, with its standard error.
        damping_n_m_s, damping_se_n_m_s: of every hinge, N m s/rad.
        matched_stiffness_n_m: that whose twin has the same peak and decay, the first estimate.
        spectrum: of the measured decay.
        noise: of the tracks, as the fit found it.
        start_rad: (2, h) hinge angles (rad) and rates (rad/s) in the first frame.
        time_s: (n,) from the first frame after the release, s.
        markers: the k tail markers.
        measured_m, simulated_m: (n, k) lateral motion with the boxes' offsets taken off; nan where it does not count.
        rms_m: of their difference.
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
    """The weighted geometric mean of several decays.

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
