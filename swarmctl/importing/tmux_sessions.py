"""The sessions of tmux that a YAML file describes, as tmuxp and tmuxinator read it.

Source: tmuxp.git-pull.com, "Configuration"; github.com/tmuxinator/tmuxinator, README.
"""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator

import yaml

from swarmctl.yamltext.compose import pairs_of

_VALUE, _CODE = re.compile("<%=[^<]{0,300}?%>"), re.compile("<%[^<]{0,3000}?%>")
_CONTROL = re.compile(
    r"<%-?[ \t]{0,9}(?:(if|unless|else|elsif|end)\b[^\n<]{0,200}?|[^\n<]{0,200}?\bdo\b[^\n<]{0,50}?)%>"
)
_MOST = 2_000  # commands
_TOP = {"session_name", "name", "project_name", "root", "startup_window"}
_OF_WINDOWS = {"shell_command", "panes", "cmd", "layout", "root", "window_name", "focus", "options"}
_BEFORE = ("shell_command_before", "pre_window", "pre_tab", "pre")


def without_erb(text: str) -> str:
    """Returns the text of a session without the Ruby that tmuxinator runs in it; its values are not known."""
    text = _VALUE.sub("${TEMPLATE}", text)
    return _CODE.sub(lambda one: "\n" * one[0].count("\n"), text)


def is_session(root: yaml.Node | None) -> bool:
    """Returns True if the top of a YAML file is that of a session."""
    keys = pairs_of(root)
    windows = keys.get("windows", (None, None))[1]
    return isinstance(windows, yaml.SequenceNode) and bool(keys.keys() & _TOP)


def script_of_session(root: yaml.Node | None, text: str) -> str:
    """Returns a shell script that types each command of a session, in the line that it has in the file.

    ``text`` is that of the file: what Ruby decides is a branch.
    """
    lines = [""] * (text.count("\n") + 1)
    for match in _CONTROL.finditer(text):
        word = match[1] or "if"
        branch = {"end": "fi", "else": "else", "elsif": "else"}.get(word, "if ${TEMPLATE}; then :")
        lines[text.count("\n", 0, match.start())] = branch
    for name, (at, value) in pairs_of(_value(root, "environment")).items():
        if isinstance(value, yaml.ScalarNode):
            lines[at.start_mark.line] = f"export {name}={shlex.quote(value.value)}"
    before, left = _before(root), _MOST
    for number, window in enumerate(_items(_value(root, "windows"))):
        inside = _window(window)
        first = [*before, *_before(inside)]
        panes = _value(inside, "panes") or inside
        for which, pane in enumerate(_items(panes)):
            content = _window(pane)
            given = [*_texts(_value(content, "shell_command") or content)]
            typed = [*((one, given[0][1]) for one in first if given), *given]
            for command, line in typed:
                left -= 1
                if left < 0:
                    return "\n".join(lines)
                keys = f"tmux send-keys -t {number}.{which} {shlex.quote(command)} Enter"
                lines[line] = f"{lines[line]}; {keys}" if lines[line] else keys
    return "\n".join(lines)


def _window(node: yaml.Node) -> yaml.Node:
    """What a window or a pane has: that of tmuxinator is below its name, its only key."""
    pairs = pairs_of(node)
    if len(pairs) == 1 and not pairs.keys() & _OF_WINDOWS:
        return next(iter(pairs.values()))[1]
    return node


def _before(node: yaml.Node | None) -> list[str]:
    return [text for key in _BEFORE for text, _ in _texts(_value(node, key))]


def _value(node: yaml.Node | None, key: str) -> yaml.Node | None:
    return pairs_of(node).get(key, (None, None))[1]


def _items(node: yaml.Node | None) -> list[yaml.Node]:
    return node.value if isinstance(node, yaml.SequenceNode) else [] if node is None else [node]


def _texts(node: yaml.Node | None) -> Iterator[tuple[str, int]]:
    """The commands of a text, of a list of them, or of mappings with `cmd`, each with its line."""
    for one in _items(node):
        text = _value(one, "cmd") or one
        if isinstance(text, yaml.ScalarNode) and text.tag != "tag:yaml.org,2002:null":
            inside = text.start_mark.line + (text.style in ("|", ">"))
            for number, line in enumerate(text.value.split("\n")):
                if line.strip():
                    yield line, inside + (number if text.style == "|" else 0)
