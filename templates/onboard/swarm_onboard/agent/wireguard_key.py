"""The WireGuard key of a host in a swarm: below /etc/swarm, for root alone. No answer or message holds it."""

from __future__ import annotations

import os
import subprocess
from contextlib import suppress

from . import command, files
from .errors import FailedError, RefusedError
from .failpoint import passed
from .paths import KEPT
from .release_store import Home

_TIMEOUT = 10.0  # s


def path(home: Home) -> str:
    """Returns the file of the private key."""
    return home.outside(f"{KEPT}/{home.swarm}/wireguard.key")


def public(home: Home) -> str:
    """Returns the public key in base64; makes the private one if there is none.

    Raises ``RefusedError`` without wg, and ``FailedError`` for a damaged key, which stays as it is.
    """
    private = files.read(path(home))
    if private is None:
        private = _made(home)
    try:
        return _wg("pubkey", private).decode("ascii").strip()
    except FailedError as error:
        raise FailedError(
            f"{path(home)} has no key of WireGuard: {error.message}",
            "restore that file; or remove it, and `swarmctl trust` with --replace pins the new key",
        ) from error


def _made(home: Home) -> bytes:
    """Makes the key: whole on the disk, or not there. Returns that of another agent if it was first."""
    private = _wg("genkey", b"")
    folder = os.path.dirname(path(home))
    os.makedirs(folder, 0o755, exist_ok=True)
    new = f"{files.draft(path(home))}-{os.getpid()}"
    try:
        files.write_new(new, private, 0o600)
        files.sync(new)
        passed("key")
        with suppress(FileExistsError):
            os.link(new, path(home))
    finally:
        files.remove(new)
    for place in (folder, os.path.dirname(folder), os.path.dirname(os.path.dirname(folder))):
        files.sync(place)
    return files.read(path(home)) or private


def forget(home: Home) -> None:
    """Removes the key, and its folder if that is empty."""
    folder = os.path.dirname(path(home))
    with suppress(OSError):
        for name in os.listdir(folder):
            if "wireguard.key" in name:  # what a killed agent has left, too
                files.remove(f"{folder}/{name}")
        os.rmdir(folder)
        os.rmdir(home.outside(KEPT))


def _wg(verb: str, given: bytes) -> bytes:
    try:
        done = subprocess.run(
            ["wg", verb],
            input=given,
            capture_output=True,
            timeout=_TIMEOUT,
            check=False,
            env=command.plain_environment(),
        )
    except FileNotFoundError as error:
        raise RefusedError("no `wg`", "`swarmctl prepare` installs wireguard-tools") from error
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RefusedError(f"`wg {verb}` cannot run: {error}", "run the same command again") from error
    if done.returncode:
        raise FailedError(done.stderr.decode("utf-8", "replace").strip()[:200])
    return done.stdout
