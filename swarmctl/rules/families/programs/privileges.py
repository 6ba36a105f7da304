"""Commands that ask for the rights of root, which no unit of a program can get."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Sequence

from swarmctl.diagnostics import Diagnostic
from swarmctl.rules.context import RuleContext, rule

_BECOMES_ROOT = ("sudo", "su", "doas", "pkexec", "runuser")
_SHELLS = ("bash", "dash", "sh", "zsh")
_WRAPPERS = ("env", "exec", "ionice", "nice", "nohup", "setsid", "stdbuf", "time", "timeout")
# The first word of a command in a shell's text: at its beginning, after an operator or a word of the grammar.
_IN_A_SHELL = re.compile(
    r"(?:^|[;&|({`\n]|\b(?:then|do|else|exec|time|nohup)\s|!\s)\s*(?:[A-Za-z_]\w*=\S*\s+)*"
    rf"((?:/\S*/)?(?:{'|'.join(_BECOMES_ROOT)}))(?=\s|$)"
)
_HELP = (
    "write it without `{word}`: the groups of its unit open serial lines, sound, cameras and USB devices",
    "what needs root is a `container`, which runs as root, or a unit of the host's own",
)


@rule("PROG034", ros1=True)
def becoming_root(context: RuleContext) -> Iterator[Diagnostic]:
    """A command of a unit that runs ``sudo`` or the like; a person at a terminal may, and so may root."""
    for name, program in context.spec.programs.items():
        host = context.spec.hosts.get(context.program_hosts[name] or "")
        if program.lifecycle == "interactive" or (host and host.user == "root"):
            continue
        at, word = _found(program.command or ())
        if word:
            yield Diagnostic(
                "PROG034",
                f"program `{name}` cannot become root by `{word}`",
                context.span("programs", name, "command", at),
                label="systemd gives its processes no new privileges",
                help=tuple(one.format(word=word) for one in _HELP),
            )


def _found(words: Sequence[str]) -> tuple[int, str]:
    """The place of such a word in a command, and the word; empty without one."""
    for at, word in enumerate(words):
        name = posixpath.basename(word)
        if name in _BECOMES_ROOT:
            return at, name
        if name in _SHELLS:
            found = ((place, _IN_A_SHELL.search(text)) for place, text in enumerate(words) if place > at)
            return next(((place, posixpath.basename(one[1])) for place, one in found if one), (0, ""))
        passed_on = name in _WRAPPERS or word.startswith("-") or "=" in word or word[:1].isdigit()
        if not passed_on:
            break
    return 0, ""
