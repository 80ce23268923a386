"""How sure the trials make us of the coefficients: gaits, noise that lasts, an emulator, an ensemble sampler."""

from fitting.posterior.emulator import Emulator, fit_emulator
from fitting.posterior.exploration import Exploration, explore
from fitting.posterior.gait import Gait
from fitting.posterior.inference import EFFECTIVE, sample_posterior
from fitting.posterior.likelihood import Likelihood
from fitting.posterior.noise import GaitNoise, noise_of
from fitting.posterior.posterior import Posterior
from fitting.posterior.sampling import Draws, sample
from fitting.posterior.session_model import SessionModel
from fitting.posterior.trial_model import TrialModel

__all__ = [
    "EFFECTIVE",
    "Draws",
    "Emulator",
    "Exploration",
    "Gait",
    "GaitNoise",
    "Likelihood",
    "Posterior",
    "SessionModel",
    "TrialModel",
    "explore",
    "fit_emulator",
    "noise_of",
    "sample",
    "sample_posterior",
]
