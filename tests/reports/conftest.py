"""What holds for all tests of reports."""

import importlib
import pkgutil

import pytest
from markupsafe import Markup
from matplotlib.figure import Figure

from reports import sections


@pytest.fixture
def words_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reports without what takes nearly all of their time, for tests of what they say: figures are not drawn."""
    for each in pkgutil.iter_modules(sections.__path__):
        section = importlib.import_module(f"{sections.__name__}.{each.name}")
        for name in list(vars(section)):
            if name.endswith("_figure"):
                monkeypatch.setattr(section, name, lambda *_args: Figure())
        if hasattr(section, "inline_svg"):
            monkeypatch.setattr(section, "inline_svg", lambda *_args: Markup("<svg></svg>"))
