"""Runs all rules on one document: references first, then the rules that need valid references.

Of a spec with errors they check what two repaired specs have in common.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from itertools import islice
from pathlib import Path
from pkgutil import iter_modules
from typing import Any, NamedTuple

from swarmctl.diagnostics import Diagnostic, apart_from, drop_redundant_warnings, has_errors, in_order
from swarmctl.linter.context import Rule, RuleContext
from swarmctl.linter.fixes import Findings, Stage
from swarmctl.linter.ignored import without_ignored
from swarmctl.linter.repaired import MOST_ERRORS, ROUNDS, WAYS, Repair, in_both, repaired_types
from swarmctl.rulebook import FOLDER, Severity
from swarmctl.spec.catalog import Catalog
from swarmctl.spec.load import Document, Draft, document_of, draft_of
from swarmctl.spec.model import Spec
from swarmctl.spec.package_search import Search, packages_in
from swarmctl.spec.unread_sections import Unread, UnreadError, known_names, known_part, sections_with
from swarmctl.yamltext.files import MAX_FINDINGS, Read, content
from swarmctl.yamltext.source import Source, collector_paused, source_of
from swarmctl.yamltext.variables import explained, may_stand_in

Make = Callable[..., Document]  # of a spec, its source and catalog


def _rules() -> Iterator[Rule]:
    for family in iter_modules([str(FOLDER)], "swarmctl.rules."):
        yield from (one for one in vars(import_module(family.name)).values() if isinstance(one, Rule))


RULES = tuple(_rules())  # a module of `swarmctl.rules` needs no entry in a list


def lint(document: Document, reported: Sequence[Diagnostic] = ()) -> tuple[Diagnostic, ...]:
    """Returns the findings of all rules in text order, without ignored ones.

    ``reported`` are findings from loading the document; they can be ignored too.
    """
    return _lint(document, reported).diagnostics


def _lint(document: Document, reported: Sequence[Diagnostic]) -> Findings:
    context = RuleContext(document)
    found = [*reported, *_found(context, names=True)]
    if has_errors(found):
        faulty = _Faulty(document.source, document.catalog, partial(replace, document))
        return Findings(Stage.NAMES, _at_once(found, faulty))
    found += _found(context, names=False)
    return Findings(Stage.RULES, in_order(without_ignored(found, document, document.texts)))


def _found(
    context: RuleContext, *, names: bool, ended_by: tuple[type[LookupError], ...] = ()
) -> list[Diagnostic]:
    """Returns what rules find; a rule ended by an error of ``ended_by`` has found nothing more."""
    found: list[Diagnostic] = []
    for one in RULES:
        if one.names is names:
            with suppress(*ended_by):
                found += islice(one(context), MAX_FINDINGS)
    return found


def check_files(
    *layers: Path, workspaces: Sequence[Path] = (), read: Read = content, search: Search = packages_in
) -> tuple[Document | None, Findings]:
    """Loads a spec with its overlays and runs all rules; ``workspaces`` have ROS packages, too.

    Returns the document, or None if there are errors, and the findings with the first stage that has errors.
    ``read`` returns the bytes of a file.
    """
    with collector_paused():
        draft = draft_of(layers, read, workspaces, search)
        document, found = _check(draft)
        if found.diagnostics and any(map(may_stand_in, draft.texts.values())):
            found = replace(found, diagnostics=explained(found.diagnostics, draft.root))
        return None if has_errors(found.diagnostics) else document, found


def _check(draft: Draft) -> tuple[Document | None, Findings]:
    """Returns the document and its findings; after an error, also what does not depend on it."""
    document, diagnostics = document_of(draft)
    if document is not None:
        return document, _lint(document, diagnostics)
    unread = any(one.code.startswith(("FILE", "YAML")) for one in diagnostics if has_errors([one]))
    stage = Stage.TEXT if unread else Stage.FORMAT
    source, odd = source_of(draft.root, draft.path, draft.texts, draft.trees)
    if not draft.is_complete or not isinstance(source.data, dict):
        return None, Findings(stage, in_order(diagnostics))
    sections = sections_with(draft.diagnostics[len(draft.catalog.diagnostics) :], source)
    faulty = _Faulty(source, draft.catalog, _documents(draft), sections, odd)
    return None, Findings(stage, _at_once(diagnostics, faulty))


def _documents(draft: Draft) -> Make:
    """Returns what makes documents of a draft's repaired specs; they share packages and files, read once."""
    shared: list[Document] = []

    def made(*, spec: Spec, source: Source, catalog: Catalog) -> Document:
        if not shared:
            try:
                shared.append(draft.document(spec, source, catalog))
            except UnreadError:
                unread: Any = Unread()
                keys = draft.private_keys
                shared.append(Document(spec, source, catalog, keys, packages=unread, files=unread))
        return replace(shared[0], spec=spec, source=source, catalog=catalog)

    return made


class _Faulty(NamedTuple):
    """A spec with errors: what makes its documents, the sections that are not known, errors of the text."""

    source: Source
    catalog: Catalog
    make: Make
    unread: Collection[str] = ()
    odd: Sequence[Diagnostic] = ()


def _at_once(known: Sequence[Diagnostic], faulty: _Faulty) -> tuple[Diagnostic, ...]:
    """Returns the errors ``known`` and what else is wrong however they are repaired; many errors hide it."""
    found, document = list(known), None
    if sum(one.severity is Severity.ERROR for one in known) <= MOST_ERRORS:
        (document, first, one), (_, second, other) = (_repaired(faulty, way) for way in WAYS)
        wrong = one.names | other.names | {one.span for one in known if one.severity is Severity.ERROR}
        others = in_both(wrong, (first, second), one.lost | other.lost, one.topics | other.topics)
        found += apart_from(known, others)
    if document is not None:
        with suppress(UnreadError):
            kept = without_ignored(found, document, document.texts)
            found = [one for one in kept if one.code != "SIL001"]  # what it is about may not be found yet
    return in_order(drop_redundant_warnings(found))


def _repaired(faulty: _Faulty, way: int) -> tuple[Document | None, list[Diagnostic], Repair[Spec]]:
    """Returns a spec repaired in one way, what is found in it and before, and its repair."""
    catalog, found = repaired_types(faulty.catalog, way)
    repair = Repair(Spec, faulty.source, way, faulty.unread)
    repair.repair_text(faulty.odd)
    repair.repair_types(catalog)
    for _ in range(ROUNDS):
        value, wrong = repair.value()
        found += wrong
        if value is None:
            break
        spec = known_part(dict(value)) if repair.unread else value
        document = faulty.make(spec=spec, source=repair.source, catalog=catalog)
        context = RuleContext(document)
        named = _found(context, names=True, ended_by=(LookupError,))
        found += named
        if not has_errors(named):
            found += _found(context, names=False, ended_by=(LookupError,))
            return document, found, repair
        if not repair.repair_names(named, known_names(document)):
            break
    return None, found, repair
