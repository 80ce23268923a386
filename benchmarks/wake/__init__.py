"""Third generator of sessions: its thrust comes from a vortex wake that is shed, not from forces by strips.

It shares robot, tendons, integrator, camera and recording with `benchmarks.reality`; the water is its own.
"""

from benchmarks.wake.run import simulate

__all__ = ["simulate"]
