"""ArviZ without its announcement of the next release, which it makes at the first import of every day."""

import warnings

with warnings.catch_warnings():
    warnings.filterwarnings("ignore", message=r"\s*ArviZ is undergoing", category=FutureWarning)
    import arviz

__all__ = ["arviz"]
