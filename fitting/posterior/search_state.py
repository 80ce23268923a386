"""How far the search for the posterior has come: all that decides how it goes on, and a file that keeps it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from zipfile import BadZipFile

import numpy as np

from fitting.model.session_model import Disturbances, PlacesOff
from fitting.posterior.places_off import TAKEN
from session.results import writing_whole


class Halved(NamedTuple):
    """Points (s, 5) of one round, and their gaits (s, k) by whole and by half time steps."""

    points: np.ndarray
    whole: np.ndarray
    halved: np.ndarray


@dataclass
class SearchState:
    """What the search has found so far.

    Attributes:
        random: of all draws to come.
        points, gaits: (s, 5) simulated so far, (s, k) what they gave.
        relevance: (s,) by which they count for the next emulator.
        halved: of the last rounds.
        looks: at nuisances, those of the last rounds.
        off: how far boxes and markers are off.
        walkers: (w, 7) where those of the last round stood; none before the first.
        mean: (5,) of the last round; nothing before the first.
        error: standard deviation of emulated minus simulated ln likelihood in the last round.
        rounds: done.
        settled: the emulator held in the last round.
        looked_closer: at nuisances and step, which comes after the last round.
    """

    random: np.random.Generator
    points: np.ndarray
    gaits: np.ndarray
    relevance: np.ndarray
    halved: list[Halved] = field(default_factory=list)
    looks: list[Disturbances] = field(default_factory=list)
    off: PlacesOff = TAKEN
    walkers: np.ndarray = field(default_factory=lambda: np.zeros((0, 7)))
    mean: np.ndarray = field(default_factory=lambda: np.zeros(0))
    error: float = np.inf
    rounds: int = 0
    settled: bool = False
    looked_closer: bool = False

    @classmethod
    def beginning(cls, random: np.random.Generator, length: int) -> SearchState:
        """Nothing is known yet of gaits of a length k."""
        return cls(random, np.zeros((0, 5)), np.zeros((0, length)), np.zeros(0))

    def save(self, path: Path) -> None:
        """Keeps it in a file, written whole."""
        random = json.dumps(self.random.bit_generator.state)
        simple = {name: getattr(self, name) for name in _SIMPLE}
        with writing_whole(path) as part:
            np.savez(
                part,
                allow_pickle=False,
                random=np.array(random),
                **simple,
                **_stacked("halved", Halved._fields, self.halved),
                **_stacked("looks", Disturbances._fields, self.looks),
            )

    @classmethod
    def load(cls, path: Path) -> SearchState | None:
        """What a file keeps; None where there is none, or none that can be read."""
        try:
            with np.load(path, allow_pickle=False) as kept:
                random = np.random.default_rng()
                random.bit_generator.state = json.loads(str(kept["random"]))
                arrays = [kept[name] for name in _SIMPLE]
                halved = [Halved(*parts) for parts in _apart("halved", Halved._fields, kept)]
                looks = [Disturbances(*parts) for parts in _apart("looks", Disturbances._fields, kept)]
        except (OSError, BadZipFile, KeyError, ValueError, EOFError):
            return None
        simple = {name: each if each.ndim else each.item() for name, each in zip(_SIMPLE, arrays, strict=True)}
        return cls(random, halved=halved, looks=looks, **simple | {"off": PlacesOff(*map(float, simple["off"]))})


_SIMPLE = ("points", "gaits", "relevance", "off", "walkers", "mean", "error", "rounds", "settled", "looked_closer")


def _stacked(name: str, parts: tuple[str, ...], rounds: list[Halved] | list[Disturbances]) -> dict[str, np.ndarray]:
    """Arrays of all rounds one upon another, and how many rows each has."""
    if not rounds:
        return {f"{name}_rows": np.zeros(0, int)}
    stacked = {
        f"{name}_{part}": np.concatenate(each) for part, each in zip(parts, zip(*rounds, strict=True), strict=True)
    }
    return stacked | {f"{name}_rows": np.array([len(each[0]) for each in rounds])}


def _apart(name: str, parts: tuple[str, ...], kept: np.lib.npyio.NpzFile) -> list[tuple[np.ndarray, ...]]:
    """The rounds that `_stacked` put together."""
    ends = np.cumsum(kept[f"{name}_rows"])
    if not len(ends):
        return []
    return list(zip(*[np.split(kept[f"{name}_{part}"], ends[:-1]) for part in parts], strict=True))
