"""What ``driver new`` asks beside the wheels: sensors and lights, until there are no more, or by flags."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import typer

from swarmctl.cli import console, exits
from swarmctl.cli.driver_new import ask, complaints


def add(name: str, answers: dict[str, Any], said: Mapping[str, Sequence[str]]) -> None:
    """The parts of a robot to its ``answers``: those that flags say, else those that are told."""
    answers["parts"] = []
    for kind, texts in said.items():
        for text in texts:
            _take(name, answers, kind, text)
    if not said and sys.stdin.isatty():
        while kind := _more():
            _tell(name, answers, kind)


def _take(name: str, answers: dict[str, Any], kind: str, text: str) -> None:
    from swarmctl.render.own_parts import read_part

    try:
        part = read_part(kind, answers["protocol"], text)
    except ValueError as error:
        console.fail(f"--{kind}: {error}", code=exits.USAGE)
    wrong = complaints(name, {**answers, "parts": [*answers["parts"], part]})
    if wrong:
        console.fail(f"--{kind}: {wrong[0]}", *wrong[1:], code=exits.USAGE)
    answers["parts"].append(part)


def _more() -> str:
    """Which kind comes next; nothing for no more."""
    from swarmctl.render.own_parts import PARTS

    while True:
        kind: str = typer.prompt(
            f"What else has it: {', '.join(PARTS)}? Enter for no more",
            default="",
            show_default=False,
            err=True,
        ).strip()
        if not kind or kind in PARTS:
            return kind
        typer.echo(f"  `{kind}` is none of {', '.join(PARTS)}", err=True)


def _tell(name: str, answers: dict[str, Any], kind: str) -> None:
    """Question by question, each judged in the file that it makes."""
    from swarmctl.render.own_parts import questions_of
    from swarmctl.render.questions import Question, read_answer

    part: dict[str, Any] = {"kind": kind}

    def taken(question: Question, text: str) -> tuple[str, ...]:
        try:
            value = read_answer(question, text)
        except ValueError as error:
            return (str(error),)
        wrong = complaints(name, {**answers, "parts": [*answers["parts"], {**part, question.name: value}]})
        if not wrong:
            part[question.name] = value
        return wrong

    for question in questions_of(kind, answers["protocol"]):
        ask(question, partial(taken, question))
    answers["parts"].append(part)
