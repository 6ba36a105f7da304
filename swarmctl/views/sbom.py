"""The bill of materials of releases, as CycloneDX 1.6 in JSON. Same releases, same bytes: no time, no chance.

Equal folders of files on several hosts are one component; ``dependencies`` has which host has which.
"""

from __future__ import annotations

import json
import uuid
from collections.abc import Iterable, Iterator, Mapping, Sequence
from hashlib import sha256
from typing import Any
from urllib.parse import quote

from swarmctl import __version__
from swarmctl.plan.host_needs import HostNeeds, needs_of
from swarmctl.render.bundle import Bundle, File, required
from swarmctl.render.manifest import digest_of
from swarmctl.render.shipped_files import NEEDS
from swarmctl.render.sketch import sketch_of
from swarmctl.ros_packages.package import MANIFEST
from swarmctl.ros_packages.xml_tags import root_of
from swarmctl.swarm.resolved import Swarm

Component = dict[str, Any]
#: Folders of a release that have a folder for each board, and for each delivered package.
_FIRMWARE, _PACKAGES = "firmware", "packages"
_SWARMCTL = f"pkg:pypi/swarmctl@{__version__}"


def cyclonedx(swarm: Swarm, bundles: Mapping[str, Bundle]) -> str:
    """Returns the document for the releases of these hosts, with all files and what the hosts must have."""
    found: dict[str, Component] = {}
    depends: dict[str, list[str]] = {}
    for name, bundle in bundles.items():
        own, folders = _folders(bundle.files)
        parts = [_folder(swarm, folder, files) for folder, files in folders.items()]
        if bundle.files:
            parts.append(_component("platform", f"ros/{bundle.distro}", "ros", version=bundle.distro))
        parts += _needed(needs_of(swarm, swarm.hosts[name], bundle))
        release = _component(
            "application",
            f"release/{name}",
            name,
            version=bundle.digest,
            hashes=_hashes(digest_of(bundle.manifest_bytes)),
            components=_files(own),
        )
        found |= {one["bom-ref"]: one for one in (release, *parts)}
        depends[release["bom-ref"]] = sorted({one["bom-ref"] for one in parts})
    subject = _component(
        "application",
        f"swarm/{swarm.name}",
        swarm.name,
        version=digest_of("".join(one.digest for one in bundles.values()).encode())[:16],
        properties=[
            {"name": f"swarmctl:release:{name}", "value": one.digest} for name, one in bundles.items()
        ],
    )
    tool = _component("application", _SWARMCTL, "swarmctl", version=__version__, purl=_SWARMCTL)
    depends[subject["bom-ref"]] = [tool["bom-ref"], *(f"release/{name}" for name in bundles)]
    body = {
        "$schema": "http://cyclonedx.org/schema/bom-1.6.schema.json",
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": subject},
        "components": [tool, *(found[ref] for ref in sorted(found))],
        "dependencies": [{"ref": ref, "dependsOn": on} for ref, on in depends.items()],
    }
    serial = uuid.uuid5(uuid.NAMESPACE_URL, json.dumps(body))
    return json.dumps({**body, "serialNumber": f"urn:uuid:{serial}"}, indent=1) + "\n"


def _component(kind: str, ref: str, name: str, **values: Any) -> Component:
    """A component without what has no value."""
    filled = {key: value for key, value in values.items() if value}
    return {"type": kind, "bom-ref": ref, "name": name, **filled}


def _hashes(digest: str) -> list[dict[str, str]]:
    return [{"alg": "SHA-256", "content": digest}]


def _files(files: Iterable[File]) -> list[Component]:
    return [{"type": "file", "name": one.path, "hashes": _hashes(one.digest)} for one in files]


def _folders(files: Sequence[File]) -> tuple[list[File], dict[str, list[File]]]:
    """The files of a host's own, and by folder those of programs, firmware and delivered packages."""
    own: list[File] = []
    folders: dict[str, list[File]] = {}
    for file in files:
        first, *rest = file.path.split("/")
        if first in NEEDS:
            folders.setdefault(first, []).append(file)
        elif first in (_FIRMWARE, _PACKAGES):
            folders.setdefault(f"{first}/{rest[0]}", []).append(file)
        else:
            own.append(file)
    return own, folders


def _folder(swarm: Swarm, folder: str, files: Sequence[File]) -> Component:
    total = sha256("".join(f"{one.digest} {one.path}\n" for one in files).encode()).hexdigest()
    first, _, name = folder.partition("/")
    kind, version = "application", __version__
    if first == _FIRMWARE:
        sketch = sketch_of(swarm.robots[name])
        kind, version = "firmware", sketch.digest if sketch else ""
    elif first == _PACKAGES:
        kind, version = "library", _package_version(swarm, name)
    return _component(
        kind, f"{folder}@{total[:16]}", name or folder, version=version, components=_files(files)
    )


def _package_version(swarm: Swarm, name: str) -> str:
    root = root_of(swarm.packages[name].files[MANIFEST][0])
    return next((tag.text.strip() for tag in root.children if tag.name == "version"), "")


def _needed(needs: HostNeeds) -> Iterator[Component]:
    """What a host must have beside its release; of a Debian package no version is known here."""
    for one in needs.packages:
        name = required(one.requirement)[1] or one.packages[0]
        debian = [{"name": "swarmctl:debian-package", "value": package} for package in one.packages]
        yield _component("library", f"needs/{name}@{'|'.join(one.packages)}", name, properties=debian)
    for requirement in needs.pip:
        name, _, version = requirement.partition("==")
        purl = f"pkg:pypi/{name.lower().replace('_', '-')}{'@' if version else ''}{version}"
        yield _component("library", purl, name, version=version, purl=purl)
    for path in needs.workspaces:
        yield _component("library", f"workspace/{path}", path)
    for _, image in needs.images:
        name, _, digest = image.rpartition("@")
        short = name.rpartition("/")[2].partition(":")[0].lower()
        purl = f"pkg:oci/{short}@{quote(digest, '')}?repository_url={quote(name, '/')}" if name else ""
        yield _component("container", f"image/{image}", name or digest, version=digest, purl=purl)
