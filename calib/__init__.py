"""From videos of a tendon-driven robot fish to a calibrated MuJoCo twin, its uncertainty, and what it still gets wrong.

    import calib

    session = calib.open_session("pool-2026-05-12")
    fit = calib.fit(session, effort="quick")
    posterior = calib.posterior(session)
    gap = calib.diagnose(session)
    fit.to_frame(), fit.plot.envelope("f1_00"), gap.effects.to_frame(), gap.plot.forces()
    calib.report(session)

All public names are in `calib.interface`. They are loaded on first use, so that importing the package alone
costs nothing beyond the standard library. The motor is driven by `calib.capture`, which needs nothing else of it.
"""

from importlib import import_module
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calib.interface import *  # noqa: F403


PACKAGES = ("swimcal", "tracking", "fitting", "swimsynth", "diagnosis", "reports")
"""Packages that the program is made of, beside this one."""
_MODULES = ("camera", "capture", "policy")
"""Public modules, each with the functions of a command that has subcommands."""


def __getattr__(name: str) -> Any:
    unknown = AttributeError(f"module {__name__!r} has no attribute {name!r}")
    if name == "capture":  # it runs on the robot's computer, which has no other package of ours
        return import_module("calib.capture")
    if name not in ("__all__", *_MODULES) and (name.startswith("_") or find_spec(f"{__name__}.{name}")):
        raise unknown  # other modules are no public names
    from calib.entry import check_shadowing

    check_shadowing()
    if name in _MODULES:
        return import_module(f"calib.{name}")
    from calib import interface

    if name == "__all__":
        return interface.__all__
    if name not in interface.__all__:
        raise unknown
    return getattr(interface, name)


def __dir__() -> list[str]:
    from calib import interface

    return sorted(interface.__all__)
