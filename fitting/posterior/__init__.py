"""Posterior: draws of the model whose mode is the fit, by an emulator of the twin about the mode and an ensemble
sampler.
"""

from fitting.posterior.posterior import Posterior, sample_posterior

__all__ = ["Posterior", "sample_posterior"]
