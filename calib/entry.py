"""The entry point of the command `calib`: it guards the imports of the command line, a second in which Ctrl-C may come.

Files of a user hide a package of this program where they have its name and Python looks there first: that is reported.
"""

import os
import sys
from importlib.util import find_spec
from pathlib import Path

from calib import PACKAGES

_HOME = Path(__file__).resolve().parents[1]


def check_shadowing() -> None:
    """Check that every package of this program is the one that was installed with it.

    Raises:
        ImportError: another file has the name of one; names it and the next step.
    """
    hidden = [(name, place) for name in PACKAGES if (place := _place(name)) is not None]
    if hidden:
        places = "; ".join(f"{place} hides the package `{name}`" for name, place in hidden)
        raise ImportError(
            f"calib cannot be loaded: {places}. Expected the packages in {_HOME}. Rename the file or folder, or start "
            "Python in another folder; then restart the notebook's kernel."
        )


def main() -> None:
    """Run the command line; Ctrl-C ends it with one line and exit code 130 from the first import on."""
    # Figures go into files, and matplotlib cannot be imported if the environment names a backend that is missing.
    os.environ["MPLBACKEND"] = "agg"
    try:
        check_shadowing()
        from calib.capture.bus import print_in_any_encoding

        print_in_any_encoding()
        from calib.cli import main as command_line
    except KeyboardInterrupt:
        print("\ncalib: stopped before anything was begun.", file=sys.stderr)
        sys.exit(130)
    except ImportError as error:
        if not str(error).startswith("calib cannot be loaded"):
            raise
        print(f"calib: {error}", file=sys.stderr)
        sys.exit(2)
    command_line()


def _place(name: str) -> Path | None:
    """Find where the package of this name comes from, if not from here."""
    module = sys.modules.get(name)
    origin = getattr(module, "__file__", None) if module else None
    if module is None:
        spec = find_spec(name)
        origin = None if spec is None else spec.origin or next(iter(spec.submodule_search_locations or ()), None)
    if origin is None:
        return None
    path = Path(origin).resolve()
    own = path.parent if path.name == "__init__.py" else path
    return None if own == _HOME / name else path
