"""Images of containers: what the engine has of one, and pulls by digest where there is space."""

from __future__ import annotations

import json
import os
import re
import subprocess

from . import command
from .errors import FailedError, RefusedError
from .named_tuple import NamedTuple
from .texts import clipped

TYPE_CHECKING = False

if TYPE_CHECKING:
    from typing import Any, Callable, Iterable, Sequence


_TIMEOUT = 10.0  # s
_UNKNOWN = ("image not known", "no such image")  # as podman and docker write it


class Image(NamedTuple):
    """What an engine has of an image. ``built_for``: its architecture, as Go names it; ``machine``: the
    host's; ``error``: why nothing is known.
    """

    there: bool
    built_for: str
    machine: str
    error: str


def look(engine: str, image: str) -> Image:
    """Returns what ``engine`` has of an image, which is named by its digest."""
    found = Image(False, "", os.uname().machine, "")
    command = [engine, "image", "inspect", "--format", "{{.Architecture}}", image]
    try:
        done = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return found._replace(error=f"{engine} did not answer within {_TIMEOUT:g} s")
    except OSError as error:
        return found._replace(error=f"{engine} cannot be run: {error.strerror}")
    if done.returncode == 0:
        return found._replace(
            there=True, built_for=clipped(done.stdout.decode("utf-8", "replace").strip(), 40)
        )
    complaint = " ".join(done.stderr.decode("utf-8", "replace").split())
    if any(one in complaint.lower() for one in _UNKNOWN):
        return found
    return found._replace(error=clipped(complaint or f"status {done.returncode}", 300))


_IMAGE = re.compile(r"[a-z0-9][A-Za-z0-9._:/-]*@sha256:[0-9a-f]{64}")
_STORAGE = {"podman": "{{.Store.GraphRoot}}", "docker": "{{.DockerRootDir}}"}  # of `ENGINE info`
_PULLING = 7200.0  # s
_GROWTH = 4  # layers are stored compressed, and unpacked beside that
_LEAST = 1 << 30  # bytes, where the size of an image is not known
#: GOARCH of the machines of uname(2).
_ARCHITECTURES = {"x86_64": "amd64", "i686": "386", "aarch64": "arm64", "armv7l": "arm", "armv6l": "arm"}
_DENIED = ("unauthorized", "denied", "authentication required")
_FREE = "free space on the host: `{} image prune --all` removes images that no container uses"
_NOT_PULLED = ("manifest unknown", "not found", "does not exist")


def pull_all(targets: Iterable[str], note: Callable[[str], None]) -> None:
    """Pulls images, each named as ENGINE IMAGE. Raises ``RefusedError`` and ``FailedError``."""
    pairs = [one.partition(" ") for one in targets]
    for engine in sorted({one[0] for one in pairs}):
        pull(engine, [one[2] for one in pairs if one[0] == engine], note)


def pull(engine: str, images: Sequence[str], note: Callable[[str], None]) -> None:
    """Pulls the ``images`` that are not there. Raises ``RefusedError`` and ``FailedError``."""
    if engine not in _STORAGE:
        raise RefusedError(f"{engine!r} is not an engine of containers")
    for image in images:
        if not _IMAGE.fullmatch(image):
            raise RefusedError(f"{image!r} is not an image with a digest")
    for image in images:
        _check_space(engine, image)
        name = image.partition("@")[0]
        note(f"{engine} pull {name}")
        _run(engine, image, name, note)


def _run(engine: str, image: str, name: str, note: Callable[[str], None]) -> None:
    last = ""

    def progress(line: str) -> None:
        nonlocal last
        last = line
        note(f"{name}: {line[:120]}")

    what = f"{engine} pull {image}"
    try:
        command.run([engine, "pull", image], what, timeout=_PULLING, line=progress)
    except FailedError as error:
        # An engine writes each of its attempts; the last line has the reason.
        message = f"{what} failed: {last}"[:1500] if last else str(error)
        raise FailedError(message, _advice(engine, name, message.lower())) from error


def size_of(manifest: Any) -> int:
    """Returns the compressed size in bytes of the layers in a manifest; 0 if it names none."""
    layers = manifest.get("layers") if isinstance(manifest, dict) else None
    sizes = (
        [one.get("size", 0) for one in layers if isinstance(one, dict)] if isinstance(layers, list) else []
    )
    return sum(one for one in sizes if isinstance(one, int) and one > 0)


def digest_for(manifest: Any, machine: str) -> str:
    """Returns the digest of the image for ``machine`` in a list of manifests; empty if it is not a list."""
    listed = manifest.get("manifests") if isinstance(manifest, dict) else None
    for one in listed if isinstance(listed, list) else ():
        built_for = one.get("platform") if isinstance(one, dict) else None
        if isinstance(built_for, dict) and built_for.get("architecture") == _ARCHITECTURES.get(machine):
            return str(one.get("digest", ""))
    return ""


def _check_space(engine: str, image: str) -> None:
    """Raises ``RefusedError`` if the image does not fit into the storage of the engine."""
    manifest = _manifest(engine, image)
    inner = digest_for(manifest, os.uname().machine)
    if inner:
        manifest = _manifest(engine, f"{image.partition('@')[0]}@{inner}")
    needed = _GROWTH * size_of(manifest) or _LEAST
    storage = command.output_of([engine, "info", "--format", _STORAGE[engine]]).strip()
    while storage and not os.path.isdir(storage):
        storage = os.path.dirname(storage)
    space = os.statvfs(storage or "/")
    free = space.f_bavail * space.f_frsize
    if free < needed:
        where = storage or "/"
        has = f"{needed >> 20} MiB in {where}, and {free >> 20} MiB are free"
        raise RefusedError(f"the image {image} needs about {has}", _FREE.format(engine))


def _manifest(engine: str, image: str) -> Any:
    """The manifest of an image in its registry; None if it cannot be read."""
    try:
        return json.loads(command.output_of([engine, "manifest", "inspect", image], timeout=60.0))
    except (ValueError, RecursionError):
        return None


def _advice(engine: str, name: str, error: str) -> str:
    if any(word in error for word in _DENIED):
        registry = name.partition("/")[0]
        return f"log in once on the host: `sudo {engine} login {registry}`; swarmctl keeps no credentials"
    if any(word in error for word in _NOT_PULLED):
        return "is the digest that of the registry, and is the image still there?"
    if "no space left" in error:
        return _FREE.format(engine)
    return "does the host reach the registry? Then run the same command again"
