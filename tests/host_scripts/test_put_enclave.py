"""`put-enclave`, and `ros-exec` with SROS 2, in a release whose files and credentials are as on a host."""

from __future__ import annotations

import os
import subprocess
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.sros2 import bundles_in, write_fake_keystore, write_spec

SHELLS = ("dash", "bash")
KEY = "the key of robots/k3\n"
#: What rcl reads of an enclave, with what is in it here, and its mode.
FILES = {
    "cert.pem": ("the certificate of /robots/k3\n", 0o600),
    "governance.p7s": (None, 0o600),
    "identity_ca.cert.pem": ("the authority\n", 0o600),
    "key.pem": (KEY, 0o400),
    "permissions.p7s": (None, 0o600),
    "permissions_ca.cert.pem": ("the authority\n", 0o600),
}
OF_PEOPLE = {
    "ROS_SECURITY_ENABLE": "true",
    "ROS_SECURITY_STRATEGY": "Enforce",
    "ROS_SECURITY_KEYSTORE": "/run/swarm-newswarm.enclaves",
    "ROS_SECURITY_ENCLAVE_OVERRIDE": "/hosts/k3-pi",
}
#: Root without the right to write what is read-only, as the accounts of units.
AS_ACCOUNT = ("setpriv", "--bounding-set=-all") if os.geteuid() == 0 else ()


@dataclass(frozen=True)
class Unit:
    """The driver of k3: its release, its credentials and its runtime folder."""

    shell: str
    release: Path
    credentials: Path
    runtime: Path

    def run(self, script: str, *words: str, **variables: str) -> subprocess.CompletedProcess[str]:
        """``variables`` come beside those of systemd and of `ros.env`; empty ones are left out."""
        given = {
            "PATH": "/usr/bin:/bin",
            "ROS_DISTRO": "nowhere",
            "RUNTIME_DIRECTORY": str(self.runtime),
            "CREDENTIALS_DIRECTORY": str(self.credentials),
            **OF_PEOPLE,
            **variables,
        }
        return subprocess.run(
            [*AS_ACCOUNT, self.shell, str(self.release / "bin" / script), *words],
            env={name: value for name, value in given.items() if value},
            capture_output=True, text=True, check=False,
        )  # fmt: skip

    def security(self, **variables: str) -> dict[str, str]:
        """The variables of SROS 2 of a program that `ros-exec` runs."""
        ran = self.run("ros-exec", "env", **variables)
        assert (ran.returncode, ran.stderr) == (0, "")
        found = dict(line.split("=", 1) for line in ran.stdout.splitlines())
        return {name: value for name, value in found.items() if name.startswith("ROS_SECURITY")}

    def put(self) -> dict[str, tuple[bytes, int]]:
        """Every file in the runtime folder, with its mode; no other account enters a folder."""
        found = [one for one in self.runtime.rglob("*") if one.is_file()]
        assert {one.stat().st_mode & 0o077 for one in self.runtime.rglob("*")} <= {0}
        return {
            str(one.relative_to(self.runtime)): (one.read_bytes(), one.stat().st_mode & 0o777)
            for one in found
        }


@pytest.fixture(params=SHELLS)
def unit(request: pytest.FixtureRequest, tmp_path: Path) -> Unit:
    made = Unit(request.param, *(tmp_path / name for name in ("release", "credentials", "runtime")))
    write_spec(tmp_path)
    write_fake_keystore(tmp_path)
    for file in bundles_in(tmp_path)["k3-pi"].files:
        if file.path.startswith(("enclaves/", "bin/")):
            (made.release / file.path).parent.mkdir(parents=True, exist_ok=True)
            (made.release / file.path).write_bytes(file.content)
            (made.release / file.path).chmod(file.mode)
    made.credentials.mkdir()
    made.runtime.mkdir()
    key = made.credentials / "robots-k3"
    key.write_text(KEY)
    key.chmod(
        0o440
    )  # of root, and an ACL lets the unit's account read it: systemd, src/core/exec-credential.c
    return made


def test_the_enclave_has_its_six_files_for_its_account_alone(unit: Unit) -> None:
    for _ in range(2):  # `ExecCondition=` runs it before `ExecStart=`
        ran = unit.run("put-enclave", "robots/k3")
        assert (ran.returncode, ran.stdout, ran.stderr) == (0, "", "")
        found = {path.removeprefix("enclaves/robots/k3/"): file for path, file in unit.put().items()}
        assert {name: mode for name, (_, mode) in found.items()} == {
            name: mode for name, (_, mode) in FILES.items()
        }
        assert all(text is None or found[name][0] == text.encode() for name, (text, _) in FILES.items())
    assert b"CN=/robots/k3" in found["permissions.p7s"][0]


def test_a_new_key_takes_the_place_of_the_old_one(unit: Unit) -> None:
    unit.run("put-enclave", "robots/k3")
    key = unit.credentials / "robots-k3"
    key.chmod(0o600)
    key.write_text("another\n")
    assert unit.run("put-enclave", "robots/k3").returncode == 0
    assert unit.put()["enclaves/robots/k3/key.pem"][0] == b"another\n"


def test_a_unit_runs_in_its_enclave(unit: Unit) -> None:
    """Whatever the setup files export."""
    workspace = unit.release.parent / "ws"
    workspace.mkdir()
    exported = " ".join(f"{name}=other" for name in OF_PEOPLE)
    (workspace / "setup.sh").write_text(f"export {exported}\n")
    assert unit.security(SWARM_ENCLAVE="robots/k3", SWARM_WORKSPACE=str(workspace)) == {
        **OF_PEOPLE,
        "ROS_SECURITY_KEYSTORE": str(unit.runtime),
        "ROS_SECURITY_ENCLAVE_OVERRIDE": "/robots/k3",
    }
    assert len(unit.put()) == len(FILES)


@pytest.mark.parametrize("enclave", ["", "robots/k3"])
def test_what_is_no_unit_runs_in_the_enclave_of_people(unit: Unit, enclave: str) -> None:
    assert unit.security(SWARM_ENCLAVE=enclave, CREDENTIALS_DIRECTORY="") == OF_PEOPLE
    assert unit.security(SWARM_ENCLAVE="") == OF_PEOPLE
    assert unit.put() == {}


def test_nothing_runs_without_its_key(unit: Unit) -> None:
    (unit.credentials / "robots-k3").unlink()
    ran = unit.run("ros-exec", "echo", "runs", SWARM_ENCLAVE="robots/k3")
    assert (ran.returncode, ran.stdout) == (1, "")
    assert "robots-k3" in ran.stderr


def test_one_missing_key_of_several_is_an_error(unit: Unit) -> None:
    (unit.credentials / "hosts-k3-pi").write_text("the key of hosts/k3-pi\n")
    assert unit.run("put-enclave", "robots/k3", "hosts/k3-pi").returncode == 0
    assert len(unit.put()) == 2 * len(FILES)
    (unit.credentials / "robots-k3").unlink()
    assert unit.run("put-enclave", "robots/k3", "hosts/k3-pi").returncode == 1
