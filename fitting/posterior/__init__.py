"""Posterior of the coefficients: draws of the model whose mode is the fit, by a surrogate of the twin."""
