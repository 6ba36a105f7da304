"""The wheel alone is enough: in an empty environment it validates and renders, from any folder."""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from email.parser import Parser
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

from swarmctl.cli.app import Verbs
from tests import ROOT


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The project as a wheel, built from a copy so that the checkout stays as it is."""
    root, copy, out = (
        ROOT,
        tmp_path_factory.mktemp("copy"),
        tmp_path_factory.mktemp("wheel"),
    )
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(root / name, copy)
    for name in ("swarmctl", "templates", "schemas", "tools"):
        shutil.copytree(root / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", ".*_cache"))
    pip = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "--disable-pip-version-check",
    ]
    subprocess.run([*pip, "-w", str(out), str(copy)], check=True)
    (built,) = out.glob("swarmctl-*.whl")
    return built


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The bin folder of an environment that holds the wheel; its dependencies are borrowed from this one.

    A line of a .pth file adds a folder but runs no .pth in it, so the editable checkout stays out of sight.
    """
    home = tmp_path_factory.mktemp("environment")
    venv.EnvBuilder(with_pip=False, symlinks=True).create(home)
    (site,) = home.glob("lib/python*/site-packages")
    (site / "borrowed.pth").write_text(sysconfig.get_paths()["purelib"] + "\n")
    pip = [sys.executable, "-m", "pip", "--python", str(home / "bin/python"), "install", "-q", "--no-deps"]
    subprocess.run([*pip, "--ignore-installed", "--disable-pip-version-check", str(wheel)], check=True)
    return home / "bin"


def ran(program: Path, *arguments: str, cwd: Path) -> subprocess.CompletedProcess[str]:
    env = {key: value for key, value in os.environ.items() if key not in ("PYTHONPATH", "FORCE_COLOR")}
    return subprocess.run(
        [str(program), *arguments], cwd=cwd, env=env, capture_output=True, text=True, check=False
    )


def test_what_it_reads_lies_inside_the_wheel(installed: Path, tmp_path: Path) -> None:
    code = "from swarmctl.resources import *; print(templates(), onboard(), schemas(), sep='\\n')"
    folders = [Path(line) for line in ran(installed / "python", "-c", code, cwd=tmp_path).stdout.splitlines()]
    assert len(folders) == 3
    for folder in folders:
        assert folder.is_relative_to(installed.parent)
        assert any(folder.iterdir())


def test_it_validates_and_renders_from_another_folder(
    installed: Path, leader_spec: Path, root: Path, tmp_path: Path
) -> None:
    shutil.copy(leader_spec, tmp_path)
    validated = ran(installed / "swarmctl", "validate", "swarm.yaml", cwd=tmp_path)
    assert (validated.returncode, validated.stderr) == (0, "")
    assert "is valid" in validated.stdout
    rendered = ran(installed / "swarmctl", "render", "swarm.yaml", "--out", "made", "--json", cwd=tmp_path)
    assert (rendered.returncode, rendered.stderr) == (0, "")
    render = (
        "-m",
        "swarmctl",
        "render",
        str(tmp_path / "swarm.yaml"),
        "--out",
        str(tmp_path / "here"),
        "--json",
    )
    here = ran(Path(sys.executable), *render, cwd=root)  # this checkout, whatever is installed
    digests = [
        {host: one["digest"] for host, one in json.loads(one_run.stdout)["hosts"].items()}
        for one_run in (rendered, here)
    ]
    assert digests[0] == digests[1]
    assert os.access(tmp_path / "made/k3-pi/bin/ros-exec", os.X_OK)


def test_it_begins_a_swarm_with_the_schemas_that_it_brings(
    installed: Path, root: Path, tmp_path: Path
) -> None:
    begun = ran(installed / "swarmctl", "init", "lab", cwd=tmp_path)
    assert (begun.returncode, begun.stderr) == (0, "")
    assert ran(installed / "swarmctl", "validate", "lab/swarm.yaml", cwd=tmp_path).returncode == 0
    for schema in (root / "schemas").iterdir():
        assert (tmp_path / "lab/.swarmctl" / schema.name).read_bytes() == schema.read_bytes()


def test_every_module_of_it_can_be_imported(installed: Path, tmp_path: Path) -> None:
    """``driver test`` imports the driver's packages only when it runs: a missing one is not seen before."""
    code = """
import importlib, pkgutil, swarmctl
for module in pkgutil.walk_packages(swarmctl.__path__, "swarmctl."):
    if not module.name.endswith(".__main__"):
        importlib.import_module(module.name)
"""
    imported = ran(installed / "python", "-I", "-c", code, cwd=tmp_path)
    assert (imported.returncode, imported.stderr) == (0, "")


def test_every_template_and_schema_is_in_it(wheel: Path, root: Path) -> None:
    packed = set(zipfile.ZipFile(wheel).namelist())
    onboard = root / "templates/onboard"
    shipped = [*(root / "schemas").rglob("*"), *(root / "templates").rglob("*")]
    for file in shipped:
        if file.is_file() and not {"__pycache__", ".ruff_cache", ".mypy_cache"} & set(file.parts):
            if not file.is_relative_to(onboard):
                assert f"swarmctl/data/{file.relative_to(root)}" in packed
            elif file.name != "ruff.toml":
                assert str(file.relative_to(onboard)) in packed


def test_pip_installs_a_manual_page_for_each_verb(installed: Path) -> None:
    pages = {page.name for page in (installed.parent / "share/man/man1").iterdir()}
    assert {"swarmctl.1", *(f"swarmctl-{verb.name}.1" for verb in Verbs.verbs)} < pages
    assert (
        ".B swarmctl lab fault unplug"
        in (installed.parent / "share/man/man1/swarmctl-lab-fault-unplug.1").read_text()
    )


def test_nothing_else_is_in_it(wheel: Path) -> None:
    names = [one for one in zipfile.ZipFile(wheel).namelist() if "/data/share/man/man1/" not in one]
    assert {name.split("/")[0].split("-")[0] for name in names} == {"swarmctl", "swarm_onboard"}
    assert not [name for name in names if name.endswith(".pyc") or "_cache/" in name]


#: What an extra brings, and the modules that import it; nothing else may.
OF_EXTRAS = {
    "distributed": ("remote/dask_cluster.py", "remote/worker.py"),
    "matplotlib": ("views/trajectory_plot.py",),
    "pandas": ("capsule/frames.py",),
    "rosbags": ("capsule/bag_reader.py",),
    "starlette": ("ui/server.py",),
    "uvicorn": ("ui/server.py",),
    "websockets": (),
    "prometheus_client": ("cli/verbs/exporter.py", "views/status_metrics.py"),
}


def test_it_names_every_package_that_it_imports(wheel: Path, root: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        (metadata,) = (name for name in archive.namelist() if name.endswith("/METADATA"))
        declared = Parser().parsestr(archive.read(metadata).decode()).get_all("Requires-Dist") or []
    names = {canonical(re.match(r"[\w.-]+", one)[0]) for one in declared if "extra ==" not in one}  # type: ignore[index]
    assert {canonical(one) for one in OF_EXTRAS} == {
        re.match(r"[\w.-]+", one)[0] for one in declared if "extra ==" in one
    }  # type: ignore[index]
    package = root / "swarmctl"
    imported = {
        module
        for file in package.rglob("*.py")
        for module in imports(file)
        if str(file.relative_to(package)) not in OF_EXTRAS.get(module, ())
    }
    foreign = imported - set(sys.stdlib_module_names) - {"swarmctl", "swarm_onboard"}
    owners = packages_distributions()
    assert {
        module for module in foreign if not names & {canonical(one) for one in owners.get(module, [])}
    } == set()


def canonical(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def imports(file: Path) -> set[str]:
    """The top-level modules that a source file imports by absolute name."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            found.add(node.module.split(".")[0])
    return found
