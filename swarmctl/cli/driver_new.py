"""``swarmctl driver new``: a robot type of one's own, from flags, or from answers on a terminal."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from swarmctl.cli import console, exits
from swarmctl.cli.driver import Folder

if TYPE_CHECKING:
    from swarmctl.render.questions import Question

_NAME = re.compile(r"[a-z][a-z0-9.-]{0,30}", re.ASCII)
Flag = str | None
Flags = list[str] | None


def _flag(name: str, metavar: str, help_: str) -> Any:
    return typer.Option(f"--{name}", metavar=metavar, help=help_, show_default=False)


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="The new type's name, like beetle.")],
    title: Annotated[Flag, _flag("title", "TEXT", "What people call the robot.")] = None,
    protocol: Annotated[Flag, _flag("protocol", "KIND", "line (default), binary or python.")] = None,
    link: Annotated[Flag, _flag("link", "KINDS", "serial (default), bluetooth, or serial,bluetooth.")] = None,
    baud: Annotated[Flag, _flag("baud", "N", "Bits per second; 115200 by default.")] = None,
    wheel_separation: Annotated[Flag, _flag("wheel-separation", "M", "From track to track, m.")] = None,
    wheel_speed_max: Annotated[Flag, _flag("wheel-speed-max", "M/S", "Fastest a wheel goes, m/s.")] = None,
    units_per_mps: Annotated[
        Flag, _flag("units-per-mps", "N", "Units of its speed command for 1 m/s.")
    ] = None,
    metres_per_count: Annotated[
        Flag, _flag("metres-per-count", "M", "Way of a wheel for one count, m.")
    ] = None,
    counter_bits: Annotated[Flag, _flag("counter-bits", "N", "Of its counters; 32 by default.")] = None,
    set_speed: Annotated[
        Flag, _flag("set-speed", "TEXT", "Like D,{left},{right}; binary: bc {left:h} {right:h}.")
    ] = None,
    reply: Annotated[Flag, _flag("reply", "TEXT", "Its reply's head, like d; binary: its layout.")] = None,
    position: Annotated[Flag, _flag("position", "TEXT", "Request for both position counters.")] = None,
    position_reply: Annotated[
        Flag, _flag("position-reply", "TEXT", "Its reply's head; binary: its layout.")
    ] = None,
    identify: Annotated[Flag, _flag("identify", "TEXT", "Request that names its firmware.")] = None,
    identify_reply: Annotated[Flag, _flag("identify-reply", "TEXT", "Its reply's head.")] = None,
    error_head: Annotated[Flag, _flag("error-head", "TEXT", "What a refusal begins with.")] = None,
    terminator: Annotated[Flag, _flag("terminator", "cr|lf", "Ends a request; cr by default.")] = None,
    set_speed_bytes: Annotated[Flag, _flag("set-speed-bytes", "N", "python: of the longest request.")] = None,
    reply_bytes: Annotated[Flag, _flag("reply-bytes", "N", "python: of its longest reply.")] = None,
    position_bytes: Annotated[
        Flag, _flag("position-bytes", "N", "python: of the request for counters.")
    ] = None,
    position_reply_bytes: Annotated[Flag, _flag("position-reply-bytes", "N", "python: of its reply.")] = None,
    reply_timeout: Annotated[Flag, _flag("reply-timeout", "S", "Seconds to wait; 0.2 by default.")] = None,
    dead_man: Annotated[Flag, _flag("dead-man", "yes|no", "Does it stop by itself without orders?")] = None,
    hint: Annotated[Flag, _flag("hint", "TEXT", "What to check when it does not answer.")] = None,
    raw: Annotated[
        Flags, _flag("raw", "PART", "Numbers: 'name=floor names=left,right send=F reply=f'.")
    ] = None,
    range_: Annotated[
        Flags, _flag("range", "PART", "Distance sensors: as --raw, and headings=, distances= ...")
    ] = None,
    battery: Annotated[
        Flags, _flag("battery", "PART", "'send=V reply=v volts=0.01 empty=3.4 full=4.2'.")
    ] = None,
    lights: Annotated[
        Flags,
        _flag("lights", "PART", "'name=lamp channels=lamp send=L,{value} reply=l'. All four: repeatable."),
    ] = None,
    folder: Folder = Path(),
    force: Annotated[bool, typer.Option("--force", help="Write over a type of that name.")] = False,
) -> None:
    """Write a robot type of your own to DIR/robots/NAME.yaml; with --protocol python also a class to NAME.py.

    What no flag says is asked for on a terminal; elsewhere it has its default, or the program ends. A PART is
    a sensor or a light, as key=value words; without a value it tells its keys.
    """
    from swarmctl.cli import driver_parts
    from swarmctl.render import own_type

    said = {"raw": raw, "range": range_, "battery": battery, "lights": lights}
    flags = {key: value for key, value in locals().items() if key in {one.name for one in own_type.QUESTIONS}}
    if not _NAME.fullmatch(name):
        console.fail(
            f"`{name}` is no name for a type",
            "lower-case letters, digits, dots and hyphens, a letter first, 31 at most",
            code=exits.USAGE,
        )
    file = folder / "robots" / f"{name}.yaml"
    _not_there(file, force=force)
    answers = _answered(name, {key: value for key, value in flags.items() if value is not None})
    driver_parts.add(name, answers, {kind: texts for kind, texts in said.items() if texts})
    files = {file: own_type.type_text(name, answers, schema=(folder / ".swarmctl").is_dir())}
    if answers["protocol"] == "python":
        files[file.with_suffix(".py")] = own_type.codec_text(name, answers)
    _write(files, force=force)
    _next(name, files)


def _answered(name: str, flags: Mapping[str, str]) -> dict[str, Any]:
    """Every answer: a flag's, else one that is asked for, else the default."""
    from swarmctl.render.own_type import questions

    asking = sys.stdin.isatty()
    if not asking:
        _all_said(flags)
    answers: dict[str, Any] = {}
    while left := questions(answers.get("protocol", "line"), answers):
        question = left[0]
        if question.name not in flags and asking:
            ask(question, partial(_taken, name, question, answers))
        elif wrong := _taken(name, question, answers, flags.get(question.name, question.usual)):
            console.fail(f"{question.flag}: {wrong[0]}", *wrong[1:], code=exits.USAGE)
    for idle in flags.keys() - answers.keys():
        kind = answers["protocol"]
        console.fail(f"--{idle.replace('_', '-')} is nothing for a protocol of kind {kind}", code=exits.USAGE)
    return answers


def _all_said(flags: Mapping[str, str]) -> None:
    """Where nobody can be asked, the program ends with all that is missing."""
    from swarmctl.render.own_type import questions

    missing = [one for one in questions(flags.get("protocol", "line"), flags) if one.default is None]
    if missing:
        console.fail(
            f"these are needed: {', '.join(one.flag for one in missing)}",
            *(f"{one.flag}, like {one.sample}: {one.text}" for one in missing),
            code=exits.USAGE,
        )


def ask(question: Question, taken: Callable[[str], tuple[str, ...]]) -> None:
    """Until the answer is right: ``taken`` says what is wrong with it."""
    default = None if question.default is None else question.usual
    while True:
        text = typer.prompt(question.text, default=default, show_default=bool(default), err=True)
        wrong = taken(text)
        for line in wrong:
            typer.echo(f"  {line}", err=True)
        if not wrong:
            return


def _taken(name: str, question: Question, answers: dict[str, Any], text: str) -> tuple[str, ...]:
    """Take an answer, or say what is wrong with it, in the words that the file would bring."""
    from swarmctl.render.questions import read_answer

    try:
        value = read_answer(question, text)
    except ValueError as error:
        return (str(error),)
    wrong = complaints(name, {**answers, question.name: value})
    if not wrong:
        answers[question.name] = value
    return wrong


def complaints(name: str, answers: Mapping[str, Any]) -> tuple[str, ...]:
    """What is wrong with the answers so far, line by line."""
    from swarmctl.render.own_type import complaint

    found = complaint(name, answers)
    if found is None:
        return ()
    return (found.message + (f" ({found.label})" if found.label else ""), *found.help)


@contextmanager
def _on_disk() -> Iterator[None]:
    """What the disk refuses is told, with the file."""
    try:
        yield
    except OSError as error:
        console.fail(f"cannot write {error.filename}: {error.strerror or error}", "choose another --dir")


def _not_there(file: Path, *, force: bool) -> None:
    for one in (file, file.with_suffix(".py")):
        with _on_disk():
            taken = one.exists()
        if taken and not force:
            console.fail(f"{one} is there already", "choose another name, or write over it with --force")


def _write(files: Mapping[Path, str], *, force: bool) -> None:
    with _on_disk():
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("w" if force else "x", encoding="utf-8") as file:
                file.write(text)


def _next(name: str, files: Mapping[Path, str]) -> None:
    for path in files:
        console.out().print(f"{path}: written")
    console.out().print(f"now try it: swarmctl driver test {name} --port PORT")
