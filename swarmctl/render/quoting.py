"""One Jinja environment per output format. Template text is trusted; values become literals of the format.

The escaping rules: what cannot be written safely in a format is rejected, never altered.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any

from swarmctl import resources
from swarmctl.ros_packages.launch_files import FIND

if TYPE_CHECKING:
    import jinja2

_CONTROL = re.compile(r"[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufffe\uffff]")
_WORD = re.compile(r"[A-Za-z0-9:._/@%+=,-]+", re.ASCII)
_YAML_WORD = re.compile(
    r"(?!(?:true|false|null|yes|no|on|off|y|n)$)[a-z][a-z0-9-]*|[0-9]+(?:\.[0-9]+){3}",
    re.ASCII | re.IGNORECASE,
)
_REFERENCES = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", "\n": "&#10;", "\r": "&#13;", "\t": "&#9;"}
)
_BARE_UNIT = re.compile(r"[A-Za-z0-9:._/@+=,~-]+", re.ASCII)


class UnsafeValueError(ValueError):
    """A value that cannot stand in a file of this format."""


def _plain(value: Any, spaces: str = "") -> str:
    """The text of a value that may be written at all: one line, no control characters but ``spaces``."""
    text = ("true" if value else "false") if isinstance(value, bool) else str(value)
    if not text.isprintable() and _CONTROL.search(text.translate(dict.fromkeys(map(ord, spaces)))):
        raise UnsafeValueError(f"{text!r} holds control characters")
    return text


def _fitting(value: Any, pattern: str, complaint: str) -> str:
    """The text of a value that needs no escaping, or a complaint that it does."""
    text = _plain(value)
    if not re.fullmatch(pattern, text, re.ASCII):
        raise UnsafeValueError(f"{text!r} {complaint}")
    return text


def shell(value: Any) -> str:
    """Returns one word of a POSIX shell."""
    text = _plain(value)
    return text if _WORD.fullmatch(text) and "=" not in text else "'" + text.replace("'", "'\"'\"'") + "'"


def systemd(value: Any) -> str:
    """Returns one word of a unit's command: ``%`` and ``$`` doubled, quoted unless plain.

    Source: systemd.service(5). Raises ``UnsafeValueError``.
    """
    text = _plain(value)
    if _BARE_UNIT.fullmatch(text):
        return text
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("%", "%%").replace("$", "$$")
    return f'"{escaped}"'


def sentence(value: Any) -> str:
    """Returns free text for the end of a unit file's line, with ``%`` escaped.

    Raises ``UnsafeValueError`` for control characters and a trailing backslash.
    """
    text = _plain(value).replace("%", "%%")
    if text.endswith("\\"):
        raise UnsafeValueError(f"{text!r} would join the next line")
    return text


def variable(value: Any) -> str:
    """Returns the name of an environment variable."""
    return _fitting(value, r"[A-Za-z_][A-Za-z0-9_]*", "is not a name of an environment variable")


def environment_file(value: Any) -> str:
    """Returns a value of systemd's EnvironmentFile=, which a POSIX shell reads alike."""
    text = _plain(value)
    for char in '\\"$`':
        text = text.replace(char, "\\" + char)
    return f'"{text}"'


def xml(value: Any) -> str:
    """Returns an attribute of a roslaunch file with its quotes; line ends and tabs are references.

    `$(find PACKAGE)` is the folder of a package to roslaunch. Raises ``UnsafeValueError`` for other
    substitutions, which cannot be escaped.
    """
    text = _plain(value, spaces="\n\t")
    if "$(" in FIND.sub("", text):
        raise UnsafeValueError(f"{text!r} would be substituted by roslaunch")
    written = text.translate(_REFERENCES)
    if '"' in written and "'" not in written:
        return f"'{written}'"
    return '"' + written.replace('"', "&quot;") + '"'


def launch_xml(value: Any) -> str:
    """Returns an attribute of an XML file of ROS 2 with its quotes.

    `$(find PACKAGE)` becomes what ros2 launch calls it. Raises ``UnsafeValueError`` for other substitutions.
    """
    return xml(value).replace("$(find ", "$(find-pkg-share ")


def word(value: Any) -> str:
    """Returns a name that needs no quoting in any format: of a package, of a file."""
    return _fitting(value, r"[A-Za-z0-9_][A-Za-z0-9_.-]*", "is not a plain name")


def path(value: Any) -> str:
    """Returns a relative path that needs no quoting in any format."""
    part = r"[A-Za-z0-9_][A-Za-z0-9_.+-]*"
    return _fitting(value, f"{part}(/{part})*", "is not a plain path")


def element(value: Any) -> str:
    """Returns the text of an element of XML that needs no escaping: names, patterns of names, addresses."""
    return _fitting(value, r"[A-Za-z0-9_/=*.:-]+", "cannot stand in an element")


def udev(value: Any) -> str:
    """Returns a value between quotes in a udev rule; only what needs no escaping passes."""
    return _fitting(value, r"[A-Za-z0-9:._/+=@,#&() -]*", "cannot stand in a udev rule")


def hosts(value: Any) -> str:
    """Returns an address or a name in /etc/hosts."""
    return _fitting(value, r"[A-Za-z0-9:.-]+", "cannot stand in /etc/hosts")


def chrony(value: Any) -> str:
    """Returns a name, an address or a subnet in chrony.conf."""
    return _fitting(value, r"[A-Za-z0-9:./-]+", "cannot stand in chrony.conf")


def nft(value: Any) -> str:
    """Returns a number, an address, a name or a range of nft(8), which need no quotes."""
    return _fitting(value, r"[$]?[A-Za-z0-9_.:/-]+", "cannot stand in rules of nft")


def section(value: Any) -> str:
    """Returns the name of a section of a key file, such as NetworkManager reads."""
    return _fitting(value, r"[A-Za-z0-9.-]+", "cannot be the name of a section")


def scalar(value: Any) -> str:
    """Returns a scalar that YAML 1.1 and 1.2 read alike: names, addresses and numbers bare, others in quotes.

    Raises ``UnsafeValueError``.
    """
    if isinstance(value, float):
        if not math.isfinite(value):
            raise UnsafeValueError(f"{value} is not a number that a file may hold")
        return re.sub(r"^(-?[0-9]+)e", r"\1.0e", repr(value))  # YAML 1.1 wants the dot
    text = _plain(value)
    bare = isinstance(value, (bool, int)) or _YAML_WORD.fullmatch(text)
    return text if bare else json.dumps(text, ensure_ascii=False)


def c(value: Any) -> str:
    """Returns a literal of C and C++, with escaped bytes beyond ASCII. Raises ``UnsafeValueError``."""
    if isinstance(value, (bool, int)):
        return _plain(value)
    if isinstance(value, float):
        if not math.isfinite(value):
            raise UnsafeValueError(f"{value} is not a valid C literal")
        return f"{value!r}f"
    escaped = "".join(
        chr(byte) if 0x20 <= byte < 0x7F and byte not in b'\\"?' else f"\\{byte:03o}"
        for byte in _plain(value).encode()
    )
    return f'"{escaped}"'


# Which literal a template's values become, by the ending of the template's name.
LITERALS: dict[str, Callable[[Any], str]] = {
    ".service": systemd,
    ".target": systemd,
    ".env": environment_file,
    ".bash": shell,
    ".launch": xml,
    ".urdf": xml,
    ".xml": launch_xml,
    ".rules": udev,
    ".hosts": hosts,
    ".chrony": chrony,
    ".conf": section,
    ".nft": nft,
    ".yaml": scalar,
    ".h": c,
}


def render(template: str, **values: Any) -> bytes:
    """The text of ``templates/*/<template>.j2`` with ``values`` as literals of its format."""
    return _template(template).render(values).encode()


@cache
def _template(name: str) -> jinja2.Template:
    return _environment(name[name.rindex(".") :]).get_template(f"{name}.j2")


@cache
def _environment(ending: str) -> jinja2.Environment:
    import jinja2  # noqa: PLC0415  (`validate` renders nothing)

    root = resources.templates()
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader([root / "os", root / "ros", root / "ros1", root / "project", root]),
        undefined=jinja2.StrictUndefined,
        finalize=_finalize(LITERALS[ending], jinja2.Undefined),
        keep_trailing_newline=True,
        trim_blocks=True,
        lstrip_blocks=True,
        autoescape=False,
        auto_reload=False,  # templates stay as they are
    )
    environment.filters["sentence"] = lambda value: _Literal(sentence(value))
    environment.filters["name"] = lambda value: _Literal(variable(value))
    environment.filters["word"] = lambda value: _Literal(word(value))
    environment.filters["element"] = lambda value: _Literal(element(value))
    environment.filters["path"] = lambda value: _Literal(path(value))
    return environment


class _Literal(str):
    """Text that is already a literal of its format."""

    __slots__ = ()


def _finalize(literal: Callable[[Any], str], undefined: type) -> Callable[[Any], Any]:
    of_text = lru_cache(maxsize=1 << 14)(literal)  # most values stand in many files

    def finalize(value: Any) -> Any:
        if type(value) is str:
            return of_text(value)
        if isinstance(value, (undefined, _Literal)):
            return value
        return literal(value)

    return finalize
