"""`results/structure.json` and its arrays: what is read back is what was written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fitting.structure import STRUCTURE, DryExperiments, Structure, identify_structure, read_structure
from session import Provenance
from tests.fitting.structure.experiments import DESCRIBED, measured

STAMP = Provenance("4.0.0", "0" * 64, {"session.toml": "1" * 64}, 0, "quick")


@pytest.fixture(scope="module")
def structure() -> Structure:
    """One dry run and the free decay."""
    return identify_structure(DryExperiments(measured().decays, measured().runs[1:]), DESCRIBED)


@pytest.mark.long
def test_a_structure_read_back_is_the_one_that_was_written(structure: Structure, tmp_path: Path) -> None:
    text, beside = STRUCTURE.write(tmp_path, STAMP, structure)
    read = read_structure(tmp_path, DESCRIBED, measured().runs)

    assert read.robot == structure.robot
    assert (read.sources, read.hinges, read.flags) == (structure.sources, structure.hinges, structure.flags)
    assert read.crank is not None
    assert read.crank.trials[0].measured is measured().runs[1]
    one, two = (STRUCTURE.write(tmp_path / name, STAMP, each) for name, each in {"a": structure, "b": read}.items())
    assert [path.read_bytes() for path in one] == [path.read_bytes() for path in two]

    payload = json.loads(text.read_text())
    (decay,) = payload["decays"]
    run: dict[str, Any] = payload["crank"]["trials"][0]

    assert decay["stiffness_n_m"] == structure.decays[0].stiffness_n_m
    assert run["measured"] == "dry_fast"
    with np.load(beside) as arrays:
        assert arrays[run["surface"]["distance_m"]].shape == (21, 81, 60)
    assert text.stat().st_size < 20_000
