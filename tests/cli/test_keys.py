"""``swarmctl keys``: private keys for their owner alone, the rest for the repository, and nothing twice."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.deploy.secrets import variable
from swarmctl.deploy.sros2_keystore import new_key
from tests.sros2 import bundles_in, write_spec

Typed = Callable[..., str]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    write_spec(tmp_path)
    usual = os.umask(0o022)
    yield tmp_path
    os.umask(usual)


@pytest.fixture
def keys(capsys: pytest.CaptureFixture[str]) -> Typed:
    """Runs ``swarmctl keys SPEC``; returns what it prints."""

    def typed(spec: str = "swarm.yaml", code: int = exit_codes.OK) -> str:
        assert run(["keys", spec]) == code
        return "".join(capsys.readouterr())

    return typed


def modes(folder: Path) -> dict[str, set[int]]:
    """The modes of the folders and files of `secrets` and `keystore`."""
    return {
        f"{name} {kind}": {one.stat().st_mode & 0o777 for one in found}
        for name in ("secrets", "keystore")
        for kind, found in {
            "folders": [folder / name, *(one for one in (folder / name).rglob("*") if one.is_dir())],
            "files": [one for one in (folder / name).rglob("*") if one.is_file()],
        }.items()
    }


def written(folder: Path) -> dict[Path, tuple[int, int]]:
    """Every file, with what changes when it is written."""
    files = [one for one in folder.rglob("*") if one.is_file()]
    return {one: (one.stat().st_mtime_ns, one.stat().st_ino) for one in files}


def test_keys_are_their_owners_and_the_rest_anyones(folder: Path, keys: Typed) -> None:
    assert keys() == "wrote 9 keys to secrets, 18 files to keystore\n"
    assert modes(folder) == {
        "secrets folders": {0o700}, "secrets files": {0o600},
        "keystore folders": {0o755}, "keystore files": {0o644},
    }  # fmt: skip
    assert not any(b"PRIVATE" in one.read_bytes() for one in (folder / "keystore").rglob("*.*"))
    sent = {name for bundle in bundles_in(folder).values() for name in bundle.secrets}
    assert {one.name for one in (folder / "secrets").iterdir()} - sent == {"sros2-ca"}
    assert [bundle.unsigned for bundle in bundles_in(folder).values()] == [[], [], []]


def test_a_second_run_writes_nothing(folder: Path, keys: Typed) -> None:
    keys()
    before = written(folder)
    assert keys() == "wrote 0 keys to secrets, 0 files to keystore\n"
    assert written(folder) == before


def test_changed_permissions_are_signed_and_no_key_is_new(folder: Path, keys: Typed) -> None:
    keys()
    before = written(folder)
    write_spec(folder, ros="distro: jazzy, sros2: true, domain: 42")
    assert keys() == "wrote 0 keys to secrets, 8 files to keystore\n"
    changed = {one.name for one, state in written(folder).items() if before[one] != state}
    assert changed == {"swarm.yaml", "permissions.p7s"}


def test_a_spec_without_sros2_gets_no_keys(folder: Path, keys: Typed) -> None:
    write_spec(folder, ros="distro: jazzy")
    assert keys(code=exit_codes.ERROR) == (
        "error: the spec does not use SROS 2\n"
        "  help: write `ros: {sros2: true}` with a distribution of ROS 2\n"
    )
    assert [one.name for one in folder.iterdir()] == ["swarm.yaml"]


def test_no_key_is_written_where_a_folder_cannot_be(folder: Path, keys: Typed) -> None:
    (folder / "secrets").symlink_to("nowhere")
    assert keys(code=exit_codes.ERROR) == "error: cannot write secrets: File exists\n"
    (folder / "secrets").unlink()
    (folder / "keystore/enclaves/newswarm").mkdir(parents=True)
    (folder / "keystore/enclaves/newswarm/robots").symlink_to("nowhere")
    message = "error: cannot write keystore/enclaves/newswarm/robots: File exists\n"
    assert keys(code=exit_codes.ERROR) == message
    assert [one.name for one in folder.rglob("*") if one.is_file()] == ["swarm.yaml"]


def test_a_keystore_that_cannot_be_read_is_not_replaced(
    folder: Path, keys: Typed, tmp_path_factory: pytest.TempPathFactory
) -> None:
    keys()
    shared = tmp_path_factory.mktemp("shared") / "keystore"
    (folder / "keystore").rename(shared)
    (folder / "keystore").symlink_to(shared)
    before = written(shared)
    assert keys(code=exit_codes.ERROR) == (
        "error: keystore/public/ca.cert.pem lies outside the spec's folder\n"
        "  help: what cannot be read is not replaced\n"
    )
    assert written(shared) == before


def test_a_key_in_the_environment_is_one_that_is_here(
    folder: Path, keys: Typed, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("sros2-ca", "sros2-robots-k3"):
        monkeypatch.setenv(variable(name), new_key())
    assert keys() == "wrote 7 keys to secrets, 18 files to keystore\n"
    assert not (folder / "secrets/sros2-ca").exists()
    assert keys() == "wrote 0 keys to secrets, 0 files to keystore\n"
    monkeypatch.delenv(variable("sros2-ca"))
    assert keys(code=exit_codes.ERROR) == (
        "error: the private key of keystore/public/ca.cert.pem is not here\n"
        "  help: copy `secrets/sros2-ca` from who has made it; or remove `keystore`, "
        "for a new one and new certificates\n"
    )


def test_a_key_that_others_can_read_is_refused(folder: Path, keys: Typed) -> None:
    keys()
    (folder / "secrets/sros2-ca").chmod(0o644)
    assert keys(code=exit_codes.ERROR) == (
        "error: secrets/sros2-ca is readable for other users\n  help: chmod 600 secrets/sros2-ca\n"
    )


def test_two_swarms_in_one_folder_share_keys_and_their_authority(folder: Path, keys: Typed) -> None:
    keys()
    before = written(folder)
    text = (folder / "swarm.yaml").read_text("utf-8")
    (folder / "other.yaml").write_text(text.replace("name: newswarm", "name: other"), "utf-8")
    assert keys("other.yaml") == "wrote 0 keys to secrets, 16 files to keystore\n"
    assert keys() == keys("other.yaml") == "wrote 0 keys to secrets, 0 files to keystore\n"
    assert {one: state for one, state in written(folder).items() if one in before} == before
