"""Findings that people know of and accept, each with a reason: by a comment, or by an entry of `silence`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from swarmctl.checks.rulebook import RuleText, rulebook
from swarmctl.spec.diagnostics import Diagnostic, Severity, Span
from swarmctl.spec.load import Document
from swarmctl.spec.suggest import did_you_mean

MARK = "swarmctl: allow"
_COMMENT = re.compile(rf"#[ \t]*{MARK}[ \t]+(?P<rule>[A-Za-z0-9]+)[ \t]*(?P<reason>[^\r\n]*)")
_WORTH = re.compile(r"[^\W_]")  # a reason has a letter or a digit at least


@dataclass(frozen=True)
class Wish:
    """One silence: which rule, why, where the wish stands, and what it covers."""

    rule: str
    reason: str
    span: Span
    lines: tuple[int, ...] = ()  # a comment covers its own line, or the next when it stands alone
    about: str | None = None  # an entry of the spec covers all findings, or those that name something

    def covers(self, found: Diagnostic) -> bool:
        if found.code != self.rule:
            return False
        if self.lines:
            return found.span is not None and (
                found.span.file == self.span.file and found.span.line in self.lines
            )
        return self.about is None or f"`{self.about}`" in " ".join((found.message, *found.help))


def silenced(
    found: Sequence[Diagnostic], document: Document, texts: Mapping[str, str]
) -> tuple[Diagnostic, ...]:
    """What is left of ``found``, with what is wrong with the silences themselves. ``texts`` by file name."""
    wishes = [*_in_spec(document), *_in_comments(texts)]
    if not wishes:
        return tuple(found)
    rules = rulebook()
    wrong = {wish: list(_complaints(wish, rules)) for wish in wishes}
    good = [wish for wish in wishes if not wrong[wish]]
    used = {wish for wish in good for one in found if wish.covers(one)}
    kept = [one for one in found if not any(wish.covers(one) for wish in good)]
    complaints = [one for wish in wishes for one in wrong[wish]]
    return (*kept, *complaints, *(_idle(wish) for wish in good if wish not in used))


def _in_spec(document: Document) -> Iterator[Wish]:
    for index, silence in enumerate(document.spec.silence):
        yield Wish(silence.rule, silence.reason, document.span("silence", index, "rule"), about=silence.about)


def _in_comments(texts: Mapping[str, str]) -> Iterator[Wish]:
    for file, text in texts.items():
        if MARK not in text:
            continue
        for number, line in enumerate(text.splitlines(), start=1):
            match = _COMMENT.search(line)
            if match is not None:
                alone = not line[: match.start()].strip()
                start, end = match.start("rule") + 1, match.end("rule") + 1
                span = Span(file, number, start, number, end)
                yield Wish(match["rule"], match["reason"], span, (number + alone,))


def _complaints(wish: Wish, rules: Mapping[str, RuleText]) -> Iterable[Diagnostic]:
    if wish.rule not in rules:
        yield Diagnostic(
            "SIL002",
            f"there is no rule `{wish.rule}` to silence",
            wish.span,
            help=did_you_mean(wish.rule, rules, "the rules are") or ("`swarmctl rules` lists them",),
        )
    elif rules[wish.rule].firm:
        mend = rules[wish.rule].mend
        yield Diagnostic(
            "SIL004",
            f"`{wish.rule}` cannot be silenced",
            wish.span,
            label="nothing could be made of such a spec",
            help=(f"mend it: {mend[0].lower()}{mend[1:]}",),
        )
    elif not _WORTH.search(wish.reason):
        yield Diagnostic(
            "SIL003",
            f"`{wish.rule}` is silenced without a reason",
            wish.span,
            label="why is it fine here?",
            help=(f"write it behind the id: # {MARK} {wish.rule} measured, and it holds",),
        )


def _idle(wish: Wish) -> Diagnostic:
    return Diagnostic(
        "SIL001",
        f"nothing here brings `{wish.rule}` to be silenced",
        wish.span,
        severity=Severity.WARNING,
        help=("remove it; a finding that comes back one day would go unseen",),
    )
