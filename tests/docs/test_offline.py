"""What the site would load from the network is found, and links that a reader follows are not."""

import importlib
from pathlib import Path

import pytest

from tests.test_documents import ROOT

LOADS = [
    '<script src="https://cdn.example/x.js"></script>',
    '<img alt="" src="//example/x.png">',
    '<link rel="stylesheet" href="https://example/x.css">',
    '<link href="https://example/x.css" rel="stylesheet">',
    "<style>@import 'https://example/x.css';</style>",
    "<style>p { background: url(https://example/x.png) }</style>",
]


@pytest.mark.parametrize("line", LOADS)
def test_what_is_loaded_is_found(line: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "_site"))
    offline = importlib.import_module("offline")
    (tmp_path / "a.html").write_text(f'<a href="https://example">x</a> {line} <script src="_static/x.js"></script>')
    assert len(list(offline.network_loads(tmp_path))) == 1
    (tmp_path / "a.html").write_text('<a href="https://example">x</a> <link rel="license" href="https://example">')
    assert list(offline.network_loads(tmp_path)) == []
