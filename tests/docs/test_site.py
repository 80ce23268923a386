"""The site builds without a warning, its links lead somewhere, its search finds flags. Needs the extra `docs`."""

import json
import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.test_documents import ROOT


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    for needed in ("furo", "myst_nb", "sphinx_copybutton"):
        pytest.importorskip(needed, reason="`make docs` installs what the site needs")
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--conf-dir", "docs", ".", str(folder)]
    built = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.mark.long
def test_the_site_builds_and_its_links_lead_somewhere(site: Path) -> None:
    pages = {page.resolve(): page.read_text() for page in site.rglob("*.html")}
    ids = {page: set(re.findall(r'\bid="([^"]+)"', text)) for page, text in pages.items()}
    for page, text in pages.items():
        for link in re.findall(r'(?:href|src)="([^"]+)"', re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)):
            if not re.match(r"https?:|mailto:|data:", link):
                name, _, anchor = link.partition("#")
                target = (page.parent / unquote(name.partition("?")[0])).resolve() if name else page
                assert target.exists(), (page, link)
                assert not anchor or unquote(anchor) in ids.get(target, {unquote(anchor)}), (page, link)


@pytest.mark.long
def test_the_search_finds_every_flag_by_its_name_and_by_its_words(site: Path) -> None:
    """The index lists titles and index entries, each with the page and the anchor that a hit opens."""
    written = (site / "searchindex.js").read_text()
    index = json.loads(written[written.index("(") + 1 : written.rindex(")")])
    page = index["docnames"].index("docs/reference/flags")
    ids = set(re.findall(r'\bid="([^"]+)"', (site / "docs" / "reference" / "flags.html").read_text()))
    flags = re.findall(r"^### (\w+)$", (ROOT / "docs" / "reference" / "flags.md").read_text(), re.MULTILINE)
    assert flags
    for flag in flags:
        hits = [index["alltitles"][flag], index["indexentries"].get(flag.replace("_", " "), index["alltitles"][flag])]
        for hit in hits:
            anchors = [anchor for number, anchor, *_ in hit if number == page]
            assert anchors, flag
            assert ids.issuperset(anchors), flag
        assert "_" not in flag or flag.replace("_", " ") in index["indexentries"]
