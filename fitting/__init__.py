"""Estimation: swim frequency and phase, fluid coefficients, elongated body theory, and their scores."""
