"""Adoption of edits, without hosts: the spec is read from files, its hosts are what it renders."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from swarmctl.adoption.adopt import Adoption, Reader, Texts, adopt
from swarmctl.adoption.changes import EditedFile
from swarmctl.linter.runner import check_files
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.rulebook import Severity
from swarmctl.spec.load import Document
from swarmctl.swarm.resolve import resolve
from swarmctl.yamltext.files import content

Hosts = Mapping[str, Bundle]


def reader(*layers: Path) -> Reader:
    def read(texts: Texts) -> tuple[Document, Hosts] | str:
        changed = {Path(file): text.encode() for file, text in texts.items()}

        def bytes_of(path: Path) -> bytes:
            return changed[path] if path in changed else content(path)

        document, found = check_files(*layers, read=bytes_of)
        if document is None:
            return next(one.message for one in found.diagnostics if one.severity is Severity.ERROR)
        return document, bundles(resolve(document))

    return read


def rendered(read: Reader, texts: Texts = {}) -> Hosts:  # noqa: B006  read only
    found = read(texts)
    assert not isinstance(found, str), found
    return found[1]


def edited(hosts: Hosts, host: str, path: str, *changes: tuple[str, str], place: str = "") -> EditedFile:
    """The file as somebody has changed it on the host."""
    file = next(one for one in hosts[host].files if one.path == path)
    text = file.content.decode()
    for old, new in changes:
        assert old in text, (old, text)
        text = text.replace(old, new)
    return EditedFile(host, path, place or path, text, file.digest)


def adopted(
    spec: Path, host: str, path: str, *changes: tuple[str, str], into: str = "", text: str = ""
) -> Adoption:
    layers = (spec, Path(into)) if into else (spec,)
    read = reader(*layers)
    hosts = rendered(read, {into: text} if into else {})
    return adopt(read, [edited(hosts, host, path, *changes)], into, text)
