"""Parameters as YAML, the way people write it: what a program or a ROS parameter server reads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import yaml


def params_file(data: Mapping[str, Any]) -> bytes:
    """The content of a parameter file, short lists on one line."""
    text = yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, default_flow_style=None, width=110, allow_unicode=True
    )
    return b"# Written by swarmctl; the next deploy replaces it.\n" + text.encode()


class _Dumper(yaml.SafeDumper):
    """YAML as people write it: text with control characters in double quotes."""


def _text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=None if text.isprintable() else '"')


_Dumper.add_representer(str, _text)
