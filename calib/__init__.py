"""The front door: command line, pipeline, benchmarks."""
