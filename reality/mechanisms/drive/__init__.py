"""Crank and motor."""
