"""The site builds without a warning, and every link within it leads somewhere. Needs the extra `docs`."""

import re
import subprocess
import sys
from pathlib import Path
from urllib.parse import unquote

import pytest

from tests.test_documents import ROOT


@pytest.mark.long
def test_the_site_builds_and_its_links_lead_somewhere(tmp_path: Path) -> None:
    for needed in ("furo", "myst_nb", "sphinx_copybutton"):
        pytest.importorskip(needed, reason="`make docs` installs what the site needs")
    build = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", "--conf-dir", "docs", ".", str(tmp_path)]
    built = subprocess.run(build, cwd=ROOT, capture_output=True, text=True, check=False)
    assert built.returncode == 0, built.stderr
    pages = {page.resolve(): page.read_text() for page in tmp_path.rglob("*.html")}
    ids = {page: set(re.findall(r'\bid="([^"]+)"', text)) for page, text in pages.items()}
    for page, text in pages.items():
        for link in re.findall(r'(?:href|src)="([^"]+)"', re.sub(r"<script.*?</script>", "", text, flags=re.DOTALL)):
            if not re.match(r"https?:|mailto:|data:", link):
                name, _, anchor = link.partition("#")
                target = (page.parent / unquote(name.partition("?")[0])).resolve() if name else page
                assert target.exists(), (page, link)
                assert not anchor or unquote(anchor) in ids.get(target, {unquote(anchor)}), (page, link)
