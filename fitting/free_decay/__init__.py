"""Free decay -> hinge stiffness and damping: release, spectrum, ring, and the fit of the whole decay by the twin."""

from fitting.free_decay.damped_sine import DampedSine, fit_damped_sine
from fitting.free_decay.decay_fit import fit_decay
from fitting.free_decay.decay_trial import DecayTrial, measure_decay_trial
from fitting.free_decay.decay_twin import DecayTwin
from fitting.free_decay.hinges import DecayFit, HingeEstimate, combine_decays
from fitting.free_decay.lasting_noise import LastingNoise
from fitting.free_decay.release import Release, find_release
from fitting.free_decay.ring import Ring
from fitting.free_decay.spectrum import DecaySpectrum, measure_decay

__all__ = [
    "DampedSine",
    "DecayFit",
    "DecaySpectrum",
    "DecayTrial",
    "DecayTwin",
    "HingeEstimate",
    "LastingNoise",
    "Release",
    "Ring",
    "combine_decays",
    "find_release",
    "fit_damped_sine",
    "fit_decay",
    "measure_decay",
    "measure_decay_trial",
]
