"""How sure the trials make us of the coefficients: gaits, noise that lasts, an emulator, an ensemble sampler."""

from fitting.model.session_model import SessionModel
from fitting.posterior.inference import sample_posterior
from fitting.posterior.posterior import Posterior

__all__ = [
    "Posterior",
    "SessionModel",
    "sample_posterior",
]
