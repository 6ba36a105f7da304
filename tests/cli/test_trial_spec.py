"""The files of a spec in a capsule: alone, they give the same releases; secrets are in none."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from swarmctl.cli.trial_spec import text_places, write
from swarmctl.render.build_bundle import bundles
from tests.conformance.user_robots import OWN
from tests.loading import load_checked, load_swarm
from tests.ros_packages.packages import manifest
from tests.rules.test_packages import write as write_files
from tests.sros2 import write_fake_keystore
from tests.sros2 import write_spec as write_sros2_spec

SPEC = """\
version: 1
name: lab
mode: central
hub: laptop
include: hosts.yaml
robots:
  bug: {type: beetle, host: pi, urdf: shapes/bug.urdf}
links:
  - {kind: wlan, name: lab, hosts: [laptop, pi]}
  - {kind: serial, host: pi, robot: bug, usb: {serial: FTDI1234}}
packages:
  nav: {from: ./src/nav}
  more: {from: ./workspace, all: true}
programs:
  map:
    host: pi
    package: nav
    executable: go.py
    params: {tuned: {file: tuned.yaml}}
    files: {map.png: maps/lab.png, made.txt: {template: made.txt.j2}}
  other: {host: laptop, package: helper, executable: help.py}
"""
FILES = {
    "swarm.yaml": SPEC,
    "hosts.yaml": "hosts:\n  laptop: {address: 192.168.77.10}\n  pi: {address: 192.168.77.11}\n",
    "robots/beetle.yaml": OWN.replace("reply_timeout: 1.0", "reply_timeout: 0.1"),
    "robots/beetle.py": "class BeetleCodec:\n"
    "    def __init__(self, options): pass\n"
    "    def speed(self, left, right): return b''\n"
    "    def query(self, name): return b''\n",
    "shapes/bug.urdf": '<robot name="it"><link name="base_link"/></robot>',
    "tuned.yaml": "gain: 2\n",
    "maps/lab.png": "\ufeffno text",
    "made.txt.j2": "{{ swarm }}\n",
    "src/nav/package.xml": manifest("nav"),
    "src/nav/scripts/go.py": "#!/usr/bin/env python3\n",
    "src/nav/config/go.yaml": "a: 1\n",
    "workspace/src/helper/package.xml": manifest("helper"),
    "workspace/src/helper/scripts/help.py": "#!/usr/bin/env python3\n",
    "secrets/token": "hush",
    "unused.txt": "no part of the spec",
}
KEY = "-----BEGIN OPENSSH PRIVATE KEY-----\nb3BlbnNzaC1rZXktdjEA\n"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "lab"
    write_files(folder, FILES)
    for script in ("src/nav/scripts/go.py", "workspace/src/helper/scripts/help.py"):
        (folder / script).chmod(0o755)
    return folder


def releases(*layers: Path) -> dict[str, str]:
    swarm, found = load_swarm(*layers)
    assert swarm is not None, found
    return {host: one.digest for host, one in bundles(swarm).items()}


def kept(capsule: Path, *layers: Path) -> list[str]:
    document, found = load_checked(*layers)
    assert document is not None, found
    return write(capsule, document, layers)


def there(folder: Path) -> set[str]:
    return {str(one.relative_to(folder)) for one in folder.rglob("*") if one.is_file()}


def test_the_files_in_a_capsule_give_the_same_releases(folder: Path, tmp_path: Path) -> None:
    over = tmp_path / "field/field.yaml"
    write_files(over.parent, {
        "field.yaml": "include: more.yaml\nhosts: {pi: {address: 192.168.77.12}}\n",
        "more.yaml": "hosts: {laptop: {address: 192.168.77.13}}\n",
    })  # fmt: skip
    before = releases(folder / "swarm.yaml", over)
    places = kept(tmp_path / "capsule", folder / "swarm.yaml", over)
    assert places == ["spec/swarm.yaml", "spec/1/field.yaml"]
    assert there(tmp_path / "capsule/spec") == {*FILES, "1/field.yaml", "1/more.yaml"} - {
        "secrets/token",
        "unused.txt",
    }
    shutil.move(tmp_path / "capsule", tmp_path / "elsewhere")
    for gone in (folder, over.parent):
        shutil.rmtree(gone)
    assert releases(*(tmp_path / "elsewhere" / one for one in places)) == before


def test_a_keystore_is_in_it_but_no_key(tmp_path: Path) -> None:
    lab = tmp_path / "lab"
    lab.mkdir()
    spec = write_sros2_spec(lab)
    write_fake_keystore(lab)
    write_files(lab, {"secrets/sros2-ca": KEY})
    before = releases(spec)
    (place,) = kept(tmp_path / "capsule", spec)
    shutil.rmtree(lab)
    assert releases(tmp_path / "capsule" / place) == before
    assert not [one for one in there(tmp_path) if KEY in (tmp_path / one).read_text("utf-8")]


def test_what_cannot_be_in_a_capsule_is_left_out_and_named(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_files(folder, {"src/nav/config/deploy": f"# mine\n{KEY}", "src/nav/a\nb": ""})
    spec = folder / "swarm.yaml"
    spec.write_text(SPEC.replace("maps/lab.png", "secrets/token"), "utf-8")
    kept(tmp_path / "capsule", spec)
    found = there(tmp_path / "capsule/spec")
    assert found == FILES.keys() - {"maps/lab.png", "secrets/token", "unused.txt"}
    assert capsys.readouterr().err == (
        "warning: the capsule is without secrets/token: a secret\n"
        "warning: the capsule is without src/nav/a\\x0ab: its name is not printable\n"
        "warning: the capsule is without src/nav/config/deploy: a secret\n"
    )


def test_files_above_the_spec_stay_in_the_capsule(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    inside = tmp_path / "lab/own"
    inside.mkdir(parents=True)
    monkeypatch.chdir(inside)
    layers = [Path("swarm.yaml"), Path("../field.yaml"), tmp_path / "field.yaml"]
    assert list(text_places(layers, [*map(str, layers), "robots/x.yaml"]).values()) == [
        "spec/swarm.yaml",
        "spec/1-field.yaml",
        "spec/2-field.yaml",
        "spec/robots/x.yaml",
    ]
