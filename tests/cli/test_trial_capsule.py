"""What a trial's capsule has of its hosts and robots."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from swarmctl.capsule import folder as capsules
from swarmctl.cli import trial_capsule
from swarmctl.cli.trial import Trial
from swarmctl.deploy.robot_stop import RobotStop
from swarmctl.spec.experiment_model import Experiment
from swarmctl.swarm.resolve import resolve
from tests.deploy.test_host_systems import KNOWN, SPEC
from tests.loading import load_checked

HOSTS = [
    SimpleNamespace(name=name, address=f"192.0.2.{number}", release="") for number, name in enumerate("ab")
]


def test_without_criteria_nothing_is_needed_to_read_bags(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [one for one in sys.modules if one.startswith(("rosbags", "swarmctl.capsule.bag_"))]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "rosbags", None)
    trial = cast(Any, SimpleNamespace(began={}, start=1.0))
    assert trial_capsule.judged(tmp_path, Experiment(duration=5), trial) == []
    with pytest.raises(ModuleNotFoundError):
        importlib.import_module("swarmctl.capsule.bag_reader")


@pytest.mark.parametrize(("hashes", "serial"), [(False, "A1004xyz"), (True, "sha256:98057965c4da037a")])
def test_hosts_that_answered_have_their_systems(tmp_path: Path, serial: str, *, hashes: bool) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_text(SPEC + "experiments: {circle: {duration: 5}}\n")
    document, found = load_checked(spec)
    assert document is not None, found
    look: Any = SimpleNamespace(
        began=1.0, status=SimpleNamespace(hosts=HOSTS, to_json=lambda: {"healthy": True})
    )
    system = KNOWN._replace(
        packages={"joy": "1.15.1"}, ports={"koala": "/dev/ttyUSB0"}, firmware={"koala": "5"}
    )
    stops = [
        RobotStop(name, host, "stands", "wheels", 0.0, "", "") for name, host in (("koala", "b"), ("k3", "a"))
    ]
    trial = Trial(1, look, systems={"b": system}, stops=stops, ended=6.0)
    releases = SimpleNamespace(
        wanted=SimpleNamespace(swarm=resolve(document), document=document),
        where=SimpleNamespace(spec=SimpleNamespace(files=(spec,))), values={},
    )  # fmt: skip
    trial_capsule.write(tmp_path / "trial", trial, "circle", cast(Any, releases), hash_serials=hashes)
    index = capsules.read(tmp_path / "trial")
    a, b = index.hosts["a"], index.hosts["b"]
    assert (a.kernel, a.devices, b.kernel, b.model, b.packages) == (
        "",
        [],
        "6.1.0 #1",
        "Pi",
        {"joy": "1.15.1"},
    )
    assert [(one.serial, one.ports) for one in b.devices] == [(serial, ["/dev/ttyUSB0"])]
    koala, k3 = index.robots["koala"], index.robots["k3"]
    assert (koala.port, koala.firmware, k3.port, k3.firmware) == ("/dev/ttyUSB0", "5", "", "")
