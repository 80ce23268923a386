"""Mechanisms of hinges and masses."""
