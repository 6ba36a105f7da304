"""Secrets in or next to the spec, and public addresses. No message repeats a secret."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from swarmctl.diagnostics import Diagnostic, Span
from swarmctl.linter.context import RuleContext, rule
from swarmctl.swarm.addresses import Kind, kind

_WORDS = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])|[0-9]+")
_PASSWORDS = {"password", "passwd", "passphrase", "psk"}
_SECRETS = _PASSWORDS | {"secret", "token", "apikey"}
_PAIRS = {
    ("api", "key"),
    ("access", "key"),
    ("private", "key"),
    ("auth", "key"),
    ("bluetooth", "pin"),
    ("pin", "code"),
}
# Words that turn a secret's name into a name about it: its path, its length.
_ABOUT = {"file", "path", "folder", "name", "topic", "id", "length", "timeout", "type", "url", "uri"}
_REFERENCE = re.compile(r"[/~$<{].*|")  # a file, a variable, a placeholder, or empty

# The forms of secrets: prefixes, pattern, and name.
_FORMS = (
    (("-----BEGIN ",), re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----.*"), "a private key"),
    (("AKIA", "ASIA"), re.compile(r"A[KS]IA[0-9A-Z]{16}\b"), "an AWS access key"),
    (("ghp_", "gho_", "ghu_", "ghs_", "ghr_"), re.compile(r"gh[pousr]_[A-Za-z0-9]{36,}"), "a GitHub token"),
    (("github_pat_",), re.compile(r"github_pat_[A-Za-z0-9_]{22,}"), "a GitHub token"),
    (("glpat-",), re.compile(r"glpat-[A-Za-z0-9_-]{20,}"), "a GitLab token"),
    (("xox",), re.compile(r"xox[abprs]-[A-Za-z0-9-]{10,}"), "a Slack token"),
    (("://",), re.compile(r"://([^\s/:@'\"]+:[^\s/@'\"$<{][^\s/@'\"]*)@"), "a URL with a password"),
)
_REMEDY = (
    "keep it in a file on the host, and give the program the path",
    "and change the secret, since it stays in the history of this file",
)


@rule("SEC001", "SEC002")
def secrets(context: RuleContext) -> Iterator[Diagnostic]:
    """A secret, recognised by the name of its key or by its form anywhere in the text."""
    named = [_named_secret(context, loc) for loc in _secret_places(context)]
    yield from named
    known = [one.span for one in named if one.span is not None]
    for file, text in context.document.source.texts.items():
        for span, what in _look_alikes(file, text):
            if not any(one.file == file and _holds(one, span) for one in known):
                yield Diagnostic(
                    "SEC002",
                    f"{what} in plain text",
                    span,
                    label="visible to everyone who has the file",
                    help=_REMEDY,
                    secret=True,
                )


def _secret_places(context: RuleContext) -> Iterator[tuple[str, ...]]:
    for name, program in context.spec.programs.items():
        for group in ("params", "environment"):
            for key, value in getattr(program, group).items():
                if is_secret(key, value):
                    yield "programs", name, group, key


def is_secret(key: str, value: object) -> bool:
    """True if the key's name and the value indicate a secret; paths and variables do not."""
    words = [word.lower() for word in _WORDS.findall(key)]
    if not words or isinstance(value, bool) or words[-1] in _ABOUT:
        return False
    if not isinstance(value, str):
        return not _PASSWORDS.isdisjoint(words)
    named = not _SECRETS.isdisjoint(words) or not _PAIRS.isdisjoint(pairwise(words))
    return named and not _REFERENCE.fullmatch(value)


def _named_secret(context: RuleContext, loc: tuple[str, ...]) -> Diagnostic:
    return Diagnostic(
        "SEC001",
        f"`{loc[-1]}` of program `{loc[1]}` is a secret in plain text",
        context.span(*loc),
        label="visible to everyone who has the file",
        help=_REMEDY,
        secret=True,
    )


def _look_alikes(file: str, text: str) -> Iterator[tuple[Span, str]]:
    for heads, form, what in _FORMS:
        if any(head in text for head in heads):
            for match in form.finditer(text):
                first, end = match.span(match.lastindex or 0)
                line, start = text.count("\n", 0, first) + 1, first - text.rfind("\n", 0, first)
                yield Span(file, line, start, line, start + end - first), what


def _holds(outer: Span, inner: Span) -> bool:
    begins = (outer.line, outer.column) <= (inner.line, inner.column)
    return begins and (inner.end_line, inner.end_column) <= (outer.end_line, outer.end_column)


@rule("SEC003")
def keys_beside(context: RuleContext) -> Iterator[Diagnostic]:
    """A private key in the spec's folder, which is usually a repository."""
    for name in context.document.private_keys:
        yield Diagnostic(
            "SEC003",
            f"the file `{name}` in the spec's folder is a private key",
            help=(
                "keep it in ~/.ssh or in an SSH agent; swarmctl uses both",
                "if it was ever committed, create a new one and remove the old one from every host",
            ),
        )


@rule("SEC004")
def public_addresses(context: RuleContext) -> Iterator[Diagnostic]:
    """A public address of a host that runs ROS, which has no authentication."""
    if not context.middleware.capabilities & {"master", "domains"}:
        return
    public = [
        name
        for name, ip in context.addresses.items()
        if ip is not None and name in context.home and kind(ip) is Kind.ORDINARY and ip.is_global
    ]
    if public:
        others = len(public) - 1
        verb = f"and {others} more have public addresses" if others else "has a public address"
        yield Diagnostic(
            "SEC004",
            f"host `{public[0]}` {verb}, and ROS has no authentication",
            context.span("hosts", public[0], "address"),
            label="not a private address",
            help=(
                "put the swarm behind its own router, with addresses such as 192.168.77.10",
                "if a firewall blocks incoming traffic, ignore this with that reason",
            ),
        )
