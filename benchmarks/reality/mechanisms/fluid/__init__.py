"""Mechanisms of the water."""
