"""Free decay: hinge stiffness and damping from release, spectrum, ring, and the fit of the whole decay by the twin."""

from fitting.free_decay.decay_fit import fit_decay
from fitting.free_decay.decay_trial import DecayTrial, measure_decay_trial
from fitting.free_decay.decay_twin import DecayTwin
from fitting.free_decay.hinges import DecayFit, HingeEstimate, combine_decays
from fitting.free_decay.ring import Ring
from fitting.free_decay.spectrum import DecaySpectrum

__all__ = [
    "DecayFit",
    "DecaySpectrum",
    "DecayTrial",
    "DecayTwin",
    "HingeEstimate",
    "Ring",
    "combine_decays",
    "fit_decay",
    "measure_decay_trial",
]
