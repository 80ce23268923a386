"""How sure the trials make us of the coefficients: gaits, noise that lasts, an emulator, an ensemble sampler."""

from fitting.posterior.inference import sample_posterior
from fitting.posterior.posterior import Posterior
from fitting.posterior.session_model import SessionModel

__all__ = [
    "Posterior",
    "SessionModel",
    "sample_posterior",
]
