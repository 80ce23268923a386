"""Mechanisms that no catalogue holds."""
