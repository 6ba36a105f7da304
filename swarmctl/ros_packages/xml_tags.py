"""XML of ROS packages as tags with positions, without entities, which could grow without bound."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING
from xml.sax import SAXException
from xml.sax.handler import ContentHandler

import defusedxml.sax
from defusedxml.common import DefusedXmlException

if TYPE_CHECKING:
    from xml.sax.xmlreader import AttributesImpl, Locator

MAX_TAGS = 20_000
MAX_DEPTH = 32
MAX_NAME = 100  # characters


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
        defusedxml.sax.parseString(content, tree, forbid_dtd=True)
    except DefusedXmlException:
        raise XmlError("it declares entities or a document type", tree.line, tree.column) from None
    except XmlError:
        raise
    except (SAXException, ValueError, LookupError) as error:
        line = getattr(error, "getLineNumber", lambda: None)() or 0
        column = getattr(error, "getColumnNumber", lambda: None)() or 0
        raise XmlError("it is not well-formed XML", line, column + 1) from None
    if tree.root is None:
        raise XmlError("it is empty", 1)
    return tree.root


class _Tree(ContentHandler):
    def __init__(self) -> None:
        super().__init__()
        self.root: Tag | None = None
        self._open: list[tuple[Tag, list[str]]] = []  # each with the pieces of its text
        self._count = 0
        self._locator: Locator | None = None

    @property
    def line(self) -> int:
        return (self._locator.getLineNumber() or 0) if self._locator else 0

    @property
    def column(self) -> int:
        return (self._locator.getColumnNumber() or 0) + 1 if self._locator else 1

    def setDocumentLocator(self, locator: Locator) -> None:  # noqa: N802
        self._locator = locator

    def startElement(self, name: str, attrs: AttributesImpl) -> None:  # noqa: N802
        self._count += 1
        if self._count > MAX_TAGS or len(self._open) >= MAX_DEPTH or len(name) > MAX_NAME:
            what = "it has too many elements, too deep ones or too long names"
            raise TooLargeError(what, self.line, self.column)
        tag = Tag(name, dict(attrs.items()), self.line, self.column)
        if self._open:
            self._open[-1][0].children.append(tag)
        else:
            self.root = tag
        self._open.append((tag, []))

    def endElement(self, name: str) -> None:  # noqa: N802
        tag, pieces = self._open.pop()
        tag.text = "".join(pieces)

    def characters(self, content: str) -> None:
        if self._open:
            self._open[-1][1].append(content)
