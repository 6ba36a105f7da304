"""A robot type of one's own as text, from answers to a few questions: as validated as any file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from swarmctl.render import shipped
from swarmctl.render.own_parts import completed, examples
from swarmctl.render.questions import Question
from swarmctl.render.templates import render
from swarmctl.spec.diagnostics import Diagnostic, Severity
from swarmctl.spec.robot_type import RobotType
from swarmctl.spec.source import parse
from swarmctl.spec.validation import validated

QUESTIONS = (
    Question("title", "What do people call it?", "Robot"),
    Question("protocol", "How does it speak: line (of text), binary or python (a class)?", "line", "line"),
    Question("link", "How is it connected: serial, bluetooth, or both, with a comma?", "serial", "serial"),
    Question("baud", "Baud rate of its line?", 115200, 115200),
    Question("wheel_separation", "Distance between its wheels' tracks, m?", 0.1),
    Question("wheel_speed_max", "Fastest that a wheel goes, m/s?", 0.2),
    Question("units_per_mps", "Units of its speed command for 1 m/s?", 1000.0),
    Question("metres_per_count", "Way of a wheel for one count of its position counter, m?", 0.001),
    Question("counter_bits", "Bits of its position counters?", 32, 32),
    Question("set_speed", "Request that sets both speeds?", "S,{left},{right}", None, ("line",)),
    Question("reply", "What its reply begins with?", "s", None, ("line",)),
    Question(
        "set_speed", "Request that sets both speeds, in bytes, like bc {left:h} {right:h}?",
        "bc {left:h} {right:h}", None, ("binary",),
    ),
    Question("reply", "Layout of its reply, like 2h; empty if it does not answer?", "", "", ("binary",)),
    Question("position", "Request for both position counters; empty if it has none?", "P", "", ("line",)),
    Question("position_reply", "What its reply begins with?", "p", "", ("line",)),
    Question("position", "Request for both counters, in bytes; empty if it has none?", "70", "", ("binary",)),
    Question("position_reply", "Layout of its reply?", "2i", "2i", ("binary",)),
    Question("identify", "Request that names its firmware; empty if it has none?", "", "", ("line",)),
    Question("identify_reply", "What its reply begins with?", "b", "", ("line",)),
    Question("error_head", "What a refusal begins with; empty if it says nothing?", "", "", ("line",)),
    Question("terminator", "What ends a request: cr or lf?", "cr", "cr", ("line",)),
    Question("set_speed_bytes", "Bytes of the longest request that sets speeds?", 16, 16, ("python",)),
    Question("reply_bytes", "Bytes of its longest reply; 0 if it does not answer?", 16, 16, ("python",)),
    Question("position_bytes", "Bytes of the request for both counters; 0 for none?", 8, 8, ("python",)),
    Question("position_reply_bytes", "Bytes of its longest reply?", 32, 32, ("python",)),
    Question("reply_timeout", "Seconds to wait for a reply?", 0.2, 0.2),
    Question("dead_man", "Does it stop by itself when its orders stop (yes or no)?", False, False),
    Question("hint", "What to check when it does not answer?", "", ""),
)  # fmt: skip
_NEEDED_WITH = {"position_reply": "position", "identify_reply": "identify"}


def questions(protocol: str, answers: Mapping[str, Any]) -> list[Question]:
    """What is still to be asked about a robot of that ``protocol``, in order."""
    return [
        one
        for one in QUESTIONS
        if protocol in one.only
        and one.name not in answers
        and not (one.name in _NEEDED_WITH and answers.get(_NEEDED_WITH[one.name]) == "")
    ]


def class_name(name: str) -> str:
    """The protocol class of the type ``name``."""
    words = name.replace(".", "-").split("-")
    return "".join(word.capitalize() for word in words) + "Codec"


def type_text(name: str, answers: Mapping[str, Any], *, schema: bool) -> str:
    """The file robots/NAME.yaml; what has not been answered yet is taken from the samples."""
    samples = {one.name: one.sample for one in reversed(QUESTIONS) if _is_about(one, answers)}
    blank = {one.name: "" for one in QUESTIONS}
    values = {**blank, **samples, **answers, "codec": class_name(name), "schema": schema}
    values["link"] = [values["link"]] if isinstance(values["link"], str) else values["link"]
    protocol, parts = values["protocol"], answers.get("parts", ())
    told = [*(completed(one, protocol) for one in parts), *examples(parts, protocol)]
    values["examples"] = any(one["example"] for one in told)
    values["senses"] = [one for one in told if one["kind"] != "lights"]
    values["lights"] = [one for one in told if one["kind"] == "lights"]
    return render("robot.yaml", **values).decode()


def _is_about(question: Question, answers: Mapping[str, Any]) -> bool:
    return answers.get("protocol", "line") in question.only


def codec_text(name: str, answers: Mapping[str, Any] | None = None) -> str:
    """The file robots/NAME.py: a class to begin with, which speaks lines of text."""
    text = shipped.text("project/codec.py").decode().replace("OwnCodec", class_name(name))
    asked = [one["name"] for one in (answers or {}).get("parts", ()) if one["kind"] != "lights"]
    requests = ", ".join(['"position": "P"', *(f'"{one}": "{one.upper()}"' for one in asked)])
    return text.replace('"position": "P"', requests)


def complaint(name: str, answers: Mapping[str, Any]) -> Diagnostic | None:
    """What is wrong with the answers so far, as it would be with the file."""
    try:
        text = type_text(name, answers, schema=False)
    except ValueError as error:
        return Diagnostic("SPEC003", str(error))
    source, found = parse(text, f"{name}.yaml")
    _, wrong = validated(RobotType, source)
    return next((one for one in (*found, *wrong) if one.severity is Severity.ERROR), None)
