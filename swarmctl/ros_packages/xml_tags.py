"""XML of ROS packages as tags with positions, without entities, which could grow without bound."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import NoReturn
from xml.parsers import expat

MAX_TAGS = 20_000
MAX_DEPTH = 32
MAX_NAME = 100  # characters
_NOT_XML = "it is not well-formed XML"


class XmlError(ValueError):
    """A file that ROS cannot read; ``line`` counts from 1, 0 if unknown, ``column`` from 1."""

    def __init__(self, message: str, line: int, column: int = 1) -> None:
        super().__init__(message)
        self.line, self.column = line, column


class TooLargeError(XmlError):
    """A file that roslaunch may read, and that is above the limits here."""


@dataclass
class Tag:
    """One element."""

    name: str
    attributes: Mapping[str, str]
    line: int
    column: int = 1
    children: list[Tag] = field(default_factory=list)
    text: str = ""

    def all(self, name: str) -> Iterator[Tag]:
        """Yields the elements of a name below this one, and itself."""
        waiting = [self]
        while waiting:
            one = waiting.pop()
            if one.name == name:
                yield one
            waiting += reversed(one.children)


def root_of(content: bytes) -> Tag:
    """Returns the outermost element of a file. Raises `XmlError`."""
    tree = _Tree()
    try:
        tree.parser.Parse(content, True)
    except XmlError:
        raise
    except expat.ExpatError as error:
        raise XmlError(_NOT_XML, error.lineno, error.offset + 1) from None
    except (ValueError, LookupError):  # an encoding that is unknown, or none of single bytes
        raise XmlError(_NOT_XML, 0) from None
    if tree.root is None:
        raise XmlError("it is empty", 1)
    return tree.root


class _Tree:
    """The elements that ``parser`` has read."""

    def __init__(self) -> None:
        self.root: Tag | None = None
        self.parser = expat.ParserCreate()
        self.parser.StartDoctypeDeclHandler = self._refuse
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self._open: list[tuple[Tag, list[str]]] = []  # each with the pieces of its text
        self._count = 0

    def _refuse(self, *_: object) -> NoReturn:
        line, column = self._place()
        raise XmlError("it declares entities or a document type", line, column)

    def _place(self) -> tuple[int, int]:
        return self.parser.CurrentLineNumber, self.parser.CurrentColumnNumber + 1

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._count += 1
        if self._count > MAX_TAGS or len(self._open) >= MAX_DEPTH or len(name) > MAX_NAME:
            what = "it has too many elements, too deep ones or too long names"
            raise TooLargeError(what, *self._place())
        tag = Tag(name, attributes, *self._place())
        if self._open:
            self._open[-1][0].children.append(tag)
        else:
            self.root = tag
        self._open.append((tag, []))

    def _end(self, _: str) -> None:
        tag, pieces = self._open.pop()
        tag.text = "".join(pieces)

    def _characters(self, content: str) -> None:
        if self._open:
            self._open[-1][1].append(content)
