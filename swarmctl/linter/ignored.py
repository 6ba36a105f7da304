"""Ignored findings, each with a reason: by a comment, or by an entry of the spec's `ignore`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.rulebook import RuleText, rulebook
from swarmctl.spec.load import Document
from swarmctl.suggest import did_you_mean
from swarmctl.yamltext.files import MAX_FINDINGS

MARK = "swarmctl: ignore"
_COMMENT = re.compile(rf"#[ \t]*{MARK}[ \t]+(?P<rule>[A-Za-z0-9]+)[ \t]*(?P<reason>[^\r\n]*)")
_Place = tuple[str, str, int]  # a rule, a file and a line of it; without file and line, the whole spec
_WORD_CHARACTER = re.compile(r"[^\W_]")  # a reason needs at least one letter or digit


@dataclass(frozen=True)
class Ignore:
    """One comment or entry: its rule, its reason, its place, and the findings that it covers."""

    rule: str
    reason: str
    span: Span
    lines: tuple[int, ...] = ()  # of a comment: its own line, or the next line if it stands alone
    about: str | None = None  # of an entry: only findings that name this; None covers all of the rule

    def covers(self, found: Diagnostic) -> bool:
        """True if ``found`` is ignored by this."""
        if found.code != self.rule:
            return False
        if self.lines:
            return found.span is not None and (
                found.span.file == self.span.file and found.span.line in self.lines
            )
        return self.about is None or f"`{self.about}`" in " ".join((found.message, *found.help))


def without_ignored(
    found: Sequence[Diagnostic], document: Document, texts: Mapping[str, str]
) -> tuple[Diagnostic, ...]:
    """Returns ``found`` without ignored findings, plus those about the comments and entries themselves.

    ``texts`` are the texts of the spec by file name; comments are read from them.
    """
    ignores = [*_in_spec(document), *_in_comments(texts)]
    if not ignores:
        return tuple(found)
    rules = rulebook()
    valid = [one for one in ignores if not _is_wrong(one, rules)]
    wrong = (_error(one, rules) for one in ignores if _is_wrong(one, rules))
    by_place = _by_place(valid)
    used: set[int] = set()
    kept = []
    for finding in found:
        covering = [
            one for place in _places(finding) for one in by_place.get(place, ()) if one.covers(finding)
        ]
        used.update(map(id, covering))
        if not covering:
            kept.append(finding)
    unused = (_unused(one) for one in valid if id(one) not in used)
    return (*kept, *islice(wrong, MAX_FINDINGS), *islice(unused, MAX_FINDINGS))


def _by_place(ignores: Iterable[Ignore]) -> Mapping[_Place, list[Ignore]]:
    """Entries by rule and line: a generated spec may have one for each robot."""
    found: dict[_Place, list[Ignore]] = {}
    for one in ignores:
        places = [(one.rule, one.span.file, line) for line in one.lines]
        for place in places or [(one.rule, "", 0)]:
            found.setdefault(place, []).append(one)
    return found


def _places(found: Diagnostic) -> Iterator[_Place]:
    """Where a finding can be ignored: in the spec's `ignore`, or at its line."""
    yield (found.code, "", 0)
    if found.span is not None:
        yield (found.code, found.span.file, found.span.line)


def _in_spec(document: Document) -> Iterator[Ignore]:
    for index, entry in enumerate(document.spec.ignore):
        yield Ignore(entry.rule, entry.reason, document.span("ignore", index, "rule"), about=entry.about)


def _in_comments(texts: Mapping[str, str]) -> Iterator[Ignore]:
    for file, text in texts.items():
        if MARK not in text:
            continue
        for number, line in enumerate(text.splitlines(), start=1):
            match = _COMMENT.search(line)
            if match is not None:
                alone = not line[: match.start()].strip()
                start, end = match.start("rule") + 1, match.end("rule") + 1
                span = Span(file, number, start, number, end)
                yield Ignore(match["rule"], match["reason"], span, (number + alone,))


def _is_wrong(one: Ignore, rules: Mapping[str, RuleText]) -> bool:
    known = rules.get(one.rule)
    return known is None or known.firm or not _WORD_CHARACTER.search(one.reason)


def _error(one: Ignore, rules: Mapping[str, RuleText]) -> Diagnostic:
    if one.rule not in rules:
        return Diagnostic(
            "SIL002",
            f"unknown rule `{one.rule}`",
            one.span,
            label="ignores nothing",
            help=did_you_mean(one.rule, rules, "the rules are") or ("`swarmctl rules` lists all rules",),
        )
    if rules[one.rule].firm:
        fix = rules[one.rule].fix
        return Diagnostic(
            "SIL004",
            f"`{one.rule}` cannot be ignored",
            one.span,
            label="a spec with this error cannot be used",
            help=(f"fix it instead: {fix[0].lower()}{fix[1:]}",),
        )
    return Diagnostic(
        "SIL003",
        f"`{one.rule}` is ignored without a reason",
        one.span,
        label="reason missing",
        help=(f"write it after the id: # {MARK} {one.rule} measured on the real robot",),
    )


def _unused(one: Ignore) -> Diagnostic:
    return Diagnostic(
        "SIL001",
        f"unused `ignore`: `{one.rule}` is not reported here",
        one.span,
        help=("remove it, so that the finding is reported if it returns",),
    )
