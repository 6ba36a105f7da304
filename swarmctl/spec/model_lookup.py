"""Looks up by place which keys may stand there, and the description of a key."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin

from pydantic import BaseModel, TypeAdapter, ValidationError

from swarmctl.links.link_kinds import OfAnyKind
from swarmctl.plugins import LINK_KINDS
from swarmctl.robot_types.any_robot_type import PROTOCOL, ROS
from swarmctl.robot_types.robot_type import RobotType
from swarmctl.robot_types.ros_driver import DRIVER, RosDriver
from swarmctl.robot_types.ros_launchable import ARGUMENTS, WORDS, Arguments, Words
from swarmctl.robot_types.ros_robot_type import DRIVERS, RosRobotType
from swarmctl.spec.model import DRIVER_NAME, Spec
from swarmctl.spec.program_model import COPY, TEMPLATE, Template
from swarmctl.units import Unit, described_with
from swarmctl.yamltext.source import Loc

#: Steps that pydantic adds where the form of a value chooses its type, and no key does.
FORMS: Mapping[str, Any] = {
    PROTOCOL: RobotType, ROS: RosRobotType, DRIVER: RosDriver, DRIVERS: tuple[RosDriver, ...],
    DRIVER_NAME: str,
    ARGUMENTS: Arguments, WORDS: Words, COPY: str, TEMPLATE: Template,
}  # fmt: skip


def known_keys(loc: tuple[str | int, ...], model: type[BaseModel] = Spec) -> tuple[str, ...]:
    """Returns the keys allowed at ``loc`` of a ``model`` (with union tags as pydantic reports them)."""
    places = types_at(loc, model)
    return tuple(dict.fromkeys(name for place in places if is_model(place) for name in place.model_fields))


def types_at(loc: tuple[str | int, ...], model: type[BaseModel]) -> list[Any]:
    """The types that stand at ``loc`` of a ``model``."""
    places: list[Any] = [model]
    for part in loc:
        if chosen := [place for place in places if _is_tagged(place, part)]:
            places = chosen  # a union tag leads no further
        else:
            places = [below for place in places for below in _below(place, part)]
    return places


def _is_tagged(place: Any, tag: str | int) -> bool:
    """True if ``tag`` chooses ``place`` of a union: by its form, or as the one word of its `kind`."""
    kind = place.model_fields.get("kind") if is_model(place) else None
    return place == FORMS.get(str(tag)) or (kind is not None and get_args(kind.annotation) == (tag,))


def link_keys(kind: str) -> tuple[str, ...]:
    """Returns the keys of one kind of link."""
    return tuple(LINK_KINDS.get(kind).model_fields)


def described(loc: tuple[str | int, ...], model: type[BaseModel] = Spec) -> str:
    """Returns the description of the key at ``loc`` of a ``model``; empty if it has none."""
    fields = [place.model_fields.get(str(loc[-1])) for place in types_at(loc[:-1], model) if is_model(place)]
    text = next((field.description for field in fields if field and field.description), "")
    unit = unit_at(loc, model)
    return described_with(text, unit.symbol) if text and unit else text


def examples_at(loc: tuple[str | int, ...], model: type[BaseModel]) -> list[Any]:
    """Returns the examples that a ``model`` gives of the value at ``loc``."""
    places = [place for place in types_at(loc[:-1], model) if is_model(place)] if loc else []
    fields = [place.model_fields.get(str(loc[-1])) for place in places]
    return [one for field in fields if field for one in field.examples or ()]


def unit_at(loc: tuple[str | int, ...], model: type[BaseModel] = Spec) -> Unit | None:
    """Returns the unit of the number at ``loc`` of a ``model``; None if it has none."""
    for place in types_at(loc[:-1], model) if loc else ():
        if is_model(place):
            field = place.model_fields.get(str(loc[-1]))
            found = field and (_unit_in(field.metadata) or _unit_of(field.annotation))
        else:
            found = next((unit for one in _arguments(place, loc[-1]) if (unit := _unit_of(one))), None)
        if found:
            return found
    return None


def _unit_of(annotation: Any) -> Unit | None:
    """The unit of a number's type, also of one that may be left out."""
    if hasattr(annotation, "__metadata__"):
        return _unit_in(annotation.__metadata__) or _unit_of(annotation.__origin__)
    if get_origin(annotation) in (Union, UnionType):
        return next((unit for one in get_args(annotation) if (unit := _unit_of(one))), None)
    return None


def _unit_in(metadata: Iterable[Any]) -> Unit | None:
    return next((one for one in metadata if isinstance(one, Unit)), None)


def accepts(loc: tuple[str | int, ...], model: type[BaseModel], value: Any) -> bool:
    """Returns True if ``value`` may stand at ``loc`` of a ``model``, as far as it can be judged by itself."""
    for place in types_at(loc[:-1], model) if loc else ():
        if is_model(place) and str(loc[-1]) not in place.model_fields:
            continue
        kinds = [None] if is_model(place) else _arguments(place, loc[-1])
        for kind in kinds:
            adapter = _of_field(place, str(loc[-1])) if kind is None else TypeAdapter(kind)
            try:
                adapter.validate_python(value, strict=True)
            except ValidationError:
                continue
            return True
    return False


@cache
def _of_field(model: type[BaseModel], name: str) -> TypeAdapter[Any]:
    field = model.model_fields[name]
    kind: Any = field.annotation
    for part in field.metadata:
        kind = Annotated[kind, part]
    return TypeAdapter(kind)


def is_model(place: Any) -> bool:
    """Returns True for a model, as opposed to a list, a mapping or a single value."""
    return isinstance(place, type) and issubclass(place, BaseModel)


def _below(place: Any, part: str | int) -> list[Any]:
    """What type annotations stand one step below ``place``."""
    if is_model(place):
        field = place.model_fields.get(part)
        return unwrapped(field.annotation) if field else []
    return [below for one in _arguments(place, part) for below in unwrapped(one)]


def _arguments(place: Any, part: str | int) -> list[Any]:
    """The annotation of what a mapping, a list or a pair has at ``part``; none of anything else."""
    origin, arguments = get_origin(place), get_args(place)
    if origin in (dict, Mapping):
        return [arguments[1]]
    if origin is tuple and Ellipsis not in arguments and isinstance(part, int) and part < len(arguments):
        return [arguments[part]]
    return [arguments[0]] if origin in (tuple, list) else []


def unwrapped(annotation: Any) -> list[Any]:
    """The alternatives of an annotation, without ``Annotated`` and ``| None``."""
    if hasattr(annotation, "__metadata__"):
        of_kinds = next((one for one in annotation.__metadata__ if isinstance(one, OfAnyKind)), None)
        return list(of_kinds.classes()) if of_kinds else unwrapped(annotation.__origin__)
    if getattr(annotation, "__origin__", None) in (tuple, list, dict, Mapping):
        return [annotation]
    arguments = getattr(annotation, "__args__", None)
    if arguments:
        return [one for argument in arguments if argument is not type(None) for one in unwrapped(argument)]
    return [annotation]


_IN_SSH_CONFIG = "write `IdentityFile` in ~/.ssh/config, or add the key to ssh-agent"
_ISLAND = "an island lists its hosts: `islands: {NAME: {mode: ..., hosts: [...]}}`"
_GROUP = "a group lists its members, `groups: {NAME: [...]}`; `labels` are words to select by"
_LINE = "how a robot is connected is an entry of `links`: {kind: serial, host: HOST, robot: NAME, ...}"
_CONTROL = "`control` says who commands which robots: {by: NAME, of: [...], priority: 1}"
_JOYSTICK = "for a gamepad write `use: teleop-joy`, for a keyboard `use: teleop-key`"
_RESTART = "leave it out: every program is started again when it ends, unless its `lifecycle` says otherwise"
_TOPICS = "`publishes` and `subscribes` list its topics, each with its type"
_BRIDGE = "`multimaster: {topics: [...]}` has topics to bridge; those of `control` and of programs are found"
_SHARED = {
    **dict.fromkeys(("island", "islands"), _ISLAND),
    **dict.fromkeys(("group", "groups", "tag", "tags"), _GROUP),
}
PLACES: Mapping[str, Mapping[str, str]] = {
    "hosts": {
        **_SHARED,
        "password": "swarmctl logs in with SSH keys only; `ssh-copy-id` puts yours on the host",
        **dict.fromkeys(("key", "key_file", "ssh_key", "identity_file", "private_key"), _IN_SSH_CONFIG),
    },
    "robots": {
        **_SHARED,
        **dict.fromkeys(("port", "device", "baud", "serial", "usb", "mac", "pin", "link", "links"), _LINE),
        **dict.fromkeys(("address", "ip", "uri"), _LINE.replace("serial", "udp")),
        **dict.fromkeys(("commander", "commanders", "control", "controlled_by", "priority"), _CONTROL),
    },
    "programs": {
        **_SHARED,
        **dict.fromkeys(("teleop", "joystick", "gamepad", "joy"), _JOYSTICK),
        **dict.fromkeys(("drives", "controls", "commands", "of", "control", "priority"), _CONTROL),
        **dict.fromkeys(("respawn", "restart", "required"), _RESTART),
        **dict.fromkeys(("topic", "topics"), _TOPICS),
        "name": "leave it out: its name is the key in front of it",
    },
    "": dict.fromkeys(("bridge", "bridges", "relay"), _BRIDGE),
}


def place_of(tagged: Loc) -> str:
    """Returns where a spec says what an unknown key means; empty if that is not known.

    ``tagged``: the place of the key, such as ``("hosts", "pi", "island")`` or ``("bridges",)``.
    """
    section = {1: "", 3: str(tagged[0])}.get(len(tagged))
    return "" if section is None else PLACES.get(section, {}).get(str(tagged[-1]), "")
