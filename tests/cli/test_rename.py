"""``rename``: shows or writes the files with another name, and takes along what this machine has by it."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from swarmctl.cli.app import run
from swarmctl.cli.verbs.rename import Kind
from swarmctl.deploy import build_store, journal
from swarmctl.remote import known_hosts
from swarmctl.swarm.renaming import KINDS
from tests import ROOT

KEY = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAI" + "A" * 42 + "E"
OTHER = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAI" + "A" * 42 + "I"
WIREGUARD = "A" * 43 + "="


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The current folder, with the paper's example in mode central."""
    shutil.copytree(ROOT / "examples/paper-3-central", tmp_path / "lab")
    monkeypatch.chdir(tmp_path / "lab")
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return tmp_path / "lab"


def swarm_name(folder: Path) -> str:
    return next(
        line.split()[1]
        for line in (folder / "swarm.yaml").read_text().split("\n")
        if line.startswith("name:")
    )


def test_each_kind_can_be_chosen() -> None:
    assert [one.value for one in Kind] == [*KINDS]


def test_the_verb_shows_the_edit_or_writes_it(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "swarm.yaml").read_text()
    (folder / "field.yaml").write_text("robots: {epuck: {optional: true}}\n")
    assert run(["rename", "epuck", "walker"]) == 0
    shown = capsys.readouterr()
    assert "+  walker: {type: epuck, host: epuck-pi}\n" in shown.out
    assert "swarm.yaml:76:26: still mentions `epuck`\n" in shown.err
    assert "field.yaml:1:10: still mentions `epuck`\n" in shown.err
    assert (folder / "swarm.yaml").read_text() == before
    assert run(["rename", "swarm.yaml", "-f", "field.yaml", "epuck", "walker", "--write"]) == 0
    assert "field.yaml:1" not in capsys.readouterr().err
    assert (folder / "field.yaml").read_text() == "robots: {walker: {optional: true}}\n"
    assert run(["validate", "swarm.yaml", "-f", "field.yaml"]) == 0
    assert run(["rename", "-f", "field.yaml", "swarm.yaml", "walker", "epuck", "--write"]) == 0
    assert (folder / "swarm.yaml").read_text() == before


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["k3", "koala"], "there is a robot `koala` already"),
        (["k3-pi", "K3"], "names are lower-case letters"),
        (["epukc", "k5"], "did you mean `epuck`?"),
        (["k3", "k3-pi-of-a-very-long-name-that-no"], "31 at most"),
    ],
)
def test_a_name_that_cannot_be_changed_writes_nothing(
    words: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = (folder / "swarm.yaml").read_text()
    assert run(["rename", *words, "--write"]) == 1
    assert message in capsys.readouterr().err
    assert (folder / "swarm.yaml").read_text() == before


def test_a_spec_that_would_have_errors_is_not_written(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = folder / "swarm.yaml"
    koala = "koala: {type: koala, host: koala-laptop"
    text = file.read_text().replace(koala, f"{koala}, namespace: walker")
    file.write_text(text.replace("koala/odom", "walker/odom"))
    before = file.read_text()
    assert run(["rename", "epuck", "walker", "--write"]) == 1
    assert "NAME012: " in capsys.readouterr().err
    assert file.read_text() == before


def test_what_this_machine_has_of_a_host_goes_along(folder: Path) -> None:
    name = swarm_name(folder)
    place = journal.folder(name)
    pins = folder / "swarm.known_hosts"
    pins.write_text(f"# pinned\nk3-pi,10.0.0.1 {KEY}\npi-3 {OTHER}\n@revoked k3-pi {OTHER}\n")
    (folder / f"{name}.wireguard").write_text(f"# of k3-pi\nk3-pi {WIREGUARD}\nepuck-pi {WIREGUARD}\n")
    journal.remember(place, "k3-pi", "0" * 16, {})
    journal.remember_failed(place, ["epuck-pi", "k3-pi"], lab=False)
    build_store.remember_platforms(name, "", {"k3-pi": "arm"}, ["k3-pi"])
    assert run(["rename", "k3-pi", "pi-3"]) == 0
    assert journal.left(place, ["pi-3"]) == ["k3-pi"]
    assert run(["rename", "k3-pi", "pi-3", "--write"]) == 0
    assert pins.read_text() == f"# pinned\npi-3,10.0.0.1 {KEY}\n@revoked pi-3 {OTHER}\n"
    assert known_hosts.read(pins).keys("pi-3", "10.9.9.9", 22) == (KEY,)
    assert (
        folder / f"{name}.wireguard"
    ).read_text() == f"# of k3-pi\npi-3 {WIREGUARD}\nepuck-pi {WIREGUARD}\n"
    assert journal.left(place, ["pi-3"]) == []
    assert journal.failed(place, lab=False) == ["epuck-pi", "pi-3"]
    assert json.loads((place / "pi-3.json").read_text())["digest"] == "0" * 16
    assert build_store.known_platforms(name, "") == {"pi-3": "arm"}


def test_a_robot_takes_no_pins_along(folder: Path) -> None:
    pins = folder / "swarm.known_hosts"
    pins.write_text(f"k3 {KEY}\n")
    assert run(["rename", "k3", "k7", "--write"]) == 0
    assert pins.read_text() == f"k3 {KEY}\n"


def test_no_host_gets_the_name_of_one_that_left(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    before = (folder / "swarm.yaml").read_text()
    journal.remember(journal.folder(swarm_name(folder)), "pi-3", "0" * 16, {})
    assert run(["rename", "k3-pi", "pi-3", "--write"]) == 1
    assert "swarmctl remove --orphans --limit pi-3" in capsys.readouterr().err
    assert (folder / "swarm.yaml").read_text() == before
