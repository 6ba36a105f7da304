"""Runs all rules on one document: references first, then the rules that need valid references.

In a spec with errors they check the sections that have none.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from importlib import import_module
from itertools import islice
from pathlib import Path
from pkgutil import iter_modules

from swarmctl.diagnostics import Diagnostic, apart_from, drop_redundant_warnings, has_errors, in_order
from swarmctl.linter.context import Rule, RuleContext
from swarmctl.linter.fixes import Findings, Stage
from swarmctl.linter.ignored import without_ignored
from swarmctl.rulebook import FOLDER
from swarmctl.spec.load import Document, Draft, document_of, draft_of
from swarmctl.spec.package_search import Search, packages_in
from swarmctl.spec.sound_sections import UnsoundError, sections_with, sound_document, without_sections
from swarmctl.yamltext.files import MAX_FINDINGS, Read, content
from swarmctl.yamltext.source import collector_paused


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
        return Findings(Stage.NAMES, _of_sound_sections(document, found))
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


def _of_sound_sections(document: Document, found: Sequence[Diagnostic]) -> tuple[Diagnostic, ...]:
    """Returns ``found``, which has errors, and what rules find in the sections without.

    A rule that looks up what is in another section finds nothing.
    """
    sound = without_sections(document, sections_with(found, document.source))
    found = [*found, *_found(RuleContext(sound), names=False, ended_by=(LookupError,))]
    with suppress(UnsoundError):
        kept = without_ignored(found, sound, document.texts)
        found = [one for one in kept if one.code != "SIL001"]  # what it is about may not be found yet
    return in_order(drop_redundant_warnings(found))


def check_files(
    *layers: Path, workspaces: Sequence[Path] = (), read: Read = content, search: Search = packages_in
) -> tuple[Document | None, Findings]:
    """Loads a spec with its overlays and runs all rules; ``workspaces`` have ROS packages, too.

    Returns the document, or None if there are errors, and the findings with the first stage that has errors.
    ``read`` returns the bytes of a file.
    """
    with collector_paused():
        document, found = _check(draft_of(layers, read, workspaces, search))
        return None if has_errors(found.diagnostics) else document, found


def _check(draft: Draft) -> tuple[Document | None, Findings]:
    """Returns the document and its findings; after an error, also those in the sections without."""
    document, diagnostics = document_of(draft)
    if document is not None:
        return document, _lint(document, diagnostics)
    unread = any(one.code.startswith(("FILE", "YAML")) for one in diagnostics if has_errors([one]))
    stage = Stage.TEXT if unread else Stage.FORMAT
    sound = sound_document(draft, diagnostics)
    if sound is None:
        return None, Findings(stage, in_order(diagnostics))
    named = _found(RuleContext(sound), names=True, ended_by=(UnsoundError,))
    found = [*diagnostics, *apart_from(diagnostics, named)]
    return None, Findings(stage, _of_sound_sections(sound, found))
