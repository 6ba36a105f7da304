"""Reads a shell script as the commands that it runs, each with its computer and its variables.

Nothing is run. Known are constants, variables, arrays and functions of the script, `for` over lists that it
writes out, what `ssh` runs on another computer, and what tmux, byobu, screen and terminals run. What the
shell computes is unknown, with the reason. Source: bash(1), ssh(1), tmux(1); the syntax is tree-sitter's.
"""

from __future__ import annotations

import itertools
import posixpath
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cache

import tree_sitter
import tree_sitter_bash

from swarmctl.importing.command_lines import (
    LONGEST_LIST,
    SHELLS,
    TERMINALS,
    Word,
    braced,
    in_terminal,
    is_shell,
    short_options,
    unwrapped,
)
from swarmctl.ros_packages.launch_files import Place
from swarmctl.ros_packages.launch_values import Unknown

_LONGEST = 100_000  # characters of a text
_STEPS = 20_000  # commands and words of a script, with those that it calls
_TEMPLATE = re.compile(r"\{\{[^{]{0,300}?\}\}|(?<!\$)\{[%#][^{]{0,300}?[%#]\}")  # of Jinja
_NESTED = 100  # statements and words within each other
_DEPTH = 16  # scripts, functions and remote commands within each other
_VALUE = re.compile(r"\$\{(\w+)(?:\[([^\]]*)\])?(:?[-=].*)?\}", re.DOTALL)
_LAB = "$LAB"  # stands for the folder of the lab
_OWN_FOLDER = re.compile(  # $(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
    r"\$\(\s*(?:cd\s+\"?\$\(\s*)?dirname\s+[^()]*(?:BASH_SOURCE|\$0)[^()]*\)"
    r"(?:((?:/[\w.-]+)*)\"?[^()]*\bpwd[^()]*\))?",
    re.DOTALL,
)
_LENGTH = re.compile(r"\$\{#(\w+)\[[@*]\]\}")
_ESCAPED = re.compile(r"\\(\n|.)", re.DOTALL)
_ARITHMETIC = re.compile(r"\s*(\w+)\s*(?:([-+*])\s*(\w+)\s*)?")
_SSH_VALUES = "BbcDEeFIiJLlmOopQRSWw"
_MULTIPLEXERS = {"tmux", "byobu", "byobu-tmux"}
_STARTS = {
    "new-session", "new", "new-window", "neww", "split-window", "splitw", "respawn-pane", "respawnp",
    "respawn-window", "respawnw",
}  # fmt: skip
_KEYS = {"send-keys", "send"}
_TMUX_VALUES = "sntcxyeFplSLf"
_KEY = re.compile(r"(?:[CMS]-.|Enter|KPEnter|Escape|Tab|BSpace|Up|Down)")


@dataclass(frozen=True)
class Remote:
    """A computer that a script reaches by ssh. Empty texts are left out there."""

    address: str
    user: str = ""
    port: str = ""
    via: str = ""
    has_password: bool = False


@dataclass(frozen=True)
class Command:
    """A command of a script. Without ``remote`` it runs where the script does."""

    words: tuple[Word, ...]
    environment: Mapping[str, Word]  # that is exported to it
    place: Place
    remote: Remote | None
    certain: bool  # False in a branch, or in a loop that is not known here


@dataclass(frozen=True)
class Assignment:
    """A variable that a script sets."""

    name: str
    value: Word
    place: Place
    remote: Remote | None


Step = Command | Assignment


@dataclass(frozen=True)
class Script:
    """What a script does, in order, the other scripts that it runs, and whether all of it was read."""

    steps: Sequence[Step]
    others: Sequence[str]
    is_whole: bool


@cache
def _parser() -> tree_sitter.Parser:
    return tree_sitter.Parser(tree_sitter.Language(tree_sitter_bash.language()))


def read_script(path: str, texts: Mapping[str, str]) -> Script:
    """Returns what the script at ``path`` does, with those of ``texts`` that it runs."""
    run = _Run(texts)
    run.script(_Shell(run, path), path, ())
    return Script(run.steps, [one for one in run.scripts if one != path], run.is_whole)


class _Run:
    """What one script and those that it runs do."""

    def __init__(self, texts: Mapping[str, str]) -> None:
        self.texts = texts
        self.left = _STEPS
        self.steps: list[Step] = []
        self.scripts: dict[str, None] = {}
        self.running: list[str] = []  # scripts, each within the one before
        self.is_whole = True
        self.nested = 0  # statements and words within each other

    def script(self, shell: _Shell, path: str, arguments: Sequence[Word]) -> None:
        """Runs a script of the folder in a shell."""
        if path in self.running:
            return
        self.scripts[path] = None
        self.running.append(path)
        shell.path, shell.arguments, shell.line = path, list(arguments), 1
        shell.run(self.texts[path])
        shell.uncalled()
        self.running.pop()

    @contextmanager
    def within(self) -> Iterator[bool]:
        """Counts one step; gives False where a script is too long or too deep to read on."""
        self.left -= 1
        self.nested += 1
        goes_on = self.left > 0 and self.nested < _NESTED
        self.is_whole = self.is_whole and goes_on
        yield goes_on
        self.nested -= 1


@dataclass
class _Shell:
    """A shell on one computer."""

    all: _Run
    path: str
    line: int = 1  # of the text's first line in the file
    remote: Remote | None = None
    certain: bool = True
    depth: int = 0
    variables: dict[str, Word | list[Word]] = field(default_factory=dict)
    exported: set[str] = field(default_factory=set)
    functions: dict[str, tree_sitter.Node] = field(default_factory=dict)
    called: set[str] = field(default_factory=set)  # functions
    arguments: list[Word] | None = None  # of the script or the function; None if they are not known
    windows: dict[str, _Shell] = field(default_factory=dict)  # of tmux and screen
    entered: Remote | None = None  # by an ssh without a command
    opened: _Shell | None = None  # where an ssh of this window leads

    def run(self, text: str) -> None:
        """Runs a text."""
        if self.depth > _DEPTH or self.all.left <= 0:
            self.all.is_whole = False
            return
        self.all.left -= len(text) // 64
        text = _TEMPLATE.sub(lambda one: "${TEMPLATE}" if one[0].startswith("{{") else "", text)
        self.node(_parser().parse(text.encode("utf-8", "replace")).root_node)

    def inner(self, **changes: object) -> _Shell:
        """Returns a shell with copies of the variables."""
        own = {"variables": dict(self.variables), "exported": set(self.exported), "depth": self.depth + 1}
        own |= {"windows": {}, "entered": None, "opened": None}
        return replace(self, **{**own, **changes})  # type: ignore[arg-type]

    def place(self, node: tree_sitter.Node) -> Place:
        return Place(self.path, self.line + node.start_point.row)

    # Statements

    def node(self, node: tree_sitter.Node) -> None:
        with self.all.within() as goes_on:
            handler = _STATEMENTS.get(node.type)
            if not goes_on or self.depth > _DEPTH:
                return
            if handler is not None:
                handler(self, node)
            elif node.is_named and node.type not in ("comment", "heredoc_redirect", "file_redirect"):
                for child in node.named_children:
                    self.node(child)

    def subshell(self, node: tree_sitter.Node) -> None:
        inner = self.inner()
        for child in node.named_children:
            inner.node(child)

    def uncalled(self) -> None:
        """Runs the functions that nothing has called: people do, in a shell."""
        for name, body in list(self.functions.items()):
            if name not in self.called:
                self.called.add(name)
                self.inner(certain=False, arguments=None).node(body)

    def branch(self, node: tree_sitter.Node) -> None:
        certain, self.certain = self.certain, False
        for child in node.named_children:
            self.node(child)
        self.certain = certain

    def while_loop(self, node: tree_sitter.Node) -> None:
        """A loop, unless it reads the options of the script: without any its values are the defaults."""
        test = node.child_by_field_name("condition")
        if test is None or not re.search(r"\$#|\$1\b|getopts", _text(test)):
            self.branch(node)

    def function(self, node: tree_sitter.Node) -> None:
        name, body = node.child_by_field_name("name"), node.child_by_field_name("body")
        if name is not None and body is not None:
            self.functions[_text(name)] = body

    def loop(self, node: tree_sitter.Node) -> None:
        name, body = node.child_by_field_name("variable"), node.child_by_field_name("body")
        if name is None or body is None:
            return
        values: list[Word] = []
        for child in node.named_children:
            if child not in (name, body):
                values += self.words(child)
        self.repeat(_text(name), values, body)

    def counted_loop(self, node: tree_sitter.Node) -> None:
        """A `for ((i=0; i<3; i++))`, whose header counts up by one."""
        body = node.child_by_field_name("body")
        if body is None:
            return
        header = _text(node)[: body.start_byte - node.start_byte]
        match = re.match(r"for\s*\(\(\s*(\w+)\s*=\s*(\w+)\s*;\s*\1\s*(<=?)\s*\$?(\w+)\s*;\s*\+*\1", header)
        first, last = (self.number(match[2]), self.number(match[4])) if match else (None, None)
        if match is None or first is None or last is None:
            self.repeat("", [Unknown("a loop that counts")], body)
            return
        count = range(first, last + (match[3] == "<="))
        self.repeat(match[1], [str(one) for one in count[:LONGEST_LIST]], body)

    def repeat(self, name: str, values: Sequence[Word], body: tree_sitter.Node) -> None:
        for value in values[:LONGEST_LIST]:
            certain, self.certain = self.certain, self.certain and not isinstance(value, Unknown)
            self.variables[name] = value
            self.node(body)
            self.certain = certain

    def redirected(self, node: tree_sitter.Node) -> None:
        """A command with what it reads: a text that is written out, or a script of the folder."""
        body = node.child_by_field_name("body")
        if body is None:
            return
        self.entered = None
        self.node(body)
        if (there := self.entered) is None:
            return
        shell = self.there(there)
        for child in node.named_children:
            if child.type == "heredoc_redirect":
                text = next((one for one in child.named_children if one.type == "heredoc_body"), None)
                if text is not None:
                    shell.line = self.line + text.start_point.row
                    shell.run(self.heredoc(child, text))
                    self.entered = None
            elif child.type == "file_redirect" and _text(child).startswith("<"):
                words = self.words(child.named_children[-1])
                path = self.of_folder(words[0]) if words and isinstance(words[0], str) else ""
                if path:
                    self.all.script(shell, path, ())
                    self.entered = None

    def heredoc(self, node: tree_sitter.Node, body: tree_sitter.Node) -> str:
        """The text of a here-document, with the variables of this shell unless its mark is quoted."""
        start = next((_text(one) for one in node.named_children if one.type == "heredoc_start"), "")
        if start[:1] in "'\"\\":
            return _text(body)

        def value(match: re.Match[str]) -> str:
            found = self.variables.get(match[1] or match[2])
            return found if isinstance(found, str) else match[0]

        return re.sub(r"(?<!\\)\$(?:(\w+)|\{(\w+)\})", value, _text(body))

    # Variables

    def assignment(self, node: tree_sitter.Node) -> None:
        name, value = self.assigned(node)
        if name:
            self.set(name, value, node)

    def assigned(self, node: tree_sitter.Node) -> tuple[str, Word | list[Word]]:
        name, value = node.child_by_field_name("name"), node.child_by_field_name("value")
        if name is None or name.type != "variable_name":
            return "", ""
        if value is None:
            return _text(name), ""
        if value.type == "array":
            return _text(name), [one for child in value.named_children for one in self.words(child)][
                :LONGEST_LIST
            ]
        return _text(name), self.joined(value)

    def set(self, name: str, value: Word | list[Word], node: tree_sitter.Node) -> None:
        if not isinstance(value, list):
            self.all.steps.append(Assignment(name, _in_folder(value), self.place(node), self.remote))
        before = self.variables.get(name)
        if not self.certain and before is not None and before != value:
            value = Unknown(f"{name}, which a branch sets")
        self.variables[name] = value

    def declaration(self, node: tree_sitter.Node) -> None:
        exports = _text(node).split(None, 1)[0] in ("export", "declare", "typeset")
        for child in node.named_children:
            if child.type == "variable_assignment":
                self.assignment(child)
                name = child.child_by_field_name("name")
                self.exported |= {_text(name)} if exports and name is not None else set()
            elif child.type == "variable_name" and exports:
                self.exported.add(_text(child))

    def unset(self, node: tree_sitter.Node) -> None:
        for child in node.named_children:
            self.variables.pop(_text(child), None)

    # Words

    def joined(self, node: tree_sitter.Node) -> Word:
        """The words of a node as one."""
        words = self.words(node)
        return next((one for one in words if isinstance(one, Unknown)), None) or " ".join(map(str, words))

    def words(self, node: tree_sitter.Node) -> list[Word]:
        """The words that a part of a command becomes."""
        with self.all.within() as goes_on:
            if goes_on and (read := _WORDS.get(node.type)) is not None:
                return read(self, node)
        return [Unknown(f"`{_text(node)[:60]}`")]

    def literal(self, node: tree_sitter.Node) -> list[Word]:
        text = _text(node)
        return [text[2:-1] if text.startswith("$") else text[1:-1]]

    def plain(self, node: tree_sitter.Node) -> list[Word]:
        return braced(_ESCAPED.sub(lambda one: "" if one[1] == "\n" else one[1], _text(node)))

    def split(self, node: tree_sitter.Node) -> list[Word]:
        """The words of a value without quotes."""
        found = self.expansion(node)
        if isinstance(found, list):
            return found
        return [*found.split()] if isinstance(found, str) else [found]

    def concatenated(self, node: tree_sitter.Node) -> list[Word]:
        parts: list[str] = []
        for child in node.children:
            part = _text(child) if child.type == "brace_expression" else self.joined(child)
            if isinstance(part, Unknown):
                return [_behind("".join(parts), part)]
            parts.append(part)
        is_quoted = any(one.type in ("string", "raw_string") for one in node.children)
        return ["".join(parts)] if is_quoted else braced("".join(parts))

    def computed(self, node: tree_sitter.Node) -> list[Word]:
        text = _text(node)
        value = self.arithmetic(text.removeprefix("$((").removesuffix("))"))
        return [Unknown(f"`{text[:60]}`") if value is None else str(value)]

    def quoted(self, node: tree_sitter.Node) -> list[Word]:
        """The one word in double quotes; several for an array."""
        inside = node.named_children
        if len(inside) == 1 and inside[0].type == "expansion" and _text(node)[1:-1] == _text(inside[0]):
            found = self.expansion(inside[0])
            return found if isinstance(found, list) else [found]
        content, parts, at = node.text or b"", list[str](), node.start_byte + 1
        for child in inside:
            parts.append(_unescaped(content[at - node.start_byte : child.start_byte - node.start_byte]))
            at = child.end_byte
            if child.type == "string_content":
                parts.append(_unescaped(child.text or b""))
                continue
            value = self.joined(child)
            if isinstance(value, Unknown):
                return [_behind("".join(parts), value)]
            parts.append(value)
        parts.append(_unescaped(content[at - node.start_byte : -1]))
        text = "".join(parts)
        return [text if len(text) <= _LONGEST else Unknown("a long text")]

    def expansion(self, node: tree_sitter.Node) -> Word | list[Word]:
        """The value of `$NAME` or `${NAME}`."""
        text = _text(node)
        if node.type == "simple_expansion":
            return self.value(text[1:], text)
        match = _VALUE.fullmatch(text)
        counted = _LENGTH.fullmatch(text)
        if counted and isinstance(items := self.variables.get(counted[1]), list):
            return str(len(items))
        if match is None:
            return Unknown(f"`{text[:60]}`")
        name, index, operator = match.groups()
        if index is None:
            found = self.value(name, text)
            return Unknown(f"`{text[:60]}`") if operator and isinstance(found, Unknown) else found
        values = self.variables.get(name)
        if not isinstance(values, list):
            return Unknown(f"`{text}`")
        if index in "@*":
            return values
        at = self.arithmetic(index.removeprefix("$((").removesuffix("))"))
        return values[at] if at is not None and -len(values) <= at < len(values) else Unknown(f"`{text}`")

    def value(self, name: str, text: str) -> Word | list[Word]:
        if name in ("@", "*"):
            return Unknown(f"`{text}`") if self.arguments is None else list(self.arguments)
        if name.isdecimal() and self.arguments is not None and 0 < int(name[:4]) <= len(self.arguments):
            return self.arguments[int(name[:4]) - 1]
        found = self.variables.get(name)
        if name == "TEMPLATE" and found is None:
            return Unknown("a template")
        if isinstance(found, list):
            return found[0] if found else ""
        return Unknown(f"the variable `{text}`") if found is None else found

    def number(self, text: str) -> int | None:
        """A number, or that of a variable."""
        found = text if re.fullmatch(r"-?\d{1,9}", text) else self.variables.get(text)
        return int(found) if isinstance(found, str) and re.fullmatch(r"-?\d{1,9}", found) else None

    def arithmetic(self, text: str) -> int | None:
        match = _ARITHMETIC.fullmatch(text.replace("$", ""))
        left, right = (self.number(match[1]), self.number(match[3] or "0")) if match else (None, None)
        if match is None or left is None or right is None:
            return None
        return left * right if match[2] == "*" else left - right if match[2] == "-" else left + right

    def substituted(self, node: tree_sitter.Node) -> list[Word]:
        """The words that a command prints: those of `seq` and `echo`, and the folder of the script."""
        inside = node.named_children
        if self.remote is None and (match := _OWN_FOLDER.fullmatch(_text(node))):
            folder = posixpath.join(posixpath.dirname(self.path), f".{match[1] or ''}")
            return [posixpath.join(_LAB, posixpath.normpath(folder))]
        if len(inside) == 1 and inside[0].type == "command":
            name, *words = self.command_words(inside[0])
            numbers = [self.number(one) if isinstance(one, str) else None for one in words]
            if name == "seq" and 0 < len(numbers) < 4 and None not in numbers:
                first = numbers[0] if len(numbers) > 1 else 1
                step = numbers[1] if len(numbers) > 2 else 1
                if first is not None and step and numbers[-1] is not None:
                    end = numbers[-1] + (1 if step > 0 else -1)
                    return [str(one) for one in range(first, end, step)[:LONGEST_LIST]]
            if name == "echo":
                return list(words)
        return [Unknown(f"`{_text(node)[:60]}`")]

    # Commands

    def command_words(self, node: tree_sitter.Node) -> list[Word]:
        found: list[Word] = []
        for child in node.named_children:
            if child.type == "command_name":
                found += self.words(child.named_children[0]) if child.named_children else [_text(child)]
            elif child.type not in (
                "variable_assignment",
                "file_redirect",
                "heredoc_redirect",
                "herestring_redirect",
            ):
                found += self.words(child)
        return found or [""]

    def command(self, node: tree_sitter.Node) -> None:
        environment = {name: self.variables[name] for name in self.exported if name in self.variables}
        for child in node.named_children:
            if child.type == "variable_assignment":
                name, value = self.assigned(child)
                environment[name] = value
                if not isinstance(value, list):
                    self.all.steps.append(Assignment(name, _in_folder(value), self.place(child), self.remote))
        flat = {name: one for name, one in environment.items() if not isinstance(one, list)}
        words = node.named_children or [node]
        text = next((one for one in words if one.end_point.row > one.start_point.row), words[-1])
        self.words_run(tuple(self.command_words(node)), flat, node, self.line + text.start_point.row)

    def words_run(
        self, words: tuple[Word, ...], environment: dict[str, Word], node: tree_sitter.Node, line: int
    ) -> None:
        """Runs a command: as far as it runs others, these."""
        words, own, has_password = unwrapped(words)
        environment |= own
        if not words:
            return
        name, *rest = words
        texts = [one if isinstance(one, str) else "" for one in rest]
        program = posixpath.basename(name) if isinstance(name, str) else ""
        if isinstance(name, str) and name in self.functions and self.depth < _DEPTH:
            inner = replace(
                self, arguments=rest, depth=self.depth + 1
            )  # its variables are those of the shell
            self.called.add(name)
            inner.node(self.functions[name])
        elif (
            program in ("source", ".")
            or program in SHELLS
            or (isinstance(name, str) and self.of_folder(name))
        ):
            self.script_run(program, [*words], environment, node, line)
        elif program == "eval" and texts:
            replace(self, line=line, depth=self.depth + 1).run(" ".join(texts))
        elif program == "ssh":
            self.ssh(rest, node, line, has_password=has_password)
        elif program in _MULTIPLEXERS:
            self.tmux(rest, line)
        elif program == "screen":
            self.screen(texts, line)
        elif program in TERMINALS:
            for one in in_terminal(texts):
                self.inner(line=line).run(one)
        else:
            self.all.steps.append(Command(words, environment, self.place(node), self.remote, self.certain))

    def script_run(
        self, program: str, words: list[Word], environment: dict[str, Word], node: tree_sitter.Node, line: int
    ) -> None:
        """Runs a script of the folder, here or in a shell of its own, or a text after `-c`."""
        is_here = program in ("source", ".")
        if words == [program]:  # a shell for a person
            return
        rest = words[1:] if is_here or program in SHELLS else words
        shell = self if is_here else self.inner()
        shell = shell if is_here else replace(shell, variables={**shell.variables, **environment})
        if not is_here and rest and isinstance(rest[0], str) and re.fullmatch(r"-\w*c", rest[0]):
            if len(rest) > 1 and isinstance(rest[1], str):
                replace(shell, line=line).run(rest[1])
            return
        rest = [one for one in rest if not (isinstance(one, str) and one.startswith("-"))]
        path = self.of_folder(rest[0]) if rest and isinstance(rest[0], str) and self.remote is None else ""
        if path and self.depth < _DEPTH:
            back = (self.path, self.line, self.arguments)
            self.all.script(shell, path, rest[1:])
            self.path, self.line, self.arguments = back
            return
        self.all.steps.append(Command(tuple(words), environment, self.place(node), self.remote, self.certain))

    def of_folder(self, path: str) -> str:
        """The script of the folder that a path means; empty if there is none."""
        name = posixpath.basename(path)
        if "/" not in path and not name.endswith((".sh", ".bash", ".zsh", ".env")):
            return ""
        beside = posixpath.normpath(posixpath.join(posixpath.dirname(self.path), path))
        ends = [one for one in self.all.texts if one == beside or path.endswith(f"/{one}")]
        return max(ends, key=len, default="") if not path.startswith("/opt/") else ""

    def ssh(self, words: Sequence[Word], node: tree_sitter.Node, line: int, *, has_password: bool) -> None:
        """Runs on another computer what follows its name; without a command, what is typed next."""
        options, rest = short_options(words, _SSH_VALUES)
        target, *command = rest or [Unknown("no computer")]
        user, _, address = target.rpartition("@") if isinstance(target, str) else ("", "", "")
        if match := re.fullmatch(r"ssh://(?:([^@/]+)@)?([^:/]+)(?::(\d+))?/?", str(target)):
            user, address, options["p"] = match[1] or "", match[2], match[3] or options.get("p", "")
        known = [options.get(one, "") for one in "lpJ"]
        if not isinstance(target, str) or any(isinstance(one, Unknown) for one in known):
            self.all.steps.append(Command(("ssh", *words), {}, self.place(node), self.remote, self.certain))
            return
        there = Remote(address, str(known[0]) or user, str(known[1]), str(known[2]), has_password)
        self.all.steps.append(Command(("ssh",), {}, self.place(node), there, self.certain))
        if not command or is_shell(command):
            self.entered = there
            return
        if any(isinstance(one, Unknown) for one in command):
            self.all.steps.append(Command(tuple(command), {}, self.place(node), there, self.certain))
            return
        shell = self.there(there)
        shell.line = line
        shell.run(" ".join(map(str, command)))

    def there(self, remote: Remote) -> _Shell:
        """A shell on another computer, which has no variable of this one."""
        return _Shell(self.all, self.path, self.line, remote, self.certain, self.depth + 1)

    def tmux(self, words: Sequence[Word], line: int) -> None:
        """Runs the commands of windows and panes, and what is typed into them."""
        for is_end, group in itertools.groupby(words, lambda one: one == ";"):
            _, rest = short_options([*group], "fLST") if not is_end else ({}, [])
            verb, *others = rest or [""]
            options, inside = short_options(others, _TMUX_VALUES)
            texts = [one for one in inside if isinstance(one, str)]
            if verb in _STARTS and texts:
                self.window(str(options.get("t", ""))).typed(" ".join(texts), line)
            elif verb in _KEYS:
                typed = "".join(" " if one == "Space" else one for one in texts if not _KEY.fullmatch(one))
                if len(texts) < len(inside):
                    why = next(one for one in inside if isinstance(one, Unknown))
                    words = (verb, why) if isinstance(verb, str) else (why,)
                    self.all.steps.append(Command(words, {}, Place(self.path, line), self.remote, False))
                elif typed:
                    self.window(str(options.get("t", ""))).typed(typed, line)

    def screen(self, words: Sequence[str], line: int) -> None:
        options, rest = short_options(words, "cehpsSTtX")
        if options.get("X") == "stuff" and rest:
            name = str(options.get("S", ""))
            self.window(name).typed(str(rest[0]).replace("\\n", "\n").rstrip("\n").removesuffix("^M"), line)
        elif rest:
            self.window(str(options.get("S", ""))).typed(" ".join(map(str, rest)), line)

    def window(self, name: str) -> _Shell:
        """The shell in a window, which remembers what was typed into it."""
        if name not in self.windows:
            self.windows[name] = self.inner()
        return self.windows[name]

    def typed(self, text: str, line: int) -> None:
        """Runs a line that is typed into this shell, or into the one that ssh has opened in it."""
        if self.entered is not None:
            there, self.entered = self.entered, None
            self.opened = self.there(there)
        shell = self.opened or self
        shell.line = line
        if shell is not self:
            shell.typed(text, line)
        else:
            shell.run(text)


_STATEMENTS: Mapping[str, Callable[[_Shell, tree_sitter.Node], None]] = {
    "command": _Shell.command, "declaration_command": _Shell.declaration, "unset_command": _Shell.unset,
    "variable_assignment": _Shell.assignment, "function_definition": _Shell.function,
    "for_statement": _Shell.loop, "c_style_for_statement": _Shell.counted_loop, "subshell": _Shell.subshell,
    "if_statement": _Shell.branch, "case_statement": _Shell.branch, "while_statement": _Shell.while_loop,
    "redirected_statement": _Shell.redirected,
}  # fmt: skip

_WORDS: Mapping[str, Callable[[_Shell, tree_sitter.Node], list[Word]]] = {
    **dict.fromkeys(("raw_string", "ansi_c_string"), _Shell.literal),
    **dict.fromkeys(("word", "number", "brace_expression"), _Shell.plain),
    **dict.fromkeys(("string", "translated_string"), _Shell.quoted),
    **dict.fromkeys(("simple_expansion", "expansion"), _Shell.split),
    "concatenation": _Shell.concatenated,
    "command_substitution": _Shell.substituted,
    "arithmetic_expansion": _Shell.computed,
}


def _behind(text: str, value: Unknown) -> Unknown:
    return replace(value, before=text + value.before)


def _in_folder(value: Word) -> Word:
    """A value with paths from the folder of the lab, not from the script."""
    return value.replace(f"{_LAB}/", "") if isinstance(value, str) else value


def _text(node: tree_sitter.Node) -> str:
    return (node.text or b"").decode("utf-8", "replace")


def _unescaped(text: bytes) -> str:
    """Text between double quotes, as bash reads it."""
    return re.sub(r'\\(["$`\\\n])', lambda one: one[1].strip("\n"), text.decode("utf-8", "replace"))
