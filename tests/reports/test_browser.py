"""The report in a real browser: no console errors, no request that leaves the file."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import pytest

from reports.index import IndexEntry, write_index
from reports.report import write_report
from tests.cases import later
from tests.reports.sample import made_context
from tests.reports.test_index import RESULT
from tests.reports.whole import made_bench_calibration

FLAGS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--hide-scrollbars",
    "--enable-logging=stderr",
    "--virtual-time-budget=3000",
]
NAMES = (os.environ.get("SWIMCAL_CHROMIUM", ""), "chromium", "chromium-browser", "google-chrome")
CHROMIUM = next((found for name in NAMES if name and (found := shutil.which(name))), None)

pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="no Chromium here (chromium, chromium-browser, or set SWIMCAL_CHROMIUM)"
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reports")
    context = made_context(made_bench_calibration())
    write_report(folder / "report.html", context)
    write_index(folder / "index.html", [IndexEntry("pool", folder / "report.html", RESULT)])
    return folder


def opened(page: Path, *more: str) -> subprocess.CompletedProcess[str]:
    """The page opened where no host can be found."""
    command = [
        str(CHROMIUM),
        *FLAGS,
        "--host-resolver-rules=MAP * ~NOTFOUND",
        f"--user-data-dir={page}.profile",
    ]
    return subprocess.run([*command, *more, page.as_uri()], capture_output=True, text=True, timeout=120, check=True)


@pytest.mark.parametrize("name", ["report.html", "index.html"])
def test_the_console_stays_empty_and_nothing_is_requested(folder: Path, name: str) -> None:
    log = folder / f"{name}.net.json"

    shown = opened(folder / name, f"--log-net-log={log}", "--dump-dom")

    assert "CONSOLE" not in shown.stderr, shown.stderr
    assert "</html>" in shown.stdout
    assert shown.stdout.count('title="Save this figure as PNG"') == shown.stdout.count("<figure")
    assert requested(log) == []


def test_a_page_that_asks_for_more_would_be_seen(tmp_path: Path) -> None:
    page, log = tmp_path / "page.html", tmp_path / "net.json"
    page.write_text('<img src="http://nowhere.invalid/x.png"><script>console.error("seen")</script>')

    shown = opened(page, f"--log-net-log={log}", "--dump-dom")

    assert "CONSOLE" in shown.stderr
    assert requested(log) == ["http://nowhere.invalid/x.png"]


def test_it_is_no_wider_than_a_phone(folder: Path) -> None:
    title = probed(folder, "document.title = `${frame.document.documentElement.scrollWidth} px`")

    assert title == "390 px"


@pytest.mark.parametrize(
    ("button", "start"), [*later((0, "sweep.svg blob:file:")), (1, "sweep.png data:image/png;base64,")]
)
def test_a_figure_can_be_saved(folder: Path, button: int, start: str) -> None:
    title = probed(
        folder,
        "frame.HTMLAnchorElement.prototype.click = function () {"
        "  document.title = `${this.download} ${this.href.slice(0, 1000)}` };"
        f"frame.document.querySelectorAll('#sweep button')[{button}].click()",
    )

    assert title.startswith(start)


def probed(folder: Path, script: str) -> str:
    """The title that a script sets, which sees the report in a frame as wide as a phone."""
    probe = folder / "probe.html"
    look = "const frame = document.querySelector('iframe').contentWindow;"
    probe.write_text(
        '<iframe src="report.html" style="width:390px;height:800px;border:0"></iframe>'
        f"<script>onload = () => {{ {look} {script} }}</script>"
    )
    dom = opened(probe, "--allow-file-access-from-files", "--dump-dom").stdout
    return dom.split("<title>")[1].split("</title>")[0]


def requested(net_log: Path) -> list[str]:
    """The URLs on the network that the page caused; what the browser asks for itself has no origin."""
    events = json.loads(net_log.read_text())["events"]
    asked = [params for event in events if "initiator" in (params := event.get("params", {}))]
    return [params["url"] for params in asked if params["initiator"] != "not an origin"]
