"""Posterior: draws of the model whose mode is the fit, by an emulator of the twin about the mode and an ensemble
sampler.
"""
