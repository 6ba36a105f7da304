"""Fetches the git commits that a spec delivers packages of, with the git of this machine, into a cache."""

from __future__ import annotations

import io
import os
import shutil
import subprocess
import tarfile
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from swarmctl.spec.delivered_model import PackageSource
from swarmctl.spec.git_checkouts import checkout_of, checkouts
from swarmctl.spec.load import draft_of
from swarmctl.yamltext.source import source_of

MAX_BYTES = 1 << 30  # of all fetched commits; the oldest go first
MAX_COMMIT = 256 << 20  # bytes of the files of one
_TIMEOUT = 600.0  # s
_FULL = "free space, or set XDG_CACHE_HOME"
_OPTIONS = (
    *("-c", "core.hooksPath=/dev/null"),
    *("-c", "core.fsmonitor=false"),
    *("-c", "fetch.fsckObjects=true"),
    *("-c", "fetch.recurseSubmodules=false"),
    *("-c", "credential.interactive=false"),
    *("-c", "gc.auto=0"),
)


class GitFetchError(Exception):
    """A commit that cannot be fetched, and what to do."""

    def __init__(self, message: str, fix: str) -> None:
        super().__init__(message)
        self.fix = fix


class GitTimeoutError(GitFetchError):
    """A repository that does not answer in time."""


def fetch_missing(layers: Sequence[Path]) -> dict[str, GitFetchError]:
    """Fetches the commits of the spec in ``layers`` that are not in the cache.

    Returns what failed, by address, `@` and the beginning of the commit.
    """
    failed: dict[str, GitFetchError] = {}
    silent: dict[str, GitFetchError] = {}  # by address; the next commit there would take as long
    for address, commit in dict.fromkeys(_named(layers)):
        place = checkout_of(address, commit)
        if place.is_dir():
            continue
        try:
            if address in silent:
                raise silent[address]
            fetch(address, commit, place)
        except GitTimeoutError as error:
            failed[f"{address}@{commit[:10]}"] = silent[address] = error
        except GitFetchError as error:
            failed[f"{address}@{commit[:10]}"] = error
        except OSError as error:
            name = str(error.filename or place)
            failed[f"{address}@{commit[:10]}"] = GitFetchError(
                f"{name} cannot be written: {error.strerror}", _FULL
            )
    return failed


def _named(layers: Sequence[Path]) -> Iterator[tuple[str, str]]:
    """The repositories and commits of a spec; what is no well-formed pair is left to its rules."""
    draft = draft_of(layers)
    data: Any = source_of(draft.root, draft.path, draft.texts)[0].data
    packages = data.get("packages") if isinstance(data, dict) else None
    for one in packages.values() if isinstance(packages, dict) else ():
        try:
            source = PackageSource.model_validate(one)
        except ValidationError:
            continue
        if source.git and source.commit and source.misfit is None:
            yield source.git, source.commit


def fetch(address: str, commit: str, place: Path) -> None:
    """Writes the files of one commit to ``place``, atomically. Raises ``GitFetchError``."""
    if shutil.which("git") is None:
        raise GitFetchError("git is missing", "install it: `apt install git`")
    place.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=".new-", dir=place.parent) as folder:
        repository, archive, files = f"{folder}/git", f"{folder}/archive", Path(folder) / "files"
        _git("init", "--quiet", "--bare", repository)
        try:
            _git("-C", repository, "fetch", "--quiet", "--depth=1", "--no-tags", "--", address, commit)
        except GitTimeoutError:
            raise
        except GitFetchError:  # a server need not give out commits by their digest
            both = ("+refs/heads/*:refs/heads/*", "+refs/tags/*:refs/tags/*")
            _git("-C", repository, "fetch", "--quiet", "--no-tags", "--", address, *both)
        try:
            _git("-C", repository, "archive", "--format=tar", f"--output={archive}", f"{commit}^{{commit}}")
        except GitFetchError as error:
            raise GitFetchError(
                f"{address} has no commit {commit}",
                "`git ls-remote` lists what it has; was the commit pushed?",
            ) from error
        _extract(archive, files, address)
        try:
            files.replace(place)
        except OSError:
            if not place.is_dir():  # another run has fetched it meanwhile
                raise
    _remove_oldest(place)


def _extract(archive: str, files: Path, address: str) -> None:
    """Writes plain files; links are left out, as they are of folders beside a spec."""
    files.mkdir()
    total = 0
    with tarfile.open(archive) as packed:
        for member in packed:
            parts = member.name.split("/")
            total += member.size
            if total > MAX_COMMIT:
                raise GitFetchError(
                    f"the commit of {address} is larger than {MAX_COMMIT >> 20} MiB",
                    "deliver packages of a smaller repository",
                )
            if not member.isreg() or {"", ".", ".."} & set(parts):
                continue
            path = files.joinpath(*parts)
            path.parent.mkdir(parents=True, exist_ok=True)
            with packed.extractfile(member) or io.BytesIO() as content, path.open("wb") as file:
                shutil.copyfileobj(content, file)
            path.chmod(0o755 if member.mode & 0o100 else 0o644)


def _git(*arguments: str) -> None:
    """Runs git, which asks nothing and runs nothing of the repository."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    env = {
        **kept,
        "GIT_TERMINAL_PROMPT": "0",
        "GIT_ASKPASS": "/bin/false",
        "SSH_ASKPASS": "/bin/false",
        "SSH_ASKPASS_REQUIRE": "never",
        "GIT_SSH_COMMAND": "ssh -o BatchMode=yes",
        "GIT_ALLOW_PROTOCOL": "file:git:http:https:ssh",
        "GIT_LFS_SKIP_SMUDGE": "1",
        "LC_ALL": "C",
    }
    try:
        done = subprocess.run(
            ["git", *_OPTIONS, *arguments],
            stdin=subprocess.DEVNULL, capture_output=True, timeout=_TIMEOUT, check=False, env=env,
        )  # fmt: skip
    except subprocess.TimeoutExpired as error:
        raise GitTimeoutError(f"git took more than {_TIMEOUT:.0f} s", "is the network up?") from error
    if done.returncode:
        lines = [line for line in done.stderr.decode("utf-8", "replace").splitlines() if line.strip()]
        reason = next((line for line in lines if line.startswith(("fatal:", "error:"))), (lines or ["?"])[-1])
        full = any("No space left on device" in line for line in lines)
        raise GitFetchError(
            f"git cannot fetch it: {reason}",
            _FULL if full else "is the network up, and may this account read it?",
        )


def _remove_oldest(kept: Path) -> None:
    total = 0
    folders = [one for one in checkouts().iterdir() if one.is_dir() and not one.name.startswith(".")]
    for folder in sorted(folders, key=lambda one: (one == kept, one.stat().st_mtime_ns), reverse=True):
        total += sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
        if total > MAX_BYTES and folder != kept:
            shutil.rmtree(folder)
