"""Questions about a robot, and their answers as people type them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

PROTOCOLS = ("line", "binary", "python")


@dataclass(frozen=True)
class Question:
    """One thing to know. Without a ``default`` it must be answered; ``sample`` is an answer that is right."""

    name: str
    text: str
    sample: Any
    default: Any = None
    only: tuple[str, ...] = PROTOCOLS  # the protocols that it is about

    @property
    def flag(self) -> str:
        return "--" + self.name.replace("_", "-")

    @property
    def usual(self) -> str:
        """The default as one would type it."""
        return typed(self.default)


def typed(value: Any) -> str:
    """An answer as one would type it: yes, 5.0, left,right or 10:0.3,255:0."""
    if isinstance(value, bool):
        return ("no", "yes")[value]
    if isinstance(value, tuple):
        return ",".join(":".join(map(typed, one)) if isinstance(one, tuple) else typed(one) for one in value)
    return f"{value:g}" if isinstance(value, float) else str(value)


def read_answer(question: Question, text: str) -> Any:
    """An answer as its question wants it. ValueError says what is wrong with it."""
    text = text.strip()
    if question.name == "link":
        return [one.strip() for one in text.split(",")]
    if question.name == "protocol" and text not in PROTOCOLS:
        raise ValueError(f"`{text}` is none of {', '.join(PROTOCOLS)}")
    if question.name == "terminator" and text not in ("cr", "lf"):
        raise ValueError(f"`{text}` is neither cr nor lf")
    return _read(text, question.sample)


def _read(text: str, sample: Any) -> Any:
    """``text`` as the same kind of value as ``sample``."""
    if isinstance(sample, bool):
        if text.lower() not in ("yes", "no", "y", "n", "true", "false"):
            raise ValueError(f"`{text}` is neither yes nor no")
        return text.lower() in ("yes", "y", "true")
    if isinstance(sample, (int, float)):
        try:
            return type(sample)(text)
        except ValueError:
            what = "whole number" if isinstance(sample, int) else "number"
            raise ValueError(f"`{text}` is no {what}, like {sample}") from None
    if isinstance(sample, tuple):
        return tuple(_read_item(one.strip(), sample) for one in text.split(","))
    return text


def _read_item(text: str, samples: tuple[Any, ...]) -> Any:
    """One of several values with commas between them; a pair has a colon."""
    if not isinstance(samples[0], tuple):
        return _read(text, samples[0])
    first, colon, second = text.partition(":")
    if not colon:
        raise ValueError(f"`{text}` is no pair, like {typed(samples[:1])}")
    return _read(first.strip(), samples[0][0]), _read(second.strip(), samples[0][1])
