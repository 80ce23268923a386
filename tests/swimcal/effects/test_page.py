"""The page of the documentation names every effect, and its example works."""

import re
import tomllib
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from swimcal.effects.catalogue import catalogue
from swimcal.effects.effect import Effect
from tests.swimcal.effects.swims import PLAIN, TIME_S, plain_runs, with_effect

PAGE = Path(__file__).parents[3] / "docs" / "effects.md"


def test_the_page_names_every_effect_of_the_catalogue() -> None:
    named = re.findall(r"`(\w+)`", PAGE.read_text().partition("## The catalogue")[2].partition("## ")[0])
    assert set(catalogue()) <= set(named)


@pytest.fixture
def example(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Effect]:
    """The effect of the page, found through its entry point in a package that is installed."""
    section = PAGE.read_text().partition("## An effect of your own")[2]
    module, points = (re.findall(rf"```{form}\n(.*?)```", section, re.S)[0] for form in ("python", "toml"))
    group = "swimcal.effects"
    (entry,) = tomllib.loads(points)["project"]["entry-points"][group].items()
    package, info = tmp_path / "my_robot", tmp_path / "my_robot-1.0.dist-info"
    for folder in (package, info):
        folder.mkdir()
    (package / "trailing_cable.py").write_text(module)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-robot\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n{entry[0]} = {entry[1]}\n")
    monkeypatch.syspath_prepend(tmp_path)
    catalogue.cache_clear()
    yield catalogue()["trailing_cable"]
    catalogue.cache_clear()


def test_the_effect_of_the_page_is_found_and_brakes_the_swims(example: Effect) -> None:
    plain = PLAIN.simulate(plain_runs(), TIME_S).marker_m
    assert np.array_equal(with_effect(example, np.zeros(1))[0], plain)
    braked = with_effect(example, np.array([1.0]))[0]
    way, braked_way = (np.ptp(marker_m[:, :, 0], axis=1) for marker_m in (plain, braked))
    assert (braked_way.mean(axis=1) < way.mean(axis=1)).all()
