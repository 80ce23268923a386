"""What a newcomer gets: the lock, the wheel, and commands that are there."""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

ROOT = Path(__file__).resolve().parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = PROJECT["tool"]["setuptools"]["packages"]
LOCK = ROOT / "requirements.lock"
PAGES = ("README.md", "CONTRIBUTING.md")
DATA = re.compile(
    r"[a-z]+/py\.typed$|swimcal/robots/[^/]+\.toml$|diagnosis/discrepancy\.npz$|swimgym/policies/[^/]+$"
    r"|(reports|calib|tracking)/templates/[^/]+$"
)
NOT_SHIPPED = {"tests", "benchmarks"}

HOST_OR_INDEX = re.compile(r"https?://|file:|git\+|^\s*--(?!hash=)|pypi\.org|pythonhosted\.org", re.MULTILINE)
REGISTRY_HOST = re.compile(r"pypi\.org|pythonhosted\.org")
MACHINE_PATH = re.compile(r"(?<![\w.~$}/-])/(?:work|root|home|Users)/\w")


def committed_files() -> list[str]:
    """Names of the files that git tracks or would add."""
    if shutil.which("git") is None or not (ROOT / ".git").exists():
        pytest.skip("needs a git checkout to tell the project's files")
    command = ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"]
    names = subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout.split("\0")
    return sorted({name for name in names if (ROOT / name).is_file()})


def package_of(name: str) -> str:
    """The dotted name of a file's folder."""
    return ".".join(Path(name).parent.parts)


def locked() -> dict[str, list[Version]]:
    """The versions of each distribution in the lock; several where they depend on the platform."""
    versions: dict[str, list[Version]] = {}
    for name, version in re.findall(r"^([\w.-]+)==([^\s;\\]+)", LOCK.read_text(), re.MULTILINE):
        versions.setdefault(canonicalize_name(name), []).append(Version(version))
    return versions


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A wheel of what is committed, built apart from the checkout and without the network."""
    source, target = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in committed_files():
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, source / name)
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--no-build-isolation", "--no-index"]
    built = subprocess.run([*command, "--wheel-dir", target, source], capture_output=True, text=True)
    assert built.returncode == 0, built.stdout + built.stderr
    return next(target.glob("swimcal-*.whl"))


def test_every_requirement_in_the_lock_has_a_hash() -> None:
    blocks = re.split(r"\n(?=\S)", LOCK.read_text())
    without = [block for block in blocks if not block.startswith("#") and "--hash=sha256:" not in block]

    assert without == []


def test_the_lock_names_no_host_and_no_index() -> None:
    assert HOST_OR_INDEX.findall(LOCK.read_text()) == []


def test_the_lock_satisfies_the_project() -> None:
    wanted = [*PROJECT["project"]["dependencies"], *PROJECT["dependency-groups"]["dev"]]
    pinned = locked()

    for requirement in map(Requirement, wanted):
        versions = pinned.get(canonicalize_name(requirement.name), [])
        fits = [requirement.specifier.contains(version) for version in versions]
        assert fits, f"{requirement} is not in the lock; run `make lock`"
        assert all(fits), f"the lock has {requirement.name} {versions}, not {requirement}; run `make lock`"


def test_every_package_of_the_checkout_is_in_the_wheel_and_no_other() -> None:
    found = {package_of(name) for name in committed_files() if name.endswith("__init__.py")}

    assert {package for package in found if package.split(".")[0] not in NOT_SHIPPED} == set(PACKAGES)


def test_the_wheel_holds_the_packages_with_their_data_and_nothing_else(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    shipped = {name for name in names if ".dist-info/" not in name}
    code = {name for name in committed_files() if package_of(name) in PACKAGES and name.endswith(".py")}
    data = {name for name in committed_files() if DATA.match(name)}

    assert shipped == code | data
    assert any(name.endswith("/licenses/LICENSE") for name in names)


def test_every_package_in_the_wheel_tells_type_checkers_that_it_is_typed(wheel: Path) -> None:
    """A `py.typed` in the top folder counts for the packages below it (PEP 561)."""
    names = set(zipfile.ZipFile(wheel).namelist())

    assert {package for package in PACKAGES if f"{package.split('.')[0]}/py.typed" not in names} == set()


def shown_from(wheel: Path, code: str, folder: Path) -> str:
    """What code prints that finds the wheel's packages before those of the checkout."""
    zipfile.ZipFile(wheel).extractall(folder / "site")
    code = f"import sys; sys.path.insert(0, {str(folder / 'site')!r})\n{code}"
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.mark.long
def test_everything_imports_from_the_wheel(wheel: Path, tmp_path: Path) -> None:
    code = (
        f"import importlib\nfor name in {PACKAGES!r}: print(importlib.import_module(name).__file__)\n"
        "import swimcal.robot; swimcal.robot.load_robot()\n"
    )

    shown = shown_from(wheel, code, tmp_path)
    assert all(Path(line).is_relative_to(tmp_path) for line in shown.splitlines()), shown


@pytest.mark.parametrize("page", PAGES)
def test_the_targets_that_a_page_names_are_in_the_makefile(page: str) -> None:
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    named = set(re.findall(r"(?:^|`)make ([a-z-]+)", (ROOT / page).read_text(), re.MULTILINE))

    assert named
    assert named <= targets


def test_no_committed_file_names_a_machine_or_a_package_host() -> None:
    found = {
        name: match.group()
        for name in committed_files()
        for pattern in (MACHINE_PATH, REGISTRY_HOST)
        if (match := pattern.search((ROOT / name).read_bytes().decode(errors="replace")))
    }

    assert found == {}
