"""Public host keys: their fingerprints are OpenSSH's, and no text crashes the parser."""

from __future__ import annotations

import subprocess
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from swarmctl.remote.host_keys import BadKeyError, fingerprint, parse_key
from tests.remote import sshd as servers

KEY = "ssh-ed25519 AAAAC3NzaC1lZDI1NTE5AAAAIKtD9YR1fVNbrHbYPbC6SH4ZeS2tY1uTPyL1nJD4rDVe"


@pytest.mark.parametrize("kind", ["ed25519", "ecdsa", "rsa"])
def test_fingerprints_are_those_of_openssh(tmp_path: Path, kind: str) -> None:
    if lacking := servers.missing():
        pytest.skip(f"needs {lacking}")
    key = servers.make_key(tmp_path / "key", kind)
    printed = subprocess.run(
        ["ssh-keygen", "-lf", tmp_path / "key.pub"], capture_output=True, text=True, check=True
    ).stdout
    assert fingerprint(key) == printed.split()[1]


@pytest.mark.parametrize(
    "text",
    ["", "ssh-ed25519", "ssh-ed25519 !!!", "ssh-ed25519 AAAA", "ssh-rsa " + KEY.split()[1], "ssh-rsa AAA"],
)
def test_a_text_that_is_not_a_key_is_rejected(text: str) -> None:
    with pytest.raises(BadKeyError):
        parse_key(text)


@given(st.text())
def test_no_text_is_a_crash(text: str) -> None:
    with suppress(BadKeyError):
        parse_key(text)
