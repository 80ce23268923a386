"""Benchmarks, for development only and not installed: they measure the toolkit on recordings whose truth is known."""
