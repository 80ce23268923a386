"""All public names of `import calib` as Markdown with directives of autodoc, in groups."""

import inspect
from types import ModuleType

GROUPS = {
    "Sessions": "open_session new_session doctor Session",
    "Computing": "run track fit posterior diagnose effect_test",
    "Showing and exporting": "report compare view export_mjcf load_twin",
    "Tracks": "load_tracks convert_tracks correct",
    "Results": "FitResult StructureResult PosteriorResult GapResult EffectTest TrackResult SwimTwin",
    "Effects": "effects Effect Parameter",
}
"""Names by group; one that no longer exists is left out, a new one comes under its kind."""
ABOUT = {
    "Results": "Every result is frozen and has `to_frame(table)`, `summary()` and `details()`, most also `plot`.",
    "Effects": "[The catalogue](../effects.md), and [an effect of your own](../effects.md#an-effect-of-your-own).",
    "Errors": "[What to do about each](errors.md).",
}


def interface() -> str:
    """A heading for each group, and what its names are."""
    from calib import interface as module

    public = {name: getattr(module, name) for name in module.__all__}
    groups = {title: [name for name in names.split() if name in public] for title, names in GROUPS.items()}
    placed = {name for names in groups.values() for name in names}
    for name, what in public.items():
        if name not in placed:
            groups.setdefault(_kind(what), []).append(name)
    return "\n".join(
        _section(title, [_directive(name, public[name]) for name in names]) for title, names in groups.items()
    )


def _kind(what: object) -> str:
    if isinstance(what, ModuleType):
        return "Modules"
    if inspect.isclass(what):
        return "Errors" if issubclass(what, Exception) else "More classes"
    return "More functions"


def _section(title: str, directives: list[str]) -> str:
    listed = "\n".join([".. currentmodule:: calib.interface", *directives])
    return f"## {title}\n\n{ABOUT.get(title, '')}\n\n```{{eval-rst}}\n{listed}\n```\n"


def _directive(name: str, what: object) -> str:
    if isinstance(what, ModuleType):
        return f".. automodule:: {what.__name__}\n   :members:"
    if inspect.isclass(what):
        kind = "exception" if issubclass(what, Exception) else "class"
        members = "" if issubclass(what, Exception | tuple) else "\n   :members:"
        return f".. auto{kind}:: {name}{members}"
    return f".. autofunction:: {name}"
