"""``swarmctl run --replay``: the spec of a capsule is deployed only if it gives the same releases."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest

from swarmctl.capsule.folder import write
from swarmctl.cli import exit_codes, trial_release
from swarmctl.cli.trial import TrialError
from swarmctl.cli.trial_hosts import TrialHosts
from swarmctl.cli.where import Where
from swarmctl.remote.known_hosts import path_beside
from swarmctl.render.build_bundle import bundles
from swarmctl.version import __version__
from tests.capsule.trial_folder import ABOUT
from tests.in_process import swarmctl
from tests.loading import load_swarm
from tests.ros_packages.packages import manifest

EXPERIMENT = """
programs:
  square: {host: koala-laptop, package: moves, executable: square.py, params: {speed: 0.1}}
experiments:
  squares: {duration: 5, programs: [square], parameters: {square: {speed: [0.1, 0.2]}}}
"""
FASTER = '{"programs": {"square": {"params": {"speed": 0.2}}}}'


@pytest.fixture
def capsule(leader_spec: Path, tmp_path: Path) -> Path:
    """That of a trial with another speed, whose spec is there no longer."""
    folder = tmp_path / "capsule"
    (folder / "spec").mkdir(parents=True)
    files = folder / "spec/swarm.yaml", folder / "spec/1-parameters.yaml"
    for file, text in zip(files, (leader_spec.read_text("utf-8") + EXPERIMENT, FASTER), strict=True):
        file.write_text(text, "utf-8")
    with_index(folder)
    return folder


def with_index(folder: Path) -> None:
    swarm, found = load_swarm(*(folder / one for one in about({})["spec"]))
    assert swarm is not None, found
    made = bundles(swarm)
    write(folder, about({name: {"release": one.digest, "began": None} for name, one in made.items()}))


def about(hosts: dict[str, Any], version: str = __version__) -> dict[str, Any]:
    return ABOUT | {
        "swarm": "newswarm",
        "experiment": "squares",
        "trial": 2,
        "parameters": {"square": {"speed": 0.2}},
        "spec": ["spec/swarm.yaml", "spec/1-parameters.yaml"],
        "hosts": hosts,
        "swarmctl": version,
    }


@pytest.fixture
def operators(leader_spec: Path, tmp_path: Path) -> Path:
    """A spec of the same hosts, with their pinned keys."""
    file = tmp_path / "own/swarm.yaml"
    file.parent.mkdir()
    shutil.copy(leader_spec, file)
    path_beside(file).write_text("# pinned\n", "utf-8")
    return file


def test_the_spec_of_the_capsule_is_deployed_and_its_trial_begins(
    capsule: Path, operators: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    seen: list[object] = []

    def deploy(where: Where, wanted: object) -> None:
        texts = [one.read_text("utf-8") for one in where.spec.files]
        seen.extend((texts, path_beside(where.spec.first).read_text("utf-8")))

    def begin(_: TrialHosts, number: int, bags: Path) -> None:
        seen.append(number)
        raise TrialError("enough")

    monkeypatch.setattr(trial_release, "deploy", deploy)
    monkeypatch.setattr(TrialHosts, "stand", lambda _: seen.append("stand"))
    monkeypatch.setattr(TrialHosts, "run", begin)
    ran = swarmctl("run", str(operators), "--replay", str(capsule), "--out", str(tmp_path / "out"))
    assert "trial 2 did not begin: enough" in ran.stderr, ran.stderr
    assert ran.returncode == exit_codes.UNHEALTHY
    files = (capsule / "spec/swarm.yaml", capsule / "spec/1-parameters.yaml")
    assert seen == ["stand", [one.read_text("utf-8") for one in files], "# pinned\n", 2]


@pytest.mark.parametrize("lost", [0o644, 0o755, 0o400])
def test_a_copy_without_modes_gives_the_same_releases(
    capsule: Path, operators: Path, monkeypatch: pytest.MonkeyPatch, lost: int
) -> None:
    def begin(_: TrialHosts) -> None:
        raise TrialError("enough")

    monkeypatch.setattr(TrialHosts, "stand", begin)
    with (capsule / "spec/swarm.yaml").open("a", encoding="utf-8") as file:
        file.write("packages: {moves: {from: ./moves}}\n")
    scripts = capsule / "spec/moves/scripts"
    scripts.mkdir(parents=True)
    (scripts.parent / "package.xml").write_text(manifest("moves"))
    (scripts / "square.py").write_text("#!/usr/bin/env python3\n")
    (scripts / "square.py").chmod(0o755)
    with_index(capsule)
    for one in (scripts / "square.py", scripts.parent / "package.xml"):
        one.chmod(lost)
    ran = swarmctl("run", str(operators), "--replay", str(capsule))
    assert "trial 2 did not begin: enough" in ran.stderr, ran.stderr


@pytest.mark.parametrize(
    ("version", "words"),
    [(__version__, "packages were built anew"), ("0.0.9", "in the capsule, which 0.0.9 has made: k3-pi")],
)
def test_other_releases_are_named_by_host(
    capsule: Path, operators: Path, version: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    changed: list[object] = []
    monkeypatch.setattr(trial_release, "deploy", lambda *_: changed.append(0))
    monkeypatch.setattr(TrialHosts, "stand", lambda _: changed.append(0))
    write(capsule, about({"k3-pi": {"release": "0" * 16, "began": None}}, version))
    ran = swarmctl("run", str(operators), "--replay", str(capsule))
    assert (ran.returncode, changed) == (exit_codes.ERROR, [])
    assert words in ran.stderr


def test_a_capsule_that_has_changed_is_refused(
    capsule: Path, operators: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(TrialHosts, "stand", lambda _: pytest.fail("it connects to hosts"))
    with (capsule / "spec/swarm.yaml").open("a", encoding="utf-8") as file:
        file.write("# more\n")
    ran = swarmctl("run", str(operators), "--replay", str(capsule))
    assert ran.returncode == exit_codes.ERROR
    assert "spec/swarm.yaml has changed" in ran.stderr
