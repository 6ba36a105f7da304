"""The files that begin a user's own robot type: commented YAML and, for a Python protocol, a codec. Pure."""

from __future__ import annotations

from swarmctl.render import shipped_files
from swarmctl.render.quoting import render


def type_text(name: str, protocol: str, *, schema: bool) -> str:
    """Returns the text of robots/NAME.yaml, with empty values where only the user knows the robot.

    ``protocol`` is a protocol kind. With ``schema`` the file refers editors to the schema in ``.swarmctl``.
    """
    values = {"title": _title(name), "protocol": protocol, "codec": class_name(name), "schema": schema}
    return render("robot.yaml", **values).decode()


def ros_type_text(name: str, package: str, file: str, *, schema: bool) -> str:
    """Returns the text of robots/NAME.yaml for a robot whose driver is ``file``, an executable or launch file
    of a ROS package."""
    kind = "launch" if file.endswith((".launch", ".launch.xml")) else "executable"
    values = {"name": name, "title": _title(name), "package": package, "kind": kind, "file": file}
    return render("ros_robot.yaml", **values, schema=schema).decode()


def codec_text(name: str) -> str:
    """Returns the text of robots/NAME.py: a complete codec for comma-separated lines of text."""
    return shipped_files.text("project/codec.py").decode().replace("OwnCodec", class_name(name))


def class_name(name: str) -> str:
    """Returns the name of the codec class of a robot type, such as ``BeetleCodec`` for ``beetle``."""
    words = name.replace(".", "-").split("-")
    return "".join(word.capitalize() for word in words) + "Codec"


def _title(name: str) -> str:
    return name.replace("-", " ").capitalize()
