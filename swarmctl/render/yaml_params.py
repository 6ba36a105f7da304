"""Parameters as YAML, the way people write it: what a program or a ROS parameter server reads.

Robots of one type share most entries of their files, so that each distinct entry is written once.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import yaml

from swarmctl.render import plain_yaml
from swarmctl.ros_packages.parameters import rcl_value

_ANGLES = ("deg(", "rad(")  # `deg(90)` without quotes is a number to rosparam


def params_file(data: Mapping[str, Any]) -> bytes:
    """Returns the content of a parameter file, short lists on one line."""
    if any(isinstance(value, (dict, list, tuple)) for value in data.values()):
        return file_of(entries(data))
    return file_of(_dumped(data))  # on one line


def rcl_params_file(data: Mapping[str, Any]) -> bytes:
    """Returns the content of a parameter file of ROS 2, with quotes where rcl would read another type."""
    return file_of(_dumped(_Block(data), _RclDumper))


def file_of(*texts: str) -> bytes:
    """Returns the content of a parameter file that consists of ``entries``."""
    return "".join(("# Written by swarmctl; the next deploy replaces it.\n", *texts)).encode()


def entries(data: Mapping[str, Any]) -> str:
    """Returns the text of a mapping, without the braces that one of scalars only would have."""
    return "".join(_entry(_Entry(f"{key!r}: {value!r}", key, value)) for key, value in data.items())


@dataclass(frozen=True)
class _Entry:
    """A key of the file and its value. Entries with one ``source`` are equal."""

    source: str
    key: str = field(compare=False)
    value: Any = field(compare=False)


@lru_cache(maxsize=4096)
def _entry(entry: _Entry) -> str:
    return lines(entry.key, entry.value)


def lines(key: str, value: Any) -> str:
    """Returns the lines of one entry; `entries` are for what several files have."""
    data = {key: value}
    try:
        return plain_yaml.written(data)
    except plain_yaml.NotPlainError:
        return _dumped(_Block(data))


def _dumped(data: Mapping[str, Any], dumper: type[_Dumper] | None = None) -> str:
    text: str = yaml.dump(
        data,
        Dumper=dumper or _Dumper,
        sort_keys=False,
        default_flow_style=None,
        width=plain_yaml.WIDTH,
        allow_unicode=True,
    )
    return text


class _Block(dict[str, Any]):
    """A mapping with an entry on each line."""


class _Dumper(yaml.SafeDumper):
    """YAML as people write it: what holds control characters, or is a number to roslaunch, in quotes."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    plain = text.isprintable() and not text.startswith(_ANGLES)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


class _RclDumper(_Dumper):
    """YAML for rcl, to which `1e5` is a number, and `y` is true."""


def _rcl_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    node = _text(dumper, text)
    node.style = node.style if isinstance(rcl_value(text), str) else '"'
    return node


def _block(dumper: yaml.SafeDumper, data: _Block) -> yaml.MappingNode:
    return dumper.represent_mapping("tag:yaml.org,2002:map", data, flow_style=False)


_Dumper.add_representer(str, _text)
_Dumper.add_representer(_Block, _block)
_RclDumper.add_representer(str, _rcl_text)
_RclDumper.add_representer(_Block, _block)
