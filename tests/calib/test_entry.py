"""What `import calib` gives, and what it costs."""

from __future__ import annotations

import subprocess
import sys

import pytest

import calib


def test_the_names_it_promises_are_there() -> None:
    assert [getattr(calib, name).__name__ for name in calib.__all__] == calib.__all__


def test_a_name_it_does_not_have_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="module 'calib' has no attribute 'nonsense'"):
        _ = calib.nonsense


def test_importing_it_alone_loads_nothing_beyond_the_standard_library() -> None:
    """So that a part of it may run where nothing else is installed."""
    code = "import sys; import calib; print(*{'numpy', 'mujoco', 'fitting', 'session'} & set(sys.modules))"
    shown = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)

    assert shown.stdout.strip() == ""
