"""``swarmctl render --sbom``: CycloneDX with every file of every release, and what hosts must have."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from hashlib import sha256
from pathlib import Path
from typing import Any

import pytest
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator

from swarmctl import __version__
from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.render.build_bundle import bundles
from swarmctl.views.sbom import cyclonedx
from tests import ROOT
from tests.loading import load_swarm

EXAMPLES = ("arduino-rover", "ros2-3-central")
IMAGE = "docker.io/library/ros@sha256:" + "5" * 64
SPEC = f"""\
version: 1
name: lab
mode: central
hub: laptop
security: filtered
hosts:
  gate: {{address: 192.168.77.1}}
  laptop: {{address: 192.168.77.10, install: {{apt: [htop]}}, via: gate}}
  pi: {{address: 192.168.77.11, workspaces: [/home/robot/ws], via: gate}}
robots:
  k3: {{type: khepera3, host: pi}}
links:
  - {{kind: wlan, name: lab, hosts: [laptop, pi]}}
  - {{kind: serial, host: pi, robot: k3, usb: {{serial: FTDI1234}}}}
programs:
  map: {{host: pi, package: gmapping, executable: slam_gmapping, install: {{pip: [numpy==1.24.4]}}}}
  web: {{host: pi, container: {{image: "{IMAGE}"}}}}
"""


def example(name: str) -> Path:
    return ROOT / "examples" / name / "swarm.yaml"


def document(spec: Path) -> dict[str, Any]:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    text = cyclonedx(swarm, bundles(swarm))
    assert JsonStrictValidator(SchemaVersion.V1_6).validate_str(text) is None
    made: dict[str, Any] = json.loads(text)
    assert made["specVersion"] == "1.6"
    return made


def parts(made: dict[str, Any], host: str) -> list[dict[str, Any]]:
    """The release of a host, and what it depends on."""
    by_ref = {one["bom-ref"]: one for one in made["components"]}
    assert len(by_ref) == len(made["components"])
    depends = {one["ref"]: one["dependsOn"] for one in made["dependencies"]}
    return [by_ref[ref] for ref in (f"release/{host}", *depends[f"release/{host}"])]


@pytest.fixture(scope="module")
def of_lab(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    spec = tmp_path_factory.mktemp("spec") / "swarm.yaml"
    spec.write_text(SPEC)
    return document(spec)


@pytest.mark.parametrize("name", EXAMPLES)
def test_it_is_valid_and_has_every_file(name: str) -> None:
    swarm, _ = load_swarm(example(name))
    assert swarm is not None
    made = document(example(name))
    for host, bundle in bundles(swarm).items():
        found = [file for part in parts(made, host) for file in part.get("components", ())]
        assert {file["name"]: file["hashes"][0]["content"] for file in found} == {
            file.path: sha256(file.content).hexdigest() for file in bundle.files
        }
        assert len(found) == len(bundle.files)
        release = parts(made, host)[0]
        assert release["version"] == bundle.digest
        assert release["hashes"][0]["content"] == sha256(bundle.manifest_bytes).hexdigest()


def test_the_swarm_has_the_digests_of_its_releases() -> None:
    swarm, _ = load_swarm(example(EXAMPLES[1]))
    assert swarm is not None
    made = document(example(EXAMPLES[1]))
    subject = made["metadata"]["component"]
    assert subject["name"] == swarm.name
    assert {one["name"]: one["value"] for one in subject["properties"]} == {
        f"swarmctl:release:{host}": bundle.digest for host, bundle in bundles(swarm).items()
    }
    (depends,) = (one["dependsOn"] for one in made["dependencies"] if one["ref"] == subject["bom-ref"])
    assert depends[1:] == [f"release/{host}" for host in swarm.hosts]


def test_programs_firmware_and_packages_have_versions() -> None:
    rover = {one["name"]: one for one in document(example("arduino-rover"))["components"]}
    assert (rover["drivers"]["type"], rover["drivers"]["version"]) == ("application", __version__)
    assert rover["rover"]["type"] == "firmware"
    assert f'"{rover["rover"]["version"]}"'.encode() in _version_h()
    fleet = {one["name"]: one for one in document(example("lab-fleet"))["components"]}
    assert (fleet["fleet_moves"]["type"], fleet["fleet_moves"]["version"]) == ("library", "1.0.0")


def _version_h() -> bytes:
    swarm, _ = load_swarm(example("arduino-rover"))
    assert swarm is not None
    (bundle,) = bundles(swarm).values()
    return next(one.content for one in bundle.files if one.path == "firmware/rover/version.h")


def test_what_a_host_must_have(of_lab: dict[str, Any]) -> None:
    found = {one["bom-ref"].partition("@")[0]: one for one in parts(of_lab, "pi")}
    firewall = found["needs/nft"]["properties"]
    assert firewall == [{"name": "swarmctl:debian-package", "value": "nftables"}]
    ros = [one["value"] for one in found["needs/gmapping"]["properties"]]
    assert "ros-noetic-gmapping" in ros
    assert found["ros/noetic"]["type"] == "platform"
    assert found["workspace//home/robot/ws"]["name"] == "/home/robot/ws"
    assert found["pkg:pypi/numpy"]["purl"] == "pkg:pypi/numpy@1.24.4"
    image = found["image/docker.io/library/ros"]
    assert (image["type"], image["name"]) == ("container", "docker.io/library/ros")
    assert f"{image['name']}@{image['version']}" == IMAGE
    assert image["purl"].startswith("pkg:oci/ros@sha256%3A5555")
    assert "needs/htop" in [one["bom-ref"].partition("@")[0] for one in parts(of_lab, "laptop")]


def test_a_host_that_runs_nothing_has_an_empty_release(of_lab: dict[str, Any]) -> None:
    (release, *needs) = parts(of_lab, "gate")
    assert "components" not in release
    assert needs == []


def test_the_same_bytes_in_every_process(tmp_path: Path) -> None:
    made = []
    for seed in ("1", "2"):
        file = tmp_path / f"{seed}.json"
        words = ["render", str(example("ros1-and-ros2")), "--out", str(tmp_path / seed), "--sbom", str(file)]
        environment = {**os.environ, "PYTHONHASHSEED": seed}
        subprocess.run(
            [sys.executable, "-m", "swarmctl", *words], env=environment, check=True, capture_output=True
        )
        made.append(file.read_bytes())
    assert made[0] == made[1]
    serials = {document(example(name))["serialNumber"] for name in EXAMPLES}
    assert len({json.loads(made[0])["serialNumber"], *serials}) == 3


def test_only_the_hosts_that_are_written(tmp_path: Path) -> None:
    file = tmp_path / "sbom.json"
    spec = str(example("ros1-and-ros2"))
    words = ["render", spec, "--out", str(tmp_path / "out"), "--host", "tb3-pi", "--sbom", str(file)]
    assert run(words) == exit_codes.OK
    releases = [one["bom-ref"] for one in json.loads(file.read_text())["components"]]
    assert [one for one in releases if one.startswith("release/")] == ["release/tb3-pi"]


def test_it_is_no_file_among_the_releases(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ["render", str(example("ros1-and-ros2")), "--out", str(out), "--sbom", str(out / "sbom.json")]
    assert run(words) == exit_codes.ERROR
    assert "choose a FILE beside it" in capsys.readouterr().err
    assert not out.exists()
