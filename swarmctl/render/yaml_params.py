"""Parameters as YAML, the way people write it: what a program or a ROS parameter server reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml

_ANGLES = ("deg(", "rad(")  # `deg(90)` without quotes is a number to rosparam


def params_file(data: Mapping[str, Any]) -> bytes:
    """Returns the content of a parameter file, short lists on one line."""
    text = yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    return b"# Written by swarmctl; the next deploy replaces it.\n" + text.encode()


class _Dumper(yaml.SafeDumper):
    """YAML as people write it: what holds control characters, or is a number to roslaunch, in quotes."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    plain = text.isprintable() and not text.startswith(_ANGLES)
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if plain else '"')


_Dumper.add_representer(str, _text)
