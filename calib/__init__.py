"""The front door: command line, pipeline, benchmarks.

`open_session`, `Pipeline` and `Options` are loaded when first asked for, so that importing the package alone costs
nothing beyond the standard library.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calib.pipeline import Options, Pipeline, open_session

__all__ = ["Options", "Pipeline", "open_session"]


def __getattr__(name: str) -> Any:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from calib import pipeline

    return getattr(pipeline, name)
