"""A URDF as urdfdom and robot_state_publisher read it: its tree of links, its joints, its meshes. Pure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from swarmctl.ros_packages.xml_tags import Tag, TooLargeError, XmlError, root_of

_XACRO = "/xacro"  # how the namespace of xacro's elements ends
_LIMITED = ("revolute", "prismatic")
_TYPES = (*_LIMITED, "continuous", "fixed", "floating", "planar")


@dataclass(frozen=True)
class Place:
    """Where an element begins; both count from 1."""

    line: int
    column: int


@dataclass(frozen=True)
class Fault:
    """Why ROS takes a file for no URDF; ``repair`` says what to do, if there is something to say."""

    text: str
    place: Place
    repair: str = ""


class UrdfError(ValueError):
    """A file that is not a URDF at all: no XML, another document, or xacro's source of one."""

    def __init__(self, fault: Fault) -> None:
        super().__init__(fault.text)
        self.fault = fault


class UrdfTooLargeError(UrdfError):
    """A file that ROS may read, and that is above the limits here."""


@dataclass(frozen=True)
class Joint:
    """A joint between two links."""

    name: str
    parent: str
    child: str
    place: Place


@dataclass(frozen=True)
class Urdf:
    """A robot's shape. ``faults`` are why its links make no tree; without any it has one ``root``.

    ``packages`` are those of its meshes and textures, each once.
    """

    content: bytes = field(repr=False)
    links: Mapping[str, Place]
    joints: tuple[Joint, ...]
    packages: tuple[str, ...]
    faults: tuple[Fault, ...] = ()

    @property
    def root(self) -> str:
        """The link that no joint has as its child; empty if there is not exactly one."""
        children = {one.child for one in self.joints}
        roots = [name for name in self.links if name not in children]
        return roots[0] if len(roots) == 1 else ""


def read_urdf(content: bytes) -> Urdf:
    """Returns what a file describes. Raises `UrdfError` if it is not a URDF."""
    try:
        content.decode("utf-8-sig")
        root = root_of(content)
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        column = error.start - content.rfind(b"\n", 0, error.start)
        raise UrdfError(Fault("it is not UTF-8", Place(line, column), "save it as UTF-8")) from None
    except XmlError as error:
        kind = UrdfTooLargeError if isinstance(error, TooLargeError) else UrdfError
        raise kind(Fault(str(error), Place(max(error.line, 1), error.column))) from None
    if root.name != "robot":
        raise UrdfError(Fault(f"its root is <{root.name}>, not <robot>", _place(root)))
    if (found := _of_xacro(root)) is not None:
        text = "it has xacro's macros or expressions, which robot_state_publisher does not know"
        raise UrdfError(Fault(text, _place(found), "xacro"))
    joints = tuple(_joint(one) for one in root.children if one.name == "joint")
    links = {
        one.attributes["name"]: _place(one)
        for one in root.children
        if one.name == "link" and "name" in one.attributes
    }
    faults = (*_of_elements(root), *_of_the_tree(links, joints)) if links else (_no_link(root),)
    return Urdf(content, links, joints, tuple(dict.fromkeys(_packages(root))), faults)


def _place(tag: Tag) -> Place:
    return Place(tag.line, tag.column)


def _of_xacro(root: Tag) -> Tag | None:
    """The first element that xacro replaces, in a file that declares xacro's namespace."""
    prefixes = tuple(
        f"{key.partition(':')[2]}:"
        for key, value in root.attributes.items()
        if key.startswith("xmlns:") and value.rstrip("/").endswith(_XACRO)
    )
    if not prefixes:
        return None
    waiting = [root]
    while waiting:
        one = waiting.pop()
        if one.name.startswith(prefixes) or any(
            "${" in text or "$(" in text for text in one.attributes.values()
        ):
            return one
        waiting += reversed(one.children)
    return None


def _joint(tag: Tag) -> Joint:
    def link(name: str) -> str:
        return next((one.attributes.get("link", "") for one in tag.children if one.name == name), "")

    return Joint(tag.attributes.get("name", ""), link("parent"), link("child"), _place(tag))


def _no_link(root: Tag) -> Fault:
    return Fault("it has no link", _place(root), 'the first is <link name="base_link" />')


def _of_elements(root: Tag) -> Iterator[Fault]:
    """What is wrong with single elements."""
    if not root.attributes.get("name"):
        yield Fault("<robot> has no `name`", _place(root))
    seen: set[tuple[str, str]] = set()
    for one in root.children:
        if one.name not in ("link", "joint"):
            continue
        name = one.attributes.get("name", "")
        if not name:
            yield Fault(f"a <{one.name}> has no `name`", _place(one))
        elif (one.name, name) in seen:
            yield Fault(f"two {one.name}s are called `{name}`", _place(one))
        seen.add((one.name, name))
        if one.name == "joint":
            yield from _of_a_joint(one, name)
    for mesh in root.all("mesh"):
        if not mesh.attributes.get("filename"):
            yield Fault("a <mesh> has no `filename`", _place(mesh))


def _of_a_joint(tag: Tag, name: str) -> Iterator[Fault]:
    kind = tag.attributes.get("type", "")
    if kind not in _TYPES:
        shown = f"has the type `{kind}`" if kind else "has no `type`"
        yield Fault(f"joint `{name}` {shown}", _place(tag), f"the types are {', '.join(_TYPES)}")
    if kind in _LIMITED and not any(one.name == "limit" for one in tag.children):
        yield Fault(
            f"joint `{name}` is {kind} and has no <limit>",
            _place(tag),
            'add <limit lower="-1.57" upper="1.57" effort="1" velocity="1" />, or make it continuous',
        )


def _of_the_tree(links: Mapping[str, Place], joints: tuple[Joint, ...]) -> Iterator[Fault]:
    """What keeps links and joints from being one tree."""
    parents: dict[str, Joint] = {}
    for one in joints:
        for end, link in (("parent", one.parent), ("child", one.child)):
            if not link:
                yield Fault(f"joint `{one.name}` has no <{end} link=...>", one.place)
            elif link not in links:
                yield Fault(f"joint `{one.name}` has the {end} `{link}`, which is not a link", one.place)
        first = parents.setdefault(one.child, one) if one.child else one
        if first is not one:
            yield Fault(f"link `{one.child}` is the child of `{first.name}` and of `{one.name}`", one.place)
    roots = [name for name in links if name not in parents]
    for name in roots[1:]:
        yield Fault(
            f"link `{name}` is connected to `{roots[0]}` by no joint: a URDF has one root",
            links[name],
            f"add a joint whose child is `{name}`",
        )
    yield from _cycles(links, parents)


def _cycles(links: Mapping[str, Place], parents: Mapping[str, Joint]) -> Iterator[Fault]:
    known: set[str] = set()
    for link in links:
        path: dict[str, None] = {}
        one: str = link
        while one in parents and one not in known and one not in path:
            path[one] = None
            one = parents[one].parent
        if one in path:
            loop = [*list(path)[list(path).index(one) :], one]
            yield Fault(f"the joints make a circle: {' - '.join(reversed(loop))}", parents[one].place)
        known |= path.keys()


def _packages(root: Tag) -> Iterator[str]:
    """Yields the package of each mesh and texture that lies in one."""
    for kind in ("mesh", "texture"):
        for one in root.all(kind):
            scheme, separator, rest = one.attributes.get("filename", "").strip().partition("://")
            package, _, path = rest.partition("/")
            if scheme == "package" and separator and package and path:
                yield package
