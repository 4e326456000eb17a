"""The repository itself: what may not stand in it, and what a built distribution holds."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import clutter6d

ROOT = Path(__file__).resolve().parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
BUILT = {".git", ".venv", "demo", "site", "dist", "build", "node_modules"}
PACKAGES = {"clutter6d", "dapl_baselines", "leaderboard"}
MAX_FILE_BYTES = 2_000_000
MAX_CHECKPOINT_BYTES = 10_000_000
MAX_DATASETS_BYTES = 40_000_000

# Spelled apart so that this file passes its own test.
REGISTRY_HOSTS = re.compile(
    "|".join(
        ["pypi" + r"\.org", "python" + "hosted", "npm" + r"js\.(org|com)", "deb" + r"ian\.org", "proxy" + r"\.golang"]
    )
)
MACHINE_PATHS = re.compile(r"(?<![\w.:/~$}>-])/(" + "|".join(["work", "root", "tmp", "home"]) + r")/[\w.]")


@cache
def project_files() -> tuple[Path, ...]:
    """What git tracks; without git, everything that is not built."""
    if shutil.which("git") and (ROOT / ".git").exists():
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
        found = (ROOT / os.fsdecode(name) for name in listed.split(b"\0") if name)
        return tuple(path for path in found if path.is_file())
    return tuple(path for path in ROOT.rglob("*") if path.is_file() and not BUILT & set(path.relative_to(ROOT).parts))


def text_lines() -> list[tuple[str, str]]:
    lines: list[tuple[str, str]] = []
    for path in project_files():
        content = path.read_bytes()
        if b"\0" not in content[:8192]:
            name = path.relative_to(ROOT).as_posix()
            lines += [(f"{name}:{number}", line) for number, line in enumerate(content.decode().splitlines(), 1)]
    return lines


def test_there_is_something_to_look_at() -> None:
    names = {path.relative_to(ROOT).as_posix() for path in project_files()}
    assert {"pyproject.toml", "clutter6d/errors.py", "Makefile", ".ci/run"} <= names


def test_no_file_names_a_package_registry() -> None:
    assert not [place for place, line in text_lines() if REGISTRY_HOSTS.search(line)]


def test_no_file_names_a_folder_of_one_machine() -> None:
    assert not [place for place, line in text_lines() if MACHINE_PATHS.search(line)]


def test_no_file_is_large() -> None:
    sizes = {path.relative_to(ROOT): path.stat().st_size for path in project_files()}
    frozen = {path: size for path, size in sizes.items() if path.parts[0] == "datasets"}
    assert sum(frozen.values()) < MAX_DATASETS_BYTES
    checkpoints = {path: size for path, size in sizes.items() if path.parts[:2] == ("dapl_baselines", "checkpoints")}
    assert all(size < MAX_CHECKPOINT_BYTES for size in checkpoints.values())
    assert sum(checkpoints.values()) < 4 * MAX_CHECKPOINT_BYTES
    others = sizes.keys() - frozen.keys() - checkpoints.keys()
    assert not [path for path in others if sizes[path] > MAX_FILE_BYTES]


def test_the_datasets_folder_holds_no_python() -> None:
    assert not list((ROOT / "datasets").rglob("*.py*"))


def test_versions_agree() -> None:
    citation = (ROOT / "CITATION.cff").read_text()
    assert PROJECT["version"] == clutter6d.__version__
    assert re.search(rf"^version: {re.escape(clutter6d.__version__)}$", citation, re.MULTILINE)
    assert f"## [{clutter6d.__version__}]" in (ROOT / "CHANGELOG.md").read_text()


def test_every_command_of_the_console_can_be_imported() -> None:
    from importlib import import_module

    for group in PROJECT["entry-points"].values():
        for value in group.values():
            module, attribute = value.split(":")
            assert hasattr(import_module(module), attribute), value


def test_every_requirement_has_a_tested_version() -> None:
    pinned = {line.split("==")[0].lower().replace("_", "-") for line in _constraints()}
    tested = ("baselines", "dev", "docs")
    wanted = [*PROJECT["dependencies"], *(item for extra in tested for item in PROJECT["optional-dependencies"][extra])]
    names = {re.split(r"[\[<>=~!;, ]", item)[0].lower().replace("_", "-") for item in wanted}
    assert not names - pinned


def test_tested_versions_are_plain() -> None:
    assert not [line for line in _constraints() if not re.fullmatch(r"[\w.-]+==[\w.]+", line)]


def _constraints() -> list[str]:
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


@pytest.mark.parametrize("name", [".ci/run", ".ci/create-venv"])
def test_scripts_are_executable(name: str) -> None:
    assert os.access(ROOT / name, os.X_OK)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> zipfile.ZipFile:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, capture_output=True, timeout=300)
    return zipfile.ZipFile(next(folder.glob("*.whl")))


@pytest.mark.slow
def test_the_wheel_holds_the_named_packages_and_nothing_else(wheel: zipfile.ZipFile) -> None:
    tops = {name.split("/")[0] for name in wheel.namelist()}
    assert tops == {*PACKAGES, f"clutter6d-{clutter6d.__version__}.dist-info"}


@pytest.mark.slow
def test_the_wheel_holds_every_tracked_file_of_the_packages(wheel: zipfile.ZipFile) -> None:
    tracked = {path.relative_to(ROOT).as_posix() for path in project_files()}
    wanted = {name for name in tracked if name.split("/")[0] in PACKAGES}
    assert not wanted - set(wheel.namelist())
    assert "clutter6d/py.typed" in wheel.namelist()


@pytest.mark.slow
def test_the_wheel_works_without_the_repository(wheel: zipfile.ZipFile, tmp_path: Path) -> None:
    wheel.extractall(tmp_path)
    script = (
        "import clutter6d; from clutter6d.cli import run; print(clutter6d.__file__)\n"
        "split = clutter6d.load_split('dense-test'); print(split.path, len(split.assets_of(split[0])))\n"
        "raise SystemExit(run(['--help']))"
    )
    result = subprocess.run(
        [sys.executable, "-P", "-c", script],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
    )
    assert result.returncode == 0, result.stderr
    assert result.stdout.startswith(str(tmp_path))
    assert f"{tmp_path / 'clutter6d/datasets/clutter6d-v1/dense-test.parquet'} 12" in result.stdout


def test_types_and_shapes_are_checked_while_the_tests_run() -> None:
    from clutter6d.geometry import quat_conjugate

    with pytest.raises(TypeError, match="quat"):
        quat_conjugate(np.zeros(3))
