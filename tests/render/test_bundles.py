"""Bundles: the exact bytes of the example, the same every time, and only what must change changes."""

from __future__ import annotations

import json
import os
import shlex
import shutil
import subprocess
import sys
import xml.etree.ElementTree as ET
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml

from swarmctl.render import host_os
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.quoting import render
from tests import ROOT
from tests.loading import load_swarm

GOLDEN = Path(__file__).parent / "golden"
SPEC = ROOT / "examples/paper-leader/swarm.yaml"
SHIPPED = "drivers/"  # the driver's own files: golden by name, not by content


def bundles_of(text: str, folder: Path) -> Mapping[str, Bundle]:
    spec = folder / "swarm.yaml"
    spec.write_text(text, "utf-8")
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)


@pytest.fixture(scope="module")
def rendered(tmp_path_factory: pytest.TempPathFactory) -> Mapping[str, Bundle]:
    return bundles_of(SPEC.read_text("utf-8"), tmp_path_factory.mktemp("spec"))


@pytest.mark.parametrize("host", ["koala-laptop", "k3-pi", "epuck-pi"])
def test_golden(
    host: str, rendered: Mapping[str, Bundle], golden: Callable[[Path, str], None], regenerating: bool
) -> None:
    bundle, folder = rendered[host], GOLDEN / "paper-leader" / host
    own = [file for file in bundle.files if not file.path.startswith(SHIPPED)]
    if regenerating:
        shutil.rmtree(folder, ignore_errors=True)
    for file in own:
        golden(folder / file.path, file.content.decode())
    names = [f"{file.mode:o} {file.path}" for file in bundle.files]
    golden(folder / "FILES", "\n".join(names) + "\n")
    needs = {
        unit.name: [path for path in unit.needs if not path.startswith(SHIPPED)] for unit in bundle.units
    }
    golden(
        folder / "UNITS",
        "".join(f"{name}: {' '.join(paths)}".rstrip() + "\n" for name, paths in needs.items()),
    )
    outside = {**bundle.links, **{path: f"{source} (block)" for path, source in bundle.blocks.items()}}
    golden(folder / "OUTSIDE", "".join(f"{path} <- {source}\n" for path, source in outside.items()))
    expected = {file.path for file in own} | {"FILES", "UNITS", "OUTSIDE"}
    assert {str(one.relative_to(folder)) for one in folder.rglob("*") if one.is_file()} == expected


def test_two_processes_render_the_same_bytes() -> None:
    code = (
        "import sys, pathlib\n"
        "from swarmctl.linter.runner import check_files\n"
        "from swarmctl.render.build_bundle import bundles; from swarmctl.swarm.resolve import resolve\n"
        "swarm = resolve(check_files(pathlib.Path(sys.argv[1]))[0])\n"
        "print({name: bundle.digest for name, bundle in bundles(swarm).items()})"
    )
    digests = {
        subprocess.run(
            [sys.executable, "-c", code, str(SPEC)],
            env={**os.environ, "PYTHONHASHSEED": seed, "TZ": zone, "LC_ALL": "C"},
            cwd=cwd, capture_output=True, text=True, check=True,
        ).stdout
        for seed, zone, cwd in (("1", "UTC", "/"), ("2", "Asia/Tokyo", "/tmp"))
    }  # fmt: skip
    assert len(digests) == 1


def test_the_order_of_entries_changes_no_other_file(rendered: Mapping[str, Bundle], tmp_path: Path) -> None:
    lines = SPEC.read_text("utf-8").splitlines()
    start = lines.index("robots:") + 1
    lines[start : start + 3] = reversed(lines[start : start + 3])
    other = bundles_of("\n".join(lines) + "\n", tmp_path)
    assert {name: one.digest for name, one in other.items()} == {
        name: one.digest for name, one in rendered.items()
    }


def test_one_robots_setting_changes_its_parameters_and_one_unit(
    rendered: Mapping[str, Bundle], tmp_path: Path
) -> None:
    text = SPEC.read_text("utf-8").replace("host: k3-pi}", "host: k3-pi, settings: {rates: {odom: 20}}}", 1)
    changed = bundles_of(text, tmp_path)
    files, units = set(), set()
    for host, bundle in rendered.items():
        before, after = bundle.manifest, changed[host].manifest
        assert before["files"].keys() == after["files"].keys()
        files |= {(host, path) for path in before["files"] if before["files"][path] != after["files"][path]}
        units |= {
            (host, one["name"])
            for one, other in zip(before["units"], after["units"], strict=True)
            if one != other
        }
    assert files == {("k3-pi", "params/k3.yaml")}
    assert units == {("k3-pi", "swarm-newswarm.k3.service")}


def test_parameters_have_the_values_of_the_spec(rendered: Mapping[str, Bundle]) -> None:
    files = {file.path: file.content for file in rendered["koala-laptop"].files}
    params = yaml.safe_load(files["params/koala.yaml"])
    assert params["port"] == "/dev/swarm/koala"
    assert params["serial"]["baud"] == 115200
    assert params["namespace"] == "/koala"
    assert params["command_timeout"] == 0.5


def test_only_the_hub_runs_a_master_and_all_name_it_alike(rendered: Mapping[str, Bundle]) -> None:
    masters = [
        host for host, bundle in rendered.items() if any(".master." in unit.name for unit in bundle.units)
    ]
    uris = {
        line
        for bundle in rendered.values()
        for file in bundle.files
        if file.path == "env/ros.env"
        for line in file.content.decode().splitlines()
        if line.startswith("ROS_MASTER_URI=")
    }
    assert masters == ["koala-laptop"]
    assert uris == {'ROS_MASTER_URI="http://192.168.77.10:11311"'}


def test_every_need_and_every_link_is_a_file_of_the_bundle(rendered: Mapping[str, Bundle]) -> None:
    for bundle in rendered.values():
        paths = {file.path for file in bundle.files}
        assert len(paths) == len(bundle.files)
        assert {path for unit in bundle.units for path in unit.needs} <= paths
        assert set(bundle.links.values()) | set(bundle.blocks.values()) <= paths


def test_launch_files_are_xml_and_name_files_that_are_there(rendered: Mapping[str, Bundle]) -> None:
    for bundle in rendered.values():
        home = f"{bundle.home}/current"
        paths = {file.path for file in bundle.files}
        for file in bundle.files:
            if file.path.endswith(".launch"):
                for one in ET.fromstring(file.content).iter():
                    words = " ".join(one.get(key, "") for key in ("file", "args", "command"))
                    named = shlex.split(words.replace("$(dirname)/..", home))
                    for path in {word for word in named if "/" in word}:
                        assert path.removeprefix(f"{home}/") in paths


def test_no_unit_waits_for_network_online(rendered: Mapping[str, Bundle]) -> None:
    """wait-online takes two minutes and fails where a robot boots off its wlan (robot_upstart#67, #93)."""
    for bundle in rendered.values():
        assert [file.path for file in bundle.files if b"network-online" in file.content] == []


def test_drivers_and_masters_start_again_however_they_end(rendered: Mapping[str, Bundle]) -> None:
    """Also with exit code 0, and however often; the delay is not that of a start by hand."""
    for bundle in rendered.values():
        texts = {Path(file.path).name: file.content.decode() for file in bundle.files}
        for unit in bundle.units:
            if unit.name.endswith(("wlan.service", "pair.service", "rfcomm.service", ".target")):
                continue
            lines = texts[unit.name].splitlines()
            assert {"Restart=always", "StartLimitIntervalSec=0"} <= set(lines), unit.name
            assert any(one.startswith("ExecStartPre=+") and "/restart-delay %n " in one for one in lines)
            assert "bin/restart-delay" in unit.needs


def test_a_driver_is_ordered_after_its_line_alone(rendered: Mapping[str, Bundle]) -> None:
    """It watches over the robot before there is a master, however long that one waits for its network."""
    for bundle in rendered.values():
        texts = {file.path: file.content.decode() for file in bundle.files}
        for unit in bundle.units:
            if unit.robot:
                lines = texts[f"units/{unit.name}"].splitlines()
                after = [line for line in lines if line.startswith("After=")]
                assert after in ([], [f"After={unit.name.replace('.service', '.rfcomm.service')}"])


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
@pytest.mark.parametrize("host", ["koala-laptop", "k3-pi", "epuck-pi"])
def test_systemd_finds_nothing_wrong_with_the_units(
    host: str, rendered: Mapping[str, Bundle], tmp_path: Path
) -> None:
    bundle, units = rendered[host], tmp_path / "etc/systemd/system"
    release = tmp_path / bundle.home[1:] / "current"
    for file in bundle.files:
        (release / file.path).parent.mkdir(parents=True, exist_ok=True)
        (release / file.path).write_bytes(file.content)
        (release / file.path).chmod(file.mode)
    (tmp_path / "usr/bin").mkdir(parents=True)
    for program in ("python3", "rfcomm"):
        (tmp_path / "usr/bin" / program).touch(0o755)
    shutil.copytree(release / "units", units)
    for name in ("sysinit", "basic", "shutdown", "multi-user"):
        (units / f"{name}.target").write_text("[Unit]\nDefaultDependencies=no\n")
    (units / "bluetooth.service").write_text("[Service]\nExecStart=/usr/bin/python3\n")
    names = [unit.name for unit in bundle.units]
    ran = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", f"--root={tmp_path}", *names],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (ran.returncode, ran.stdout + ran.stderr) == (0, "")


def test_the_timer_of_no_other_chip_than_ftdis_is_set(rendered: Mapping[str, Bundle]) -> None:
    rules = [file.content.decode() for file in rendered["k3-pi"].files if file.path.startswith("udev/60-")]
    lines = [line for text in rules for line in text.splitlines() if "ATTR{latency_timer}" in line]
    assert [('DRIVER=="ftdi_sio"' in line, 'ATTRS{serial}=="FTDI1234"' in line) for line in lines] == [
        (True, True)
    ]


def test_the_manifest_is_json_with_the_digest_of_every_file(rendered: Mapping[str, Bundle]) -> None:
    for bundle in rendered.values():
        manifest = json.loads(bundle.manifest_bytes)
        assert {path: one["sha256"] for path, one in manifest["files"].items()} == {
            file.path: file.digest for file in bundle.files
        }


def test_what_all_hosts_share_is_made_once(monkeypatch: pytest.MonkeyPatch) -> None:
    swarm, _ = load_swarm(SPEC)
    assert swarm is not None
    made: list[str] = []

    def counted(template: str, **values: Any) -> bytes:
        made.append(template)
        return render(template, **values)

    monkeypatch.setattr(host_os, "render", counted)
    made_for = bundles(swarm)
    assert len(made_for) == 3
    assert made.count("block.hosts") == 1
