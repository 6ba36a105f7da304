"""Parameters and files of programs in a release: lists, mappings, files beside the spec, templates."""

from __future__ import annotations

import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle, File, Unit
from tests.loading import load_swarm

FOLDER = Path(__file__).with_name("program_files")
GOLDEN = Path(__file__).parent / "golden/program_files"
RELEASE = "/opt/swarm/prog/current"


def bundle_of(spec: Path) -> Bundle:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return bundles(swarm)["laptop"]


@pytest.fixture(scope="module")
def bundle() -> Bundle:
    return bundle_of(FOLDER / "swarm.yaml")


@pytest.fixture(scope="module")
def files(bundle: Bundle) -> dict[str, File]:
    return {file.path: file for file in bundle.files}


def test_golden(files: dict[str, File], golden: Callable[[Path, str], None], regenerating: bool) -> None:
    if regenerating:
        shutil.rmtree(GOLDEN, ignore_errors=True)
    expected = {path: file for path, file in files.items() if file.origin.startswith("programs.")}
    for path, file in expected.items():
        golden(GOLDEN / path, file.content.decode())
    assert {str(one.relative_to(GOLDEN)) for one in GOLDEN.rglob("*") if one.is_file()} == set(expected)


def test_lists_and_mappings_keep_their_shape_and_types(files: dict[str, File]) -> None:
    assert yaml.safe_load(files["params/slam.yaml"].content) == {
        "rate": 5.0, "sizes": [1, 2.5, ["a", "007"]], "limits": {"low": {"x": -1}, "on": True}
    }  # fmt: skip


def test_only_what_names_a_package_is_substituted(files: dict[str, File]) -> None:
    loaded = {
        one.get("file", "").removeprefix(f"{RELEASE}/"): (one.get("ns"), one.get("subst_value"))
        for one in ET.fromstring(files["launch/slam.launch"].content).iter("rosparam")
    }
    assert loaded == {
        "params/slam.yaml": (None, None),
        "params/slam.find.yaml": (None, "true"),
        "params/slam/costs.yaml": ("costs", None),
    }
    assert set(yaml.safe_load(files["params/slam.find.yaml"].content)) == {"map", "maps"}


def test_a_file_of_parameters_is_delivered_as_it_is(files: dict[str, File]) -> None:
    content = (FOLDER / "config/costs.yaml").read_bytes()
    assert files["params/slam/costs.yaml"].content == content
    assert files["files/slam/more/costs.yaml"].content == content


def test_a_template_has_the_values_of_the_spec(files: dict[str, File]) -> None:
    assert files["files/slam/slam.conf"].content.decode() == (
        "# slam of prog\nhost = laptop 10.0.0.1\nmaster = http://10.0.0.1:11311\nname = /koala/slam koala\n"
        "peer = laptop 10.0.0.1\n"
    )


def test_a_program_finds_its_files(files: dict[str, File]) -> None:
    (node,) = ET.fromstring(files["launch/slam.launch"].content).iter("node")
    assert node.get("args") == f"--config={RELEASE}/files/slam/slam.conf '$(find slam)/rviz/slam.rviz'"
    variables = {
        one.get("name"): one.get("value")
        for one in ET.fromstring(files["launch/nav.launch"].content).iter("env")
    }
    assert variables == {"SWARM_FILES": f"{RELEASE}/files/nav"}
    see = files["units/swarm-prog.see.service"].content.decode()
    assert f"--volume {RELEASE}/files/see:{RELEASE}/files/see:ro" in see
    assert f"{RELEASE}/files/see/costs.yaml" in see


def test_a_unit_gets_its_secrets_by_name(bundle: Bundle, files: dict[str, File]) -> None:
    unit = files["units/swarm-prog.web.service"].content.decode()
    assert "--owner robot --source /etc/swarm/prog/secrets" in unit
    assert "--variable TOKEN=web-token --file key.pem=web-key" in unit
    assert "web --key /run/swarm-secrets/swarm-prog.web/key.pem" in unit
    assert bundle.secrets == ("web-key", "web-token")
    assert bundle.secret_forms == {"web-key": "text", "web-token": "line"}
    see = files["units/swarm-prog.see.service"].content.decode()
    assert "--owner root" in see
    assert "--env TOKEN docker.io" in see


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_systemd_accepts_every_unit(files: dict[str, File], tmp_path: Path) -> None:
    for path in ("bin/ros-exec", "bin/ros-client", "bin/restart-delay"):
        place = tmp_path / RELEASE[1:] / path
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_bytes(files[path].content)
        place.chmod(0o755)
    for tool in ("python3", "env", "rm"):
        place = tmp_path / "usr/bin" / tool
        place.parent.mkdir(parents=True, exist_ok=True)
        place.write_text("#!/bin/sh\n")
        place.chmod(0o755)
    units = [path for path in files if path.startswith("units/") and path.endswith(".service")]
    (tmp_path / "etc/systemd/system").mkdir(parents=True)
    for path in units:
        (tmp_path / "etc/systemd/system" / Path(path).name).write_bytes(files[path].content)
    names = [Path(path).name for path in units if "prog.web" in path or "prog.see" in path]
    command = ["systemd-analyze", "verify", "--man=no", f"--root={tmp_path}", *names]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    about = [line for line in done.stderr.splitlines() if "swarm-prog" in line and "not found" not in line]
    assert about == []


def test_a_changed_file_restarts_its_program_alone(tmp_path: Path, bundle: Bundle) -> None:
    shutil.copytree(FOLDER, tmp_path, dirs_exist_ok=True)
    (tmp_path / "config/slam.conf.j2").write_text("other\n")
    changed = {unit.name for unit in restarted(bundle, bundle_of(tmp_path / "swarm.yaml"))}
    assert changed == {"swarm-prog.slam.service"}


def restarted(before: Bundle, after: Bundle) -> list[Unit]:
    old, new = ({file.path: file.digest for file in one.files} for one in (before, after))
    return [unit for unit in after.units if any(old.get(one) != new[one] for one in unit.needs)]


def test_a_link_out_of_the_folder_is_no_file_of_the_spec(tmp_path: Path) -> None:
    inside = tmp_path / "lab"
    shutil.copytree(FOLDER, inside)
    (tmp_path / "passwords").write_text("secret: 1\n")
    (inside / "config/costs.yaml").unlink()
    (inside / "config/costs.yaml").symlink_to(tmp_path / "passwords")
    swarm, found = load_swarm(inside / "swarm.yaml")
    assert swarm is None
    assert {one.code for one in found} >= {"PROG028"}
    assert not any("secret" in one.message for one in found)
