"""The signature of an index, made and checked by ``ssh-keygen``: to sign needs an SSH key, nothing else."""

from __future__ import annotations

import os
import re
import subprocess
from pathlib import Path
from typing import NamedTuple

from swarmctl.capsule.capsule_index import SIGNATURE
from swarmctl.capsule.folder import index_bytes
from swarmctl.remote.answer_check import printable

_NAMESPACE = "swarmctl-capsule"
_PATIENCE = 60.0  # s; a key in a token waits for a finger
_SILENT = {"SSH_ASKPASS": "false", "SSH_ASKPASS_REQUIRE": "force"}  # nobody is there to type a passphrase
_FINGERPRINT = re.compile(r"\bSHA256:[A-Za-z0-9+/]{43}(?=\s|$)")


class Signer(NamedTuple):
    """Who signed: the fingerprint of a key, empty without a signature; ``problem``: why it does not fit."""

    fingerprint: str = ""
    problem: str = ""


def sign(folder: Path, key: Path) -> str:
    """Returns why the index was not signed; empty if it was. Raises ``CapsuleError`` without an index.

    ``key``: a private key without a passphrase, or the public one of a private key in an agent.
    """
    made, why = _ssh_keygen(index_bytes(folder), "sign", "-f", str(key))
    if why:
        return f"{key} did not sign it: {why}"
    try:
        (folder / SIGNATURE).unlink(missing_ok=True)  # it may be a link
        (folder / SIGNATURE).write_text(made, "utf-8")
    except OSError as error:
        return f"cannot write {folder / SIGNATURE}: {error.strerror}"
    return ""


def signer(folder: Path) -> Signer:
    """Returns who signed the index. Whose key it is, ssh-keygen does not know. Raises ``CapsuleError``."""
    file = folder / SIGNATURE
    if not file.is_symlink() and not file.exists():
        return Signer()
    if file.is_symlink() or not file.is_file():
        return Signer(problem=f"{SIGNATURE} is not a file")
    made, why = _ssh_keygen(index_bytes(folder), "check-novalidate", "-s", str(file))
    found = _FINGERPRINT.search(made)
    if why or not found:
        return Signer(problem=f"{SIGNATURE} does not fit {why and f'({why})'}".rstrip())
    return Signer(found[0])


def _ssh_keygen(data: bytes, action: str, *more: str) -> tuple[str, str]:
    """What ssh-keygen printed about ``data``, and why it failed."""
    try:
        ran = subprocess.run(
            ["ssh-keygen", "-Y", action, "-n", _NAMESPACE, *more],
            input=data,
            env={**os.environ, **_SILENT}, capture_output=True, check=False, timeout=_PATIENCE,
        )  # fmt: skip
    except subprocess.TimeoutExpired:
        return "", f"ssh-keygen did not end within {_PATIENCE:.0f} s"
    except OSError as error:
        return "", f"cannot run ssh-keygen: {error.strerror}"
    first = ran.stderr.strip().partition(b"\n")[0] or b"exit code %d" % ran.returncode
    why = printable(first.strip()) if ran.returncode else ""
    return ran.stdout.decode(errors="replace"), why
