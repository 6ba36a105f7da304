"""The swarm's folder on the host: where releases, state and staging are, and which release is current."""

from __future__ import annotations

import os

from . import disk, files
from .errors import RefusedError
from .manifest import EMPTY, NAME, Manifest, is_release_name, parse, swarm_name
from .named_tuple import NamedTuple
from .paths import ROOT

TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any, Callable

    from .messages import FileDrift

KEPT_RELEASES = 3  # the current one and two before it
KEPT_SETS = 2  # of secrets for each of them


class Home(NamedTuple):
    """``prefix`` stands before every path on the host; it is empty but in tests."""

    swarm: str
    prefix: str = ""

    @property
    def path(self) -> str:
        """The swarm's folder on the host."""
        return f"{self.prefix}{ROOT}/{self.swarm}"

    @property
    def gone(self) -> str:
        """The name of that folder while it is removed."""
        return f"{self.prefix}{ROOT}/.{self.swarm}.removed"

    @property
    def staging(self) -> str:
        """The folder of releases that are not complete yet."""
        return self.path + "/staging"

    @property
    def upload(self) -> str:
        """The folder of the complete files of an upload that ended early."""
        return self.state + "/upload"

    @property
    def edits(self) -> str:
        """Copies of what people had edited, before a deploy replaced it."""
        return self.state + "/edits"

    @property
    def state(self) -> str:
        """The folder of the agent's own state."""
        return self.path + "/state"

    @property
    def folders_file(self) -> str:
        """The folders of the system that were made for links, a line each, outer ones first."""
        return self.state + "/folders"

    @property
    def record_file(self) -> str:
        """The record of the last transaction."""
        return self.state + "/transaction.json"

    @property
    def audit_file(self) -> str:
        """The log of the host's changes."""
        return self.state + "/audit.jsonl"

    @property
    def lease_file(self) -> str:
        """The last lease of the swarm on this host."""
        return self.state + "/lease.json"

    @property
    def host_list_file(self) -> str:
        """The hosts of the swarm, as its operators reach them."""
        return self.state + "/hosts.json"

    @property
    def open_mark(self) -> str:
        """The file that exists while that record is open: a condition of the recovery unit."""
        return self.state + "/open"

    @property
    def trial_file(self) -> str:
        """The trial that runs, or whose end nobody has seen: a condition of the recovery unit, too."""
        return self.state + "/trial.json"

    @property
    def spare(self) -> str:
        """A file whose space an undo may use on a full disk."""
        return self.state + "/spare"

    @property
    def recovery_code(self) -> str:
        """The agent that the recovery unit runs."""
        return self.state + "/agent.zip"

    @property
    def current_link(self) -> str:
        """The link to the deployed release."""
        return self.path + "/current"

    def release(self, digest: str) -> str:
        """Returns the folder of a release."""
        return f"{self.path}/releases/{digest}"

    def outside(self, path: str) -> str:
        """Returns the real path of an absolute path of a manifest."""
        return self.prefix + path

    def through_current(self, relative: str) -> str:
        """Returns the target of a link to a file of the current release."""
        return f"{ROOT}/{self.swarm}/current/{relative}"

    def prepare(self) -> None:
        """Makes the folders that are missing, and lets units of any account read all. Raises ``OSError``."""
        root = os.path.dirname(self.path)
        for folder in (root, self.path, self.path + "/releases", self.staging, self.state):
            os.makedirs(folder, 0o755, exist_ok=True)
            mode = os.stat(folder).st_mode
            if mode & 0o055 != 0o055:
                os.chmod(folder, mode & 0o7777 | 0o055)

    def current(self) -> str | None:
        """Returns the digest of the current release; None without one, or if the link leads elsewhere."""
        folder, _, digest = (files.pointed(self.current_link) or "").rpartition("/")
        return digest if folder == "releases" and is_release_name(digest) else None

    def check_current(self) -> None:
        """Raises ``RefusedError`` if a folder stands where the link to the current release belongs."""
        if os.path.isdir(self.current_link) and not os.path.islink(self.current_link):
            raise RefusedError(
                f"{self.current_link} is a folder, and swarmctl needs a link there",
                "look at what is in it, and move it away",
            )

    def releases(self) -> list[str]:
        """Returns the digests of the stored releases."""
        try:
            return sorted(os.listdir(self.path + "/releases"))
        except FileNotFoundError:
            return []

    def manifest(self, digest: str | None) -> Manifest:
        """Returns the manifest of a stored release. Raises ``RefusedError``."""
        if digest is None:
            return EMPTY
        content = files.read(f"{self.release(digest)}/{NAME}")
        if content is None:
            raise RefusedError(f"release {digest} has no manifest", "deploy again")
        return parse(content, digest)

    def known_manifest(self, digest: str | None) -> Manifest | None:
        """Returns the manifest of a stored release, or None if it is missing or damaged."""
        try:
            return self.manifest(digest)
        except (RefusedError, ValueError, LookupError, TypeError):
            return None

    def units(self, digest: str | None) -> list[dict[str, Any]]:
        """Returns the units of a stored release, in start order; none if its manifest cannot be read."""
        raw = files.read_json(f"{self.release(digest)}/{NAME}") if digest else None
        return raw["units"] if isinstance(raw, dict) and isinstance(raw.get("units"), list) else []

    def kept(self, digest: str | None) -> Callable[[str], bytes | None]:
        """Returns the function that looks up intact contents of a stored release by their SHA-256."""
        manifest = self.known_manifest(digest) or EMPTY
        places = {entry.sha256: path for path, entry in manifest.files.items()}

        def content(sha256: str) -> bytes | None:
            found = files.read(f"{self.release(digest or '')}/{places[sha256]}") if sha256 in places else None
            return found if found is not None and files.digest_of(found) == sha256 else None

        return content

    def deviations(self, digest: str, manifest: Manifest) -> dict[str, FileDrift]:
        """How the release on disk differs from its manifest: ``changed``, ``missing``, ``extra`` by path."""
        root = self.release(digest)
        found: dict[str, FileDrift] = {}
        for path, entry in manifest.files.items():
            state = _file_state(os.path.join(root, path), entry.sha256, entry.mode)
            if state:
                found[path] = state
        for path in files.walk(root):
            if path not in manifest.files and path != NAME:
                found[path] = "extra"
        return found

    def clean_staging(self) -> None:
        """Removes incomplete releases, and what an interrupted removal of the swarm left."""
        files.remove_tree(self.gone)
        for name in os.listdir(self.staging):
            files.remove_tree(os.path.join(self.staging, name))


def home_of(swarm: Any) -> Home:
    """Returns the folder of the swarm in a request. Raises ``RefusedError`` for an invalid name."""
    return Home(swarm_name(swarm), os.environ.get("SWARM_PREFIX", ""))


def unwritable(home: Home, error: OSError) -> RefusedError:
    """Returns the error for a disk that cannot be written."""
    if disk.is_full(error):
        lacks, advice = disk.lack(home.path)
        return RefusedError(f"{home.path} cannot be written: {lacks}", advice)
    return RefusedError(f"{home.path} cannot be written: {error.strerror}", "is the file system read-only?")


def _file_state(path: str, sha256: str, mode: int) -> FileDrift | None:
    if os.path.islink(path):
        return "changed"
    content = files.read(path)
    if content is None:
        return "missing"
    same = files.digest_of(content) == sha256 and os.stat(path).st_mode & 0o7777 == mode
    return None if same else "changed"
