"""No secret stands in a spec or beside it, no master is open to the internet. No message repeats a secret."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

from swarmctl.checks.case import Case, Rule
from swarmctl.spec.diagnostics import Diagnostic, Severity, Span
from swarmctl.topology.address import Kind, kind

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
# Words that make of a secret something about it: where it lies, how long it is.
_ABOUT = {"file", "path", "folder", "name", "topic", "id", "length", "timeout", "type", "url", "uri"}
_REFERENCE = re.compile(r"[/~$<{].*|")  # a file, a variable, a placeholder, nothing

# What secrets look like: what each of them begins with, its whole form, and what it is.
_FORMS = (
    (("-----BEGIN ",), re.compile(r"-----BEGIN [A-Z ]*PRIVATE KEY-----.*"), "a private key"),
    (("AKIA", "ASIA"), re.compile(r"A[KS]IA[0-9A-Z]{16}\b"), "an AWS access key"),
    (("ghp_", "gho_", "ghu_", "ghs_", "ghr_"), re.compile(r"gh[pousr]_[A-Za-z0-9]{36,}"), "a GitHub token"),
    (("github_pat_",), re.compile(r"github_pat_[A-Za-z0-9_]{22,}"), "a GitHub token"),
    (("glpat-",), re.compile(r"glpat-[A-Za-z0-9_-]{20,}"), "a GitLab token"),
    (("xox",), re.compile(r"xox[abprs]-[A-Za-z0-9-]{10,}"), "a Slack token"),
    (("://",), re.compile(r"://([^\s/:@'\"]+:[^\s/@'\"$<{][^\s/@'\"]*)@"), "a URL with a password"),
)
_MENDS = (
    "keep it in a file on the host, and let the program read that file",
    "and change it: it stays in the history of this file",
)


def secrets(case: Case) -> Iterator[Diagnostic]:
    """SEC001, SEC002: a secret by the name of its key, or by its looks anywhere in the text."""
    named = [_named_secret(case, loc) for loc in _secret_places(case)]
    yield from named
    known = [one.span for one in named if one.span is not None]
    for file, text in case.document.source.texts.items():
        for span, what in _look_alikes(file, text):
            if not any(one.file == file and _holds(one, span) for one in known):
                yield Diagnostic(
                    "SEC002",
                    f"this is {what}, in clear",
                    span,
                    label="everyone who reads the file has it",
                    help=_MENDS,
                    secret=True,
                )


def _secret_places(case: Case) -> Iterator[tuple[str, ...]]:
    for name, program in case.spec.programs.items():
        for group in ("params", "environment"):
            for key, value in getattr(program, group).items():
                if is_secret(key, value):
                    yield "programs", name, group, key


def is_secret(key: str, value: object) -> bool:
    """Whether a value is a secret by the name of its key; a path or a variable only leads to one."""
    words = [word.lower() for word in _WORDS.findall(key)]
    if not words or isinstance(value, bool) or words[-1] in _ABOUT:
        return False
    if not isinstance(value, str):
        return not _PASSWORDS.isdisjoint(words)
    named = not _SECRETS.isdisjoint(words) or not _PAIRS.isdisjoint(pairwise(words))
    return named and not _REFERENCE.fullmatch(value)


def _named_secret(case: Case, loc: tuple[str, ...]) -> Diagnostic:
    return Diagnostic(
        "SEC001",
        f"the value of `{loc[-1]}` is a secret of program `{loc[1]}`, in clear",
        case.span(*loc),
        label="everyone who reads the file has it",
        help=_MENDS,
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


def keys_beside(case: Case) -> Iterator[Diagnostic]:
    """SEC003: a private key in the spec's folder, which is mostly a repository."""
    for name in case.document.private_keys:
        yield Diagnostic(
            "SEC003",
            f"the file `{name}` beside the spec is a private key",
            severity=Severity.WARNING,
            help=(
                "keep it in ~/.ssh, or in an agent; swarmctl takes it from there",
                "if it was ever part of a repository, make a new one and remove the old one from every host",
            ),
        )


def public_addresses(case: Case) -> Iterator[Diagnostic]:
    """SEC004: an address that the internet reaches; a ROS 1 master asks nobody who he is."""
    public = [
        name
        for name, ip in case.addresses.items()
        if ip is not None and name in case.home and kind(ip) is Kind.ORDINARY and ip.is_global
    ]
    if public:
        others = len(public) - 1
        verb = f"and {others} more have public addresses" if others else "has a public address"
        yield Diagnostic(
            "SEC004",
            f"host `{public[0]}` {verb}, and ROS 1 lets everyone in who reaches it",
            case.span("hosts", public[0], "address"),
            severity=Severity.WARNING,
            label="not of a private network",
            help=(
                "put the swarm behind a router of its own, with addresses like 192.168.77.10",
                "if a firewall lets nobody in, silence this and say so",
            ),
        )


RULES: tuple[Rule, ...] = (secrets, keys_beside, public_addresses)
