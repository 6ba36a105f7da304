"""What a robot type of one's own has beside wheels: questions about sensors and lights, and their answers."""

from __future__ import annotations

import math
import shlex
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from swarmctl.render.questions import Question, read_answer, typed

Part = Mapping[str, Any]  # its `kind`, and an answer to each of its questions


def _asked(letter: str, code: str) -> tuple[Question, ...]:
    """How its numbers are asked for."""
    return (
        Question("send", "Request that asks for it?", letter, None, ("line",)),
        Question("reply", "What its reply begins with?", letter.lower(), None, ("line",)),
        Question("send", f"Request that asks for it, in bytes, like {code}?", code, None, ("binary",)),
        Question("reply", "Layout of its reply, like 2B?", "2B", None, ("binary",)),
        Question("request_bytes", "Bytes of the request that asks for it?", 8, 8, ("python",)),
        Question("reply_bytes", "Bytes of its longest reply?", 32, 32, ("python",)),
    )


def _named(sample: str, default: str | None = None) -> Question:
    return Question("name", "Name of its topic?", sample, default)


_NAMES = Question("names", "Name of each number of its reply, with commas?", ("left", "right"))
_RATE = Question("rate", "How often is it read, Hz?", 5.0, 5.0)
_DISTANCES = ((10.0, 0.3), (255.0, 0.0))
_REPLY = "What its reply begins with; empty if it does not answer?"
PARTS: dict[str, tuple[Question, ...]] = {
    "raw": (_named("floor"), _NAMES, *_asked("F", "66"), _RATE),
    "range": (
        _named("eyes"), _NAMES, *_asked("E", "65"),
        Question("headings", "Where does each look, degrees to the left of ahead?", (20.0, -20.0)),
        Question("radius", "How far from the robot's centre are they, m?", 0.05, 0.05),
        Question("max_reading", "Largest reading?", 255, 255),
        Question("distances", "Readings, rising, and their distances in m, like 10:0.3,255:0?", _DISTANCES),
        Question("field_of_view", "How wide does each look, degrees?", 15.0, 15.0), _RATE,
    ),
    "battery": (
        _named("battery", "battery"), *_asked("V", "76"),
        Question("volts", "V for each unit of its number?", 0.01),
        Question("empty", "V at which it is empty?", 3.4),
        Question("full", "V at which it is full?", 4.2),
        Question("rate", "How often is it read, Hz?", 1.0, 1.0),
    ),
    "lights": (
        _named("lamp"),
        Question("channels", "Name of each light, with commas?", ("lamp",)),
        Question("send", "Request with {value}, and {index} of several?", "L,{value}", None, ("line",)),
        Question("reply", _REPLY, "l", "", ("line",)),
        Question("send", "Request in bytes, like b4 {value:b}?", "b4 {value:b}", None, ("binary",)),
        Question("reply", "Layout of its reply; empty if it does not answer?", "", "", ("binary",)),
        Question("max", "Largest value?", 1, 1),
    ),
}  # fmt: skip
_OF_SEVERAL = {"line": "L,{index},{value}", "binary": "b4 {index:b} {value:b}"}


def questions_of(kind: str, protocol: str) -> list[Question]:
    return [one for one in PARTS[kind] if protocol in one.only]


def read_part(kind: str, protocol: str, text: str) -> dict[str, Any]:
    """What a flag says, like ``name=floor names=left,right send=F reply=f``. ValueError: what is wrong."""
    questions = {one.name: one for one in questions_of(kind, protocol)}
    said: dict[str, str] = {}
    for pair in _words(text):
        key, equals, value = pair.partition("=")
        if key not in questions or not equals:
            raise ValueError(f"`{pair}` is none of {', '.join(f'{name}=' for name in questions)}")
        if key in said:
            raise ValueError(f"`{key}=` stands there twice")
        said[key] = value
    missing = [one for one in questions.values() if one.default is None and one.name not in said]
    if missing:
        raise ValueError(
            "it needs " + ", ".join(f"{one.name}={shlex.quote(typed(one.sample))}" for one in missing)
        )
    answers = {name: read_answer(one, said.get(name, one.usual)) for name, one in questions.items()}
    return {"kind": kind, **answers}


def _words(text: str) -> list[str]:
    try:
        return shlex.split(text)
    except ValueError:
        raise ValueError(f"in `{text}` a quotation mark or a backslash stands alone") from None


def completed(part: Part, protocol: str) -> dict[str, Any]:
    """As the file's template wants it. What has no answer yet is taken from samples that fit the others."""
    kind = part["kind"]
    samples = {one.name: one.sample for one in questions_of(kind, protocol)}
    numbers = len(part.get("names", samples.get("names", (kind,))))
    if kind == "lights":
        samples["send"] = (
            _OF_SEVERAL.get(protocol) if len(part.get("channels", ())) > 1 else samples.get("send")
        )
    elif protocol == "binary":
        samples["reply"] = f"{numbers}B"
    if kind == "range" and "names" in part:
        samples["headings"] = (0.0,) * numbers
    whole = {"send": None, "reply": None, **samples, **part, "numbers": numbers, "example": False}
    return whole | ({"elements": _elements(whole)} if kind == "range" else {})


def examples(parts: Sequence[Part], protocol: str) -> Iterator[dict[str, Any]]:
    """One of each kind that the robot does not have: what people may go on with."""
    had = {one["kind"] for one in parts}
    taken = {one.get("name") for one in parts}
    for kind in PARTS:
        one = completed({"kind": kind}, protocol)
        if kind not in had and one["name"] not in taken:
            yield one | {"example": True}


def _elements(part: Part) -> list[dict[str, Any]]:
    """Where each distance sensor sits: on a circle, looking outward."""
    names, headings = part["names"], part["headings"]
    if len(names) != len(headings):
        raise ValueError(f"{len(names)} names need as many headings, not {len(headings)}")
    return [
        {
            "name": name,
            "x": round(part["radius"] * math.cos(math.radians(heading)), 4),
            "y": round(part["radius"] * math.sin(math.radians(heading)), 4),
            "heading_deg": heading,
        }
        for name, heading in zip(names, headings, strict=True)
    ]
