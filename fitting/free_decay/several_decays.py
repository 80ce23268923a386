"""Several releases of one robot -> one stiffness and one damping."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from fitting.free_decay.decay_fit import DecayFit
from session import Flag, NotEnoughData

LEAST_CHANCE = 0.01  # of decays of one robot being as far apart, below which they disagree


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
            said = ", ".join(f"{fit.name} {value:.3g} ± {value * error:.1g}" for fit, value, error in parts)
            message = f"the decays disagree about the {name} by more than their errors, look at each of them: {said}"
            flags.append(Flag("decays_disagree", message=f"{message} {unit}"))
    return HingeEstimate(
        stiffness_n_m=float(stiffness),
        stiffness_se_n_m=float(stiffness * relative[0]),
        damping_n_m_s=float(damping),
        damping_se_n_m_s=float(damping * relative[1]),
        decays=len(fits),
        flags=tuple(flags),
    )
