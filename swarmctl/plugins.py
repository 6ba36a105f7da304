"""The middlewares, multimaster providers, kinds of links and levels of security that a spec can name.

Another package adds one by an entry point in its pyproject.toml, a program by ``MULTIMASTERS.register(...)``:

    [project.entry-points."swarmctl.multimaster"]
    mesh = "my_package.mesh:MESH"

A name leads to an object that is imported on first use, so a spec can be read without any of them.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module
from typing import TYPE_CHECKING, Any, Literal, Protocol

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler, PlainValidator, TypeAdapter

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


class Registry:
    """Plugins by name. Registered plugins come before built-in ones, these before entry points.

    ``group`` is the group of the entry points, ``built_in`` maps names to ``module:object``.
    """

    def __init__(self, group: str, built_in: Mapping[str, str]) -> None:
        self._group = group
        self._built_in = dict(built_in)
        self._loaded: dict[str, Any] = {}

    @property
    def built_in(self) -> Mapping[str, str]:
        """Where the built-in plugins are, by name."""
        return self._built_in

    @property
    def default(self) -> str:
        """The name of the first built-in plugin."""
        return next(iter(self._built_in))

    def register(self, name: str, plugin: object) -> None:
        """Make ``plugin`` available as ``name`` in this process."""
        self._loaded[name] = plugin

    def unregister(self, name: str) -> None:
        """Undo ``register``. Raises KeyError if ``name`` was not registered."""
        del self._loaded[name]

    def names(self) -> tuple[str, ...]:
        """Returns every name that a spec can use, built-in names first."""
        return tuple(self)

    def __iter__(self) -> Iterator[str]:
        """Yields every name that a spec can use, built-in names first; entry points are read last."""
        yield from self._built_in
        others = [name for name in self._loaded if name not in self._built_in]
        yield from others
        yield from (name for name in self._entry_points() if name not in (*self._built_in, *others))

    def get(self, name: str) -> Any:
        """Returns the plugin called ``name``. Raises KeyError if there is none."""
        if name not in self._loaded:
            self._loaded[name] = self._load(name)
        return self._loaded[name]

    def __contains__(self, name: object) -> bool:
        return name in self._built_in or name in self._loaded or name in self._entry_points()

    def _load(self, name: str) -> Any:
        if name in self._built_in:
            module, _, attribute = self._built_in[name].partition(":")
            return getattr(import_module(module), attribute)
        return self._entry_points()[name].load()

    def _entry_points(self) -> Mapping[str, EntryPoint]:
        return _entry_points(self._group, tuple(sys.path))


@cache
def _entry_points(group: str, _path: tuple[str, ...]) -> Mapping[str, EntryPoint]:
    """The entry points of ``group``, read anew when ``sys.path`` changes: each wrong name needs them."""
    from importlib.metadata import entry_points  # noqa: PLC0415  (built-in names do not need it)

    return {one.name: one for one in entry_points(group=group)}


#: By ``ros.distro``: objects of ``swarmctl.render.middleware.Middleware``.
MIDDLEWARES = Registry(
    "swarmctl.middleware",
    {
        "noetic": "swarmctl.render.ros1.noetic:NOETIC",
        "humble": "swarmctl.render.ros2.distros:HUMBLE",
        "jazzy": "swarmctl.render.ros2.distros:JAZZY",
        "kilted": "swarmctl.render.ros2.distros:KILTED",
        "lyrical": "swarmctl.render.ros2.distros:LYRICAL",
    },
)

#: By ``multimaster.provider``: objects of ``swarmctl.render.multimaster.MultimasterProvider``.
MULTIMASTERS = Registry(
    "swarmctl.multimaster",
    {
        "fkie": "swarmctl.render.ros1.multimaster.fkie:FKIE",
        "static": "swarmctl.render.ros1.multimaster.static:STATIC",
        "relay": "swarmctl.render.ros2.relay:RELAY",
    },
)

#: By the ``kind`` of a link: subclasses of ``NetworkLink`` or ``RobotLink`` of ``swarmctl.links.link_base``.
#: The built-in ones are imported with the model of a spec.
LINK_KINDS = Registry(
    "swarmctl.link",
    {
        "wlan": "swarmctl.links.network_link:Wlan",
        "ethernet": "swarmctl.links.network_link:Ethernet",
        "serial": "swarmctl.links.serial_link:Serial",
        "bluetooth": "swarmctl.links.bluetooth_link:Bluetooth",
        "udp": "swarmctl.links.ip_link:Udp",
        "tcp": "swarmctl.links.ip_link:Tcp",
        "radio": "swarmctl.links.radio_link:Radio",
    },
)

#: By `security`, the weakest first: objects of ``swarmctl.render.security_level.SecurityLevel``.
SECURITY_LEVELS = Registry(
    "swarmctl.security",
    {
        "off": "swarmctl.render.security_level:OFF",
        "filtered": "swarmctl.render.firewall:FILTERED",
        "sealed": "swarmctl.render.wireguard:SEALED",
    },
)


class Names(Protocol):
    """Names that are known when a spec is read."""

    def names(self) -> tuple[str, ...]:
        """Returns every name that a spec can use."""

    def __contains__(self, name: object) -> bool: ...


class NameIn:
    """Annotation of a model's field that holds a name of ``registry``; validates as a ``Literal`` does."""

    def __init__(self, registry: Names) -> None:
        self._registry = registry

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> Any:
        return PlainValidator(self._checked).__get_pydantic_core_schema__(source, handler)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = self._registry.names()
        choice = {"const": names[0]} if len(names) == 1 else {"enum": list(names)}
        return {**choice, "type": "string"}

    def _checked(self, value: Any) -> Any:
        if isinstance(value, str) and value in self._registry:
            return value
        names = self._registry.names()
        choice: Any = Literal[names]
        return TypeAdapter(choice).validate_python(value)  # raises, with the names in the error
