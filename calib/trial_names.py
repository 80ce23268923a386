"""Names of trials, made from those of files: each its own, fit for a file on any system."""

import re
import unicodedata
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

from swimcal.errors import FaultCollector

COPIES = (".lrv", ".lrf", ".thm")
"""Suffixes of files that a camera keeps next to a video: a small copy of it (GoPro, Insta360, DJI), a picture."""
DEEPEST = 3
"""Largest number of folders that are put before a name."""
LONGEST = 80


def without_copies(videos: Sequence[Path]) -> tuple[list[Path], list[str]]:
    """Drop a camera's small copies of other videos, and write a note for each that is left out.

    A copy has the name of its video, or another beginning before the same number: GL010001.LRV of GX010001.MP4.
    """
    whole = [path for path in videos if path.suffix.lower() not in COPIES]
    kept, notes = [], []
    for path in videos:
        own = next((each for each in whole if path not in whole and _is_copy(path, each)), None)
        if own is None:
            kept.append(path)
        else:
            notes.append(f"left out: {in_a_line(path)}, the camera's small copy of {in_a_line(own)}")
    return kept, notes


def trial_names(videos: Sequence[Path], tracks: Sequence[Path], are_names: bool) -> tuple[list[str], list[str]]:
    """Name each video and each file of tracks; a video and tracks of one name are one trial.

    Files of one name, letter case aside, get those of their folders before it, and a number where these are the same
    too.

    Args:
        videos: paths of the videos.
        tracks: paths of the tracks.
        are_names: whether tracks are already given by name.

    Raises:
        InputError: a file is given twice.
    """
    _check_paths({"--videos": videos, "--tracks": () if are_names else tracks})
    plain = [[_safe(_stem(path)) for path in videos], [_safe(str(p) if are_names else _stem(p)) for p in tracks]]
    names = [list(kind) for kind in plain]
    clashing = {key for kind in plain for key, same in groupby(sorted(map(str.casefold, kind))) if len([*same]) > 1}
    for key in sorted(clashing):
        places = [(k, i) for k, kind in enumerate(plain) for i, name in enumerate(kind) if name.casefold() == key]
        for k, i in places:
            names[k][i] = plain[k][i]
        for depth in range(1, DEEPEST + 1):
            longer = {(k, i): _add_folders((videos, tracks)[k][i], plain[k][i], depth) for k, i in places}
            if all(_differ([name for (k, _), name in longer.items() if k == kind]) for kind in (0, 1)):
                for (k, i), name in longer.items():
                    names[k][i] = name
                break
    return _number_names(names[0]), _number_names(names[1])


def _is_copy(copy: Path, video: Path) -> bool:
    number = re.search(r"\d{4,}", copy.stem)
    same = copy.stem.lower() == video.stem.lower() or (number is not None and copy.stem[2:] == video.stem[2:])
    return copy.parent == video.parent and same


def _check_paths(given: Mapping[str, Sequence[Path]]) -> None:
    """Check that each file is given once, by a name that can be written down."""
    faults = FaultCollector("the files")
    for option, paths in given.items():
        seen: dict[Path, Path] = {}
        for path in paths:
            try:
                str(path).encode()
                first = seen.setdefault(path.resolve(), path)
            except UnicodeEncodeError:
                shown = str(path).encode(errors="backslashreplace").decode()
                faults.add(option, "a name that is not UTF-8", found=shown, next_step="Rename the file.")
            except (OSError, RuntimeError):
                step = "Links lead to one another: give the file itself."
                faults.add(option, "a link that leads nowhere", found=str(path), next_step=step)
            else:
                if first is not path:
                    faults.add(option, "a file is given twice", found=f"{first} and {path}", expected="each once")
    faults.raise_if_any()


def in_a_line(path: Path) -> str:
    """Show the name of a file in one line of a comment."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in path.name)


def _stem(path: Path) -> str:
    """Return the name of a recording's file without suffixes, also without what DeepLabCut appends to a video's."""
    name = path.name.removesuffix(".gz")
    name = name[: name.rfind(".")] if "." in name else name
    return re.sub(r"DLC_.*shuffle.*", "", name) or name


def _safe(name: str) -> str:
    """Spell a name in letters, digits, _ and -, without accents."""
    plain = unicodedata.normalize("NFKD", name.replace("ß", "ss")).encode("ascii", "ignore").decode()
    return re.sub(r"[^A-Za-z0-9_-]+", "_", plain).strip("_-")[:LONGEST].rstrip("_-") or "trial"


def _add_folders(path: Path, name: str, depth: int) -> str:
    folders = [_safe(part) for part in path.absolute().parent.parts[-depth:] if part != path.anchor]
    return "_".join([*folders, name])[-LONGEST:].lstrip("_-")


def _differ(names: Sequence[str]) -> bool:
    return len({name.casefold() for name in names}) == len(names)


def _number_names(names: Sequence[str]) -> list[str]:
    """Add numbers to names that occurred before: a, a_2, a_3."""
    taken: set[str] = set()
    found = []
    for name in names:
        free, number = name, 2
        while free.casefold() in taken or (number > 2 and free in names):
            free, number = f"{name}_{number}", number + 1
        taken.add(free.casefold())
        found.append(free)
    return found
