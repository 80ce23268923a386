"""Crank arms and tendons."""
