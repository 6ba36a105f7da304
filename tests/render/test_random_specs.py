"""No valid spec ends in a bug: random ones are rendered, and each file is read by its reader.

``SWARMCTL_SPECS`` is how many; `make test-all` has 20 000.
"""

from __future__ import annotations

import ast
import json
import os
import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import pytest
import yaml

from swarmctl.diagnostics import has_errors
from swarmctl.lab.hosts import processes
from swarmctl.render.build_bundle import bundles
from tests.loading import load_swarm
from tests.render.dds_security.build import CYCLONE_DDS, program
from tests.render.dds_security.participant import UNSECURED
from tests.render.random_specs import Data, spec_of

SPECS = int(os.environ.get("SWARMCTL_SPECS", "500"))
AT_ONCE = 50
XSD = "opt/ros/jazzy/share/fastRTPS_profiles.xsd"
TARGETS = ("sysinit", "basic", "shutdown", "multi-user")
PROGRAM = re.compile(rb"^Exec\w+=[-+!@]*/((?:usr|bin|sbin)/\S+)", re.MULTILINE)


class Written(NamedTuple):
    """A file of a host, by the seed of its spec."""

    seed: int
    host: str
    path: str
    content: bytes

    @property
    def name(self) -> str:
        return f"seed {self.seed}, {self.host}: {self.path}"


def rendered(seeds: range, folder: Path) -> Iterator[Written]:
    """Yields what the hosts of all valid specs get; each swarm has a name of its own."""
    spec = folder / "swarm.yaml"

    def is_valid(data: Data) -> bool:
        spec.write_text(json.dumps(data, ensure_ascii=False), "utf-8")
        return not has_errors(load_swarm(spec)[1])

    for seed in seeds:
        data = spec_of(seed, is_valid)
        if data is None:
            continue
        data["name"] = f"swarm{seed}"
        spec.write_text(json.dumps(data, ensure_ascii=False), "utf-8")
        swarm, _ = load_swarm(spec)
        assert swarm is not None
        for host, bundle in bundles(swarm).items():
            for file in bundle.files:
                yield Written(seed, host, file.path, file.content)


@pytest.mark.parametrize("first", range(0, SPECS, AT_ONCE))
def test_each_file_is_read_by_its_reader(first: int, tmp_path: Path) -> None:
    files = list(rendered(range(first, first + AT_ONCE), tmp_path))
    assert len({one.seed for one in files}) > AT_ONCE // 2
    assert [*_unread(files), *_refused_by_bash(files)] == []
    assert _output_of_systemd(files, tmp_path) == ""
    assert _output_of_nft(files, tmp_path) == ""
    assert [*_refused_by_cyclone_dds(files, tmp_path)] == []
    assert _complaints_of_udev(files, tmp_path) == []


def _unread(files: list[Written]) -> Iterator[str]:
    """The files that are not what their names say."""
    readers: Mapping[str, Any] = {
        ".xml": ET.fromstring, ".launch": ET.fromstring, ".urdf": ET.fromstring, ".json": json.loads,
        ".py": ast.parse, ".yaml": yaml.safe_load, ".rviz": yaml.safe_load,
    }  # fmt: skip
    for content, one in {file.content: file for file in files}.items():
        read = readers.get(Path(one.path).suffix)
        try:
            if read is not None:
                read(content)
        except (ValueError, SyntaxError, yaml.YAMLError) as error:
            yield f"{one.name}: {error}"


def _refused_by_bash(files: list[Written]) -> Iterator[str]:
    for content, one in {file.content: file for file in files}.items():
        if one.path.endswith((".bash", ".env")) or content.startswith((b"#!/bin/sh", b"#!/bin/bash")):
            done = subprocess.run(["bash", "-n"], input=content, capture_output=True, check=False)
            if done.returncode or done.stderr:
                yield f"{one.name}: {done.stderr.decode()}"


def _output_of_systemd(files: list[Written], root: Path) -> str:
    """The messages of systemd about the units of all hosts, which get names of their own for it."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("needs systemd-analyze")
    folder = root / "etc/systemd/system"
    folder.mkdir(parents=True)
    for name in TARGETS:
        (folder / f"{name}.target").write_text("[Unit]\nDefaultDependencies=no\n")
    (folder / "bluetooth.service").write_text("[Service]\nExecStart=/usr/bin/python3\n")
    names = []
    for one in files:
        swarm, own = f"swarm{one.seed}".encode(), f"swarm{one.seed}{one.host}".encode()
        path = root / "opt/swarm" / own.decode() / "current" / one.path
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(one.content.replace(swarm, own))
        path.chmod(0o755)
        if one.path.startswith("units/"):
            names.append(Path(one.path).name.replace(swarm.decode(), own.decode()))
            (folder / names[-1]).write_bytes(path.read_bytes())
            for program in PROGRAM.findall(one.content):
                (root / program.decode()).parent.mkdir(parents=True, exist_ok=True)
                (root / program.decode()).touch(0o755)
    command = ["systemd-analyze", "verify", "--man=no", f"--root={root}", *names]
    ran = subprocess.run(command, capture_output=True, text=True, check=False)
    lines = (ran.stdout + ran.stderr).splitlines()
    return "\n".join(one for one in lines if not one.startswith("Accepting user/group name"))


def _output_of_nft(files: list[Written], folder: Path) -> str:
    """The messages of nft about the firewalls, on a machine with the accounts that they name."""
    if os.geteuid() != 0 or shutil.which("nft", path=processes.SEARCH_PATH) is None:
        pytest.skip("needs root and nft")
    tables = (one for one in files if one.path == "firewall.nft")
    texts = [one.content.decode().replace(f"swarm{one.seed}", f"swarm{one.seed}{one.host}") for one in tables]
    given = "\n".join(["define ephemeral = 32768-60999", *texts])
    accounts = {"root", *re.findall(r"skuid[^{]*\{ [^}]*\}", given)}
    names = sorted({name for one in accounts for name in re.findall(r'"([^"]*)"', one)} - {"root"})
    lines = ["root:x:0:0::/:/bin/sh", *(f"{one}:x:{n}:{n}::/:/bin/sh" for n, one in enumerate(names, 1000))]
    (folder / "passwd").write_text("\n".join(lines) + "\n")
    checked = f"mount --bind {folder}/passwd /etc/passwd && nft -c -f -"
    done = subprocess.run(
        ["unshare", "--net", "--mount", "sh", "-c", checked],
        input=given, env=processes.environment(), capture_output=True, text=True, check=False,
    )  # fmt: skip
    return done.stdout + done.stderr


def _refused_by_cyclone_dds(files: list[Written], folder: Path) -> Iterator[str]:
    """What it reports about its settings; none of their addresses is of the network in which it runs."""
    place = folder / "cyclonedds.xml"
    for content, one in {file.content: file for file in files if file.path.endswith(place.name)}.items():
        place.write_bytes(content)
        done = subprocess.run(
            ["unshare", "--net", program(CYCLONE_DDS), "0", UNSECURED], env={"CYCLONEDDS_URI": f"file://{place}"},
            stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False,
        )  # fmt: skip
        if "failed to find interfaces" not in done.stderr:
            yield f"{one.name}: {done.stderr}"


def _complaints_of_udev(files: list[Written], folder: Path) -> list[str]:
    """The messages of udev about the rules, which it reads for any device."""
    if os.geteuid() != 0 or shutil.which("udevadm") is None:
        pytest.skip("needs root and udevadm")
    rules = folder / "rules.d"
    rules.mkdir()
    for one in files:
        if one.path.startswith("udev/"):
            (rules / f"{Path(one.path).stem}-{one.seed}-{one.host}.rules").write_bytes(one.content)
    assert [*rules.iterdir()] != []
    look = f"mount --bind {rules} /etc/udev/rules.d && udevadm test /sys/devices/virtual/net/lo"
    done = subprocess.run(
        ["unshare", "--mount", "sh", "-c", look], capture_output=True, text=True, check=True
    )
    lines = (done.stdout + done.stderr).splitlines()
    return [one for one in lines if one.startswith("/etc/udev/rules.d/")]
