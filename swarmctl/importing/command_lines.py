"""The words of command lines: options, braces, and commands that run another one.

Source: bash(1), sudo(8), env(1), timeout(1), sshpass(1), xterm(1).
"""

from __future__ import annotations

import posixpath
import re
import shlex
from collections.abc import Iterator, Mapping, Sequence

from swarmctl.ros_packages.launch_values import Unknown

Word = str | Unknown

LONGEST_LIST = 2_000
_BRACES = re.compile(r"(.*?)\{([^{},\s]*(?:,[^{},\s]*)+|-?\d+\.\.-?\d+)\}(.*)", re.DOTALL)
#: Commands that run the rest of their words, and their options that have a value.
_WRAPPERS: Mapping[str, str] = {
    "sudo": "ughpCT", "nohup": "", "exec": "a", "command": "", "time": "fo", "nice": "n", "ionice": "cn",
    "setsid": "", "stdbuf": "ioe", "unbuffer": "", "env": "uCS", "chrt": "", "taskset": "c", "xargs": "",
    "sshpass": "pfd", "gosu": "", "su-exec": "",
    "timeout": "ks", "dbus-launch": "", "caffeinate": "",
}  # fmt: skip
_POSITIONAL = {
    "timeout",
    "chrt",
    "taskset",
    "gosu",
    "su-exec",
}  # that take a word of their own before the command
SHELLS = {"bash", "sh", "zsh", "dash"}
TERMINALS = {
    "gnome-terminal", "xterm", "konsole", "terminator", "lxterminal", "mate-terminal", "x-terminal-emulator",
    "xfce4-terminal", "tilix", "kitty", "alacritty", "urxvt",
}  # fmt: skip


def braced(text: str) -> list[Word]:
    """Returns the words of `a{1..3}` and `a{b,c}`."""
    waiting, found = [text], list[Word]()
    while waiting and len(found) < LONGEST_LIST:
        one = waiting.pop(0)
        match = _BRACES.fullmatch(one)
        if match is None:
            found.append(one)
            continue
        choices = match[2].split(",")
        if ".." in match[2]:
            first, last = (int(end[:9]) for end in match[2].split(".."))
            step, width = (
                (1 if last >= first else -1),
                len(match[2].split("..")[0]) if match[2][0] == "0" else 0,
            )
            choices = [str(at).zfill(width) for at in range(first, last + step, step)[:LONGEST_LIST]]
        waiting[:0] = [f"{match[1]}{choice}{match[3]}" for choice in choices]
    return found


def short_options(words: Sequence[Word], with_value: str) -> tuple[dict[str, Word], list[Word]]:
    """Returns the short options before the first other word, and what follows them."""
    found: dict[str, Word] = {}
    rest = list(words)
    while rest and isinstance(rest[0], str) and rest[0].startswith("-") and len(rest[0]) > 1:
        letters = rest.pop(0)
        if letters == "--":
            break
        for at, letter in enumerate(str(letters)[1:], 1):
            if letter in with_value:
                found[letter] = str(letters)[at + 1 :] or (rest.pop(0) if rest else "")
                break
            found[letter] = ""
    return found, rest


def unwrapped(words: tuple[Word, ...]) -> tuple[tuple[Word, ...], dict[str, Word], bool]:
    """Returns a command without what runs it, the variables of `env`, and whether it has a password."""
    own: dict[str, Word] = {}
    has_password = False
    while words and isinstance(words[0], str) and posixpath.basename(words[0]) in _WRAPPERS:
        name = posixpath.basename(words[0])
        has_password = has_password or name == "sshpass"
        _, rest = short_options(words[1:], _WRAPPERS[name])
        while name in ("env", "sudo") and rest and isinstance(rest[0], str) and re.match(r"\w+=", rest[0]):
            key, _, value = str(rest.pop(0)).partition("=")
            own[key] = value
        words = tuple(rest[1:] if name in _POSITIONAL else rest)
    return words, own, has_password


def is_shell(command: Sequence[Word]) -> bool:
    """Returns True for a command that runs what it reads: `bash -s`."""
    words = [word for one in command if isinstance(one, str) for word in one.split()]
    return (
        bool(words)
        and words[0] in SHELLS
        and all(one.startswith("-") and "c" not in one for one in words[1:])
    )


def in_terminal(words: Sequence[str]) -> Iterator[str]:
    """Yields what a terminal runs: one command after `--` or `-x`, or a text after each `-e`."""
    for at, word in enumerate(words):
        name, _, value = word.partition("=")
        if word in ("--", "-x", "-hold"):
            yield shlex.join(words[at + 1 :])
            return
        if name in ("-e", "--command") and (value or at + 1 < len(words)):
            yield value or words[at + 1]
