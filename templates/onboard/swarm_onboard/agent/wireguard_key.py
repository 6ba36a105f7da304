"""The WireGuard key of a host in a swarm: below /etc/swarm, for root alone. No answer or message holds it."""

from __future__ import annotations

import os
import subprocess
import time
from contextlib import suppress

from swarm_onboard.tunnel import keys

from . import command, files, known_keys
from .errors import FailedError, RefusedError
from .failpoint import passed
from .paths import KEPT
from .release_store import Home

_TIMEOUT = 10.0  # s
_PATIENCE, _LOOK_EVERY = 10.0, 0.2  # s until an interface has other keys; it looks for them every second


def path(home: Home) -> str:
    """Returns the file of the private key."""
    return f"{known_keys.folder(home)}/wireguard.key"


def _next(home: Home) -> str:
    return f"{path(home)}.next"


def public(home: Home) -> str:
    """Returns the public key in base64; makes the private one if there is none.

    Raises ``RefusedError`` without wg, and ``FailedError`` for a damaged key, which stays as it is.
    """
    return _public(home, path(home))


def next_public(home: Home, *, make: bool) -> str:
    """Returns the public key that the host can change to; without one empty, or it can ``make`` one."""
    return _public(home, _next(home)) if make or os.path.exists(_next(home)) else ""


def change_to(home: Home, wanted: str) -> None:
    """Makes the next key, with this public one, that of the host. Nothing happens where it is already.

    Raises ``RefusedError`` if the next key is another one, and ``FailedError`` if an interface with the old
    key does not take it: then the old one is back.
    """
    before = public(home)
    following = next_public(home, make=False)
    if before == wanted:
        if following == wanted:  # an agent that was killed as it put the old one back has left it
            files.remove(_next(home))
        return
    if following != wanted:
        raise RefusedError("it has another next WireGuard key", "run `swarmctl rekey` again")
    old = files.read(path(home)) or b""
    os.rename(_next(home), path(home))
    files.sync(known_keys.folder(home))
    passed("rekey")
    if not _dropped("public-key", {before}):
        os.link(path(home), _next(home))
        files.replace(path(home), old, mode=0o600)
        raise FailedError(
            f"its WireGuard did not take the new key within {_PATIENCE:.0f} s, and has the old one again",
            "`swarmctl status` shows what ails its unit; then run `swarmctl rekey` again",
        )


def expel(home: Home, host: str) -> None:
    """Retires every key of a host that is known here. Raises ``FailedError`` if an interface keeps one."""
    known_keys.retire(home, host)
    if not _dropped("peers", set(keys.Keys(known_keys.known(home)).retired.get(host, ()))):
        raise FailedError(
            f"its WireGuard still has the key of {host} after {_PATIENCE:.0f} s",
            "`swarmctl status` shows what ails its unit; without that unit nothing passes",
        )


def _dropped(what: str, gone: set[str]) -> bool:
    """Waits until no interface has these public keys as its ``what``. Returns False if one keeps them."""
    end = time.monotonic() + _PATIENCE
    while gone.intersection(command.output_of(["wg", "show", "all", what]).split()):
        if time.monotonic() > end:
            return False
        time.sleep(_LOOK_EVERY)
    return True


def _public(home: Home, private: str) -> str:
    """Returns the public key of the private one in a file, which is made if there is none."""
    content = files.read(private)
    if content is None:
        content = _made(home, private)
    try:
        return _wg("pubkey", content).decode("ascii").strip()
    except FailedError as error:
        raise FailedError(
            f"{private} has no key of WireGuard: {error.message}",
            "restore that file; or remove it, and `swarmctl trust` with --replace pins the new key",
        ) from error


def _made(home: Home, private: str) -> bytes:
    """Makes a key: whole on the disk, or not there. Returns that of another agent if it was first."""
    content = _wg("genkey", b"")
    known_keys.make_folder(home)
    new = f"{files.draft(private)}-{os.getpid()}"
    try:
        files.write_new(new, content, 0o600)
        files.sync(new)
        passed("key")
        with suppress(FileExistsError):
            os.link(new, private)
    finally:
        files.remove(new)
    files.sync(os.path.dirname(private))
    return files.read(private) or content


def forget(home: Home) -> None:
    """Removes the keys, and their folder if that is empty."""
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
