"""The sim-to-real gap: where it lies, which effect makes it, how far it shrinks with it, what to measure next."""
