"""Edits on hosts, brought into the files of a spec: ``adopt`` and ``deploy --adopt``."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from swarmctl.cli import console, deploy_steps, exit_codes, file_writes, selected
from swarmctl.cli.where import Where

if TYPE_CHECKING:
    from swarmctl.adoption.adopt import Adoption, Reader, Texts
    from swarmctl.adoption.changes import EditedFile
    from swarmctl.cli.spec_args import SpecFiles
    from swarmctl.remote.transport import Target, Transport
    from swarmctl.render.bundle import Bundle
    from swarmctl.spec.load import Document

Render = Callable[["Document"], "Mapping[str, Bundle]"]


def found(
    where: Where,
    names: Collection[str],
    targets: Mapping[str, Target],
    transport: Transport,
    into: Path | None,
) -> tuple[Adoption, list[str]]:
    """Returns how the spec changes to have the edits of the hosts, and which hosts did not answer."""
    from swarmctl.deploy.observe_host import edits_on_hosts
    from swarmctl.remote.transport import HostError
    from swarmctl.render.build_bundle import bundles

    def render(document: Document) -> Mapping[str, Bundle]:
        return bundles(where.swarm(document))

    wanted = render(console.read_document(where.spec))
    answers = edits_on_hosts(
        {name: wanted[name] for name in names}, targets, transport, parallel=where.parallel
    )
    errors = [f"{name}: {one}" for name, one in answers.items() if isinstance(one, HostError)]
    edited = [file for one in answers.values() if not isinstance(one, HostError) for file in one]
    return _adoption(where.spec, edited, render, into), errors


def check_options(*, adopt: bool, into: Path | None, saved: bool) -> None:
    """Exits if the options of ``deploy`` exclude each other."""
    if adopt and saved:
        console.fail("--adopt changes the spec, which a saved plan is made of", code=exit_codes.USAGE)
    if into and not adopt:
        console.fail("--into belongs to --adopt", code=exit_codes.USAGE)


def before_deploy(
    where: Where, into: Path | None, *, yes: bool, writes: bool, overwrites: bool, quiet: bool
) -> Where:
    """Shows how the spec changes so that it has what was edited on hosts, and writes it, after a question.

    ``overwrites``: the deploy replaces the edits that the spec does not take; with ``quiet`` nothing goes to
    stdout. Returns the hosts with the files of the spec then; exits without ``yes`` if there is no terminal
    to ask on.
    """
    swarm = where.swarm(console.read_document(where.spec))
    targets = where.targets(swarm)
    with where.transport() as transport:
        names = selected.hosts(swarm.candidates, where.limit)
        adoption, _ = found(where, names, targets, transport, into)
    show(adoption, quiet=quiet, overwrites=overwrites)
    if adoption.texts and writes:
        if not yes:
            if quiet or not deploy_steps.asks():
                console.fail(
                    "nothing was written or deployed: --adopt changes the spec, and there is nobody to ask",
                    "look at what `swarmctl adopt` prints; --yes writes it in scripts",
                )
            deploy_steps.agree("Write this into the spec?")
        write(adoption)
    if into is not None and into.exists() and into not in where.spec.files:
        return replace(where, spec=replace(where.spec, files=(*where.spec.files, into)))
    return where


def _adoption(spec: SpecFiles, edited: Sequence[EditedFile], render: Render, into: Path | None) -> Adoption:
    """Returns how the spec changes so that it has the edits; exits if two hosts contradict each other.

    ``render`` returns what the hosts of a document get; ``into``: the overlay to write.
    """
    from swarmctl.adoption.adopt import ContradictionError, adopt

    try:
        if into is None:
            return adopt(_reader(spec, render), edited)
        text = _text(into) if into.exists() else ""
        layers = spec.files if into in spec.files else (*spec.files, into)
        return adopt(_reader(spec, render, layers), edited, str(into), text)
    except ContradictionError as error:
        console.fail(str(error), "make them equal on the hosts, or choose one host with --limit")
    except ValueError as error:
        console.fail(f"{spec} cannot be read: {error}")


def show(found: Adoption, *, quiet: bool = False, overwrites: bool = False) -> None:
    """Print the changes as a diff on stdout, unless ``quiet``; on stderr what becomes of each edit.

    ``overwrites``: a deploy replaces those that the spec does not take.
    """
    from swarmctl.views.escape import printable

    for change in _changes(found.texts) if not quiet else ():
        for line in file_writes.difference(change).split("\n")[:-1]:
            print(printable(line))  # a file that lies beside the spec has what the host sent
    for one in found.adopted:
        what = f": {one.what}" if one.what else ""
        console.show(printable(f"{one.host} {one.path}{what}, in {one.place}"), error=True)
    for left in found.refused:
        what = f": {left.what}" if left.what else ""
        fate = "will be overwritten (the host keeps a copy)" if overwrites else "stays on the host"
        console.show(printable(f"{left.host} {left.path}{what} {fate}: {left.reason}"), error=True)


def write(found: Adoption) -> None:
    """Write the changed files, all of them or none; an overlay may be new."""
    changes = _changes(found.texts)
    file_writes.write([one for one in changes if Path(one.file).exists()])
    for one in changes:
        if not Path(one.file).exists():
            try:
                file_writes.create(Path(one.file), one.after.encode())
            except OSError as error:
                console.fail(console.cannot_write(error, one.file))


def _changes(texts: Texts) -> list[file_writes.Change]:
    return [
        file_writes.Change(_read(Path(file)), file, _text(Path(file)), text) for file, text in texts.items()
    ]


def _reader(spec: SpecFiles, render: Render, layers: tuple[Path, ...] = ()) -> Reader:
    from swarmctl.linter.runner import check_files
    from swarmctl.rulebook import Severity
    from swarmctl.spec.package_search import packages_in

    read, search = cache(_read), cache(packages_in)

    def found(texts: Texts) -> tuple[Document, Mapping[str, Bundle]] | str:
        changed = {Path(file): text.encode() for file, text in texts.items()}
        document, findings = check_files(
            *(layers or spec.files),
            workspaces=spec.workspaces,
            read=lambda path: changed[path] if path in changed else read(path),
            search=search,
        )
        if document is None:
            errors = (one for one in findings.diagnostics if one.severity is Severity.ERROR)
            return next((f"{one.code}: {one.message}" for one in errors), "the spec has errors")
        return document, render(document)

    return found


def _read(path: Path) -> bytes:
    from swarmctl.yamltext.files import content

    return content(path) if path.exists() else b""


def _text(path: Path) -> str:
    return _read(path).decode("utf-8-sig")
