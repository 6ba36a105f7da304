"""What a change brings, complete on the host; nothing outside the swarm's folders has changed by then."""

from __future__ import annotations

from . import disk, edits, files, secrets, staging, upload
from .errors import RefusedError
from .failpoint import passed
from .manifest import Manifest
from .record import Change
from .release_store import Home, unwritable
from .rpc import Report


def bring(home: Home, change: Change, payload: bytes, report: Report) -> Manifest:
    """Returns the manifest of the next release, complete under its own name. Raises ``RefusedError``."""
    if not payload:
        manifest = home.known_manifest(change.next)
        if manifest is None or home.deviations(change.next, manifest):
            raise RefusedError(f"release {change.next} is not on the host", "run the same command again")
        _prove_writable(home)
        return manifest
    stored = home.kept(change.previous)

    def kept(sha256: str) -> bytes | None:
        found = stored(sha256)
        return upload.content(home, sha256) if found is None else found

    manifest, content, found = staging.unpack(payload, change.next, kept)
    staging.check_space(home, manifest)
    _prove_writable(home)
    passed("preflight")
    report.note(f"staging {len(manifest.files)} files")
    try:
        with disk.named_if_full(home.path, "staging the release"):
            folder = staging.stage(home, change.txid, manifest, content, found)
            staging.verify(folder, manifest)
            staging.publish(home, folder, change.next, manifest)
    except (RefusedError, OSError):
        home.clean_staging()
        raise
    upload.clear(home)
    return manifest


def keep_edits(home: Home, current: str | None, report: Report) -> None:
    """Copies what people have edited: this change replaces it. Raises ``RefusedError``."""
    manifest = home.known_manifest(current)
    if current is None or manifest is None:
        return
    try:
        copies = edits.keep(home, current, manifest)
    except OSError as error:
        raise unwritable(home, error) from error
    for copy in copies:
        report.note(f"kept an edit as {copy}")


def _prove_writable(home: Home) -> None:
    probe = home.state + "/probe"
    try:
        files.remove(probe)
        files.write_new(probe, b"swarm", 0o644)
        files.remove(probe)
    except OSError as error:
        raise unwritable(home, error) from error


def store_secrets(home: Home, change: Change, manifest: Manifest) -> str:
    """Returns the set of secrets of the next release, on the disk. Raises ``RefusedError``, ``OSError``."""
    if change.secrets is None:
        return secrets.store(home, change.txid, manifest.secrets, change.values)
    if change.secrets and change.secrets not in secrets.sets(home):
        raise RefusedError(
            f"the secrets of release {change.next} are not on the host any more",
            "deploy the spec that makes it",
        )
    return change.secrets
