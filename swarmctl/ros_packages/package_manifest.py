"""What catkin requires of a package.xml (REP 127, 140, 149; catkin_pkg/package.py, `parse_package_string`).

One package whose manifest it refuses ends `rosrun`, `roslaunch` and a build for all packages of a workspace.
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Iterator, Mapping

from swarmctl.ros_packages.xml_tags import Tag

_VERSION = re.compile(r"[0-9]+\.[0-9]+\.[0-9]+")
_EMAIL = re.compile(
    r"[-a-zA-Z0-9_%+]+(\.[-a-zA-Z0-9_%+]+)*@[-a-zA-Z0-9%]+(\.[-a-zA-Z0-9%]+)*\.[a-zA-Z]{2,}", re.ASCII
)
_ONE = ("name", "version", "description")
_BOUNDS = ("version_lt", "version_lte", "version_eq", "version_gte", "version_gt")
_DEPENDS_SINCE = {  # by the format that brought the tag
    1: ("build_depend", "buildtool_depend", "test_depend", "conflict", "replace"),
    2: ("build_export_depend", "buildtool_export_depend", "depend", "exec_depend", "doc_depend"),
}
_INCLUDED_1 = {"test_depend": ("build_depend", "run_depend")}
_INCLUDED = {"depend": ("build_depend", "build_export_depend", "exec_depend")}
_ON_OTHERS = ("build_depend", "buildtool_depend", "test_depend", "run_depend", *_DEPENDS_SINCE[2])
_PARTS = ("description", "export")  # the tags with tags of their own


def faults_of(root: Tag) -> Iterator[str]:
    """Yields why catkin refuses a package.xml, in words that follow on "its package.xml"."""
    given = root.attributes.get("format", "1").strip()
    if given not in ("1", "2", "3"):
        yield f"has the format {given!r}; it must be 1, 2 or 3"
        return
    for name in _ONE:
        count = sum(tag.name == name for tag in root.children)
        if count != 1:
            yield f"has {count or 'no'} <{name}>; it must have one"
            return
    yield from _of_texts(root.children)
    yield from _of_attributes(root, ("format",))
    known = _known(int(given))
    for tag in root.children:
        if tag.name not in known:
            yield f"has <{tag.name}> in line {tag.line}, which format {given} does not know"
            continue
        yield from _of_attributes(tag, known[tag.name])
        if tag.children and tag.name not in _PARTS:
            yield f"has <{tag.name}> in line {tag.line}, which must not have tags of its own"
    if sum(tag.name == "export" for tag in root.children) > 1:
        yield "has more than one <export>"
    yield from _of_depends(root.children, _INCLUDED_1 if given == "1" else _INCLUDED)


def _of_attributes(tag: Tag, known: Collection[str]) -> Iterator[str]:
    for name in tag.attributes:
        if name not in (*known, "xmlns") and ":" not in name:
            yield f"has <{tag.name}> in line {tag.line} with the unknown attribute {name!r}"


def _of_texts(tags: Collection[Tag]) -> Iterator[str]:
    for tag in tags:
        text, place = tag.text.strip(), f"in line {tag.line}"
        if tag.name == "version" and not _VERSION.fullmatch(text):
            yield f"has the version {text!r} {place}; it must be three numbers, such as 1.0.0"
        if tag.name == "version" and not _VERSION.fullmatch(tag.attributes.get("compatibility", "0.0.0")):
            yield f"has a `compatibility` {place} that is not a version, such as 1.0.0"
        if tag.name == "description" and not text and not tag.children:
            yield f"has an empty <description> {place}"
        if tag.name == "license" and not text:
            yield f"has an empty <license> {place}"
        email = tag.attributes.get("email")
        if tag.name == "maintainer" and not email:
            yield f"has a <maintainer> {place} without `email`"
        elif tag.name in ("maintainer", "author") and email is not None and not _EMAIL.fullmatch(email):
            yield f"has the email {email!r} {place}, which catkin does not take for one"
    for name in ("maintainer", "license"):
        if not any(tag.name == name for tag in tags):
            yield f"has no <{name}>"


def _of_depends(tags: Collection[Tag], included: Mapping[str, Collection[str]]) -> Iterator[str]:
    """A package that depends on itself, or twice on another: by a tag and by one that it includes."""
    own = next((tag.text.strip() for tag in tags if tag.name == "name"), "")
    seen = {(tag.name, _dependency(tag)) for tag in tags}
    for tag in tags:
        if tag.name in _ON_OTHERS and tag.text.strip() == own:
            yield f"has <{tag.name}> in line {tag.line} on the package itself"
        for name in included.get(tag.name, ()):
            if (name, _dependency(tag)) in seen:
                yield f"has <{tag.name}> in line {tag.line} and <{name}> on {tag.text.strip()}; keep one"


def _dependency(tag: Tag) -> tuple[str | None, ...]:
    return (tag.text.strip(), *(tag.attributes.get(name) for name in (*_BOUNDS, "condition")))


def _known(given: int) -> Mapping[str, Collection[str]]:
    """The tags of a format, with their attributes."""
    of_depends = (*_BOUNDS, *(("condition",) if given > 2 else ()))
    known: dict[str, Collection[str]] = dict.fromkeys((*_ONE, "export"), ())
    known |= {"version": ("compatibility",), "license": ("file",) if given > 2 else ()}
    known |= {"maintainer": ("email",), "author": ("email",), "url": ("type",)}
    known |= dict.fromkeys(_DEPENDS_SINCE[1], of_depends)
    known |= dict.fromkeys(_DEPENDS_SINCE[2], of_depends) if given > 1 else {"run_depend": of_depends}
    if given > 2:
        known |= dict.fromkeys(("group_depend", "member_of_group"), ("condition",))
    return known


#: What every host has; any other variable but _OF_THE_HOST is not set there, so it is empty.
VARIABLES: Mapping[str, str] = {"ROS_VERSION": "1", "ROS_PYTHON_VERSION": "3"}
_OF_THE_HOST = "$ROS_DISTRO"
_TOKEN = re.compile(r"""\s*(?:(\(|\)|==|!=|<=|>=|<|>)|"([^"]*)"|'([^']*)'|([\w$.-]+))""")
_COMPARE: Mapping[str, Callable[[str, str], bool]] = {
    "==": operator.eq, "!=": operator.ne, "<=": operator.le, ">=": operator.ge, "<": operator.lt,
    ">": operator.gt,
}  # fmt: skip
_DEEPEST = 20  # parentheses


def holds(condition: str) -> bool:
    """Returns whether ``condition`` is met.

    One that REP 149 does not allow, or that depends on the distribution of ROS, counts as met.
    """
    try:
        tokens = _Tokens(condition)
        met = _any_of(tokens, 0)
        return met or not tokens.at_end
    except ValueError:
        return True


class _Tokens:
    """The words of a condition, each as its text and whether it stands in quotes."""

    def __init__(self, text: str) -> None:
        self._rest = list(_tokens(text.rstrip()))[::-1]

    @property
    def at_end(self) -> bool:
        return not self._rest

    def take(self) -> tuple[str, bool]:
        if not self._rest:
            raise ValueError("the condition ends too early")
        return self._rest.pop()

    def skip(self, word: str) -> bool:
        """Takes the next word if it is ``word``, without quotes; returns whether it was."""
        found = bool(self._rest) and self._rest[-1] == (word, False)
        if found:
            self._rest.pop()
        return found


def _tokens(text: str) -> Iterator[tuple[str, bool]]:
    at = 0
    while at < len(text):
        found = _TOKEN.match(text, at)
        if found is None:
            raise ValueError("not a condition")
        quoted = found[2] if found[2] is not None else found[3]
        yield (quoted, True) if quoted is not None else (found[1] or found[4], False)
        at = found.end()


def _any_of(tokens: _Tokens, depth: int) -> bool:
    met = _all_of(tokens, depth)
    while tokens.skip("or"):
        met = _all_of(tokens, depth) or met
    return met


def _all_of(tokens: _Tokens, depth: int) -> bool:
    met = _one(tokens, depth)
    while tokens.skip("and"):
        met = _one(tokens, depth) and met
    return met


def _one(tokens: _Tokens, depth: int) -> bool:
    if depth < _DEEPEST and tokens.skip("("):
        met = _any_of(tokens, depth + 1)
        if not tokens.skip(")"):
            raise ValueError("a parenthesis is open")
        return met
    left, (symbol, quoted), right = _value(tokens), tokens.take(), _value(tokens)
    if quoted or symbol not in _COMPARE:
        raise ValueError("no comparison")
    return _COMPARE[symbol](left, right)


def _value(tokens: _Tokens) -> str:
    text, quoted = tokens.take()
    if not quoted and (text in _COMPARE or text in "()" or text == _OF_THE_HOST):
        raise ValueError("no value, or one that is not known")
    return VARIABLES.get(text[1:], "") if not quoted and text.startswith("$") else text
