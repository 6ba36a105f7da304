"""Logins with Kerberos: a real KDC, a real sshd, and tickets of a realm that ends with the test."""

from __future__ import annotations

import shutil
import socket
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

from swarmctl.remote.either_ssh import EitherSsh
from swarmctl.remote.identities import Keyring
from swarmctl.remote.transport import HostError, Kind
from tests.ports import free_port
from tests.remote import sshd as servers
from tests.remote.sshd import Sshd
from tests.timing import wait_for

TOOLS = ("ssh", "krb5kdc", "kdb5_util", "kadmin.local", "kinit", "kdestroy")
REALM = "SWARM.TEST"
PASSWORD = "pw4ann"
CLIENT = """\
[libdefaults]
  default_realm = {realm}
  dns_lookup_kdc = false
  dns_lookup_realm = false
  dns_canonicalize_hostname = false
  rdns = false
[realms]
  {realm} = {{
    kdc = 127.0.0.1:{port}
  }}
"""
SERVER = """\
[kdcdefaults]
  kdc_listen = 127.0.0.1:{port}
  kdc_tcp_listen = 127.0.0.1:{port}
[realms]
  {realm} = {{
    database_name = {folder}/db
    key_stash_file = {folder}/stash
    acl_file = {folder}/acl
  }}
[logging]
  kdc = FILE:{folder}/kdc.log
"""


def run(*command: str, text: str = "") -> None:
    done = subprocess.run(command, check=False, capture_output=True, text=True, input=text)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture
def realm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A realm with the user ``root`` and the host ``localhost``; its keytab is ``keytab`` in the folder."""
    if lacking := [one for one in TOOLS if not shutil.which(one)]:
        pytest.skip(f"needs {', '.join(lacking)} (apt install krb5-kdc krb5-admin-server krb5-user)")
    values = {"realm": REALM, "port": free_port(), "folder": tmp_path}
    (tmp_path / "krb5.conf").write_text(CLIENT.format(**values))
    (tmp_path / "kdc.conf").write_text(SERVER.format(**values))
    for name, value in {
        "KRB5_CONFIG": "krb5.conf", "KRB5_KDC_PROFILE": "kdc.conf", "KRB5CCNAME": "tickets",
    }.items():  # fmt: skip
        monkeypatch.setenv(name, str(tmp_path / value))
    run("kdb5_util", "create", "-s", "-r", REALM, "-P", "master")
    for query in (f"addprinc -pw {PASSWORD} root", "addprinc -randkey host/localhost",
                  f"ktadd -k {tmp_path}/keytab host/localhost"):  # fmt: skip
        run("kadmin.local", "-r", REALM, "-q", query)
    with subprocess.Popen(["krb5kdc", "-n", "-r", REALM], stderr=subprocess.DEVNULL) as kdc:
        _await_port(int(str(values["port"])))
        yield tmp_path
        kdc.terminate()


def _await_port(port: int) -> None:
    def answers() -> bool:
        with suppress(OSError), socket.create_connection(("127.0.0.1", port)):
            return True
        return False

    wait_for(answers)


@pytest.fixture
def host(realm: Path, spare: Path) -> Iterator[Sshd]:
    """A host that no key logs in to."""
    within = ("env", f"KRB5_KTNAME={realm}/keytab")
    extra = "GSSAPIAuthentication yes\nGSSAPIStrictAcceptorCheck no"
    with servers.running(spare, authorize=False, extra=extra, within=within) as running:
        yield running


def entered(host: Sshd, home: Path) -> bytes:
    """What a host prints to an operator whose ~/.ssh/config wants Kerberos."""
    (home / ".ssh").mkdir(exist_ok=True)
    (home / ".ssh/config").write_text("GSSAPIAuthentication yes\n")
    transport = EitherSsh(keyring=Keyring(home / ".ssh", use_agent=False))
    target = host.target(address="localhost", identities=(), ssh_only=("GSSAPIAuthentication",))
    with transport.connect(target) as session:
        return servers.run(session, "echo in").stdout


def test_a_ticket_logs_in_and_without_one_the_error_says_so(realm: Path, host: Sshd) -> None:
    run("kinit", "root", text=f"{PASSWORD}\n")
    assert entered(host, realm) == b"in\n"

    run("kdestroy")
    with pytest.raises(HostError) as caught:
        entered(host, realm)
    assert caught.value.kind is Kind.AUTH
    assert caught.value.message.startswith("there is no Kerberos ticket to log in to pi: No Kerberos cred")
    assert "kinit" in caught.value.hint
