"""Every page: its links lead somewhere, its commands are understood, its specs say what can be said."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from swarmctl.checks.check import read
from swarmctl.cli.app import app
from swarmctl.spec.load import load

ROOT = Path(__file__).parents[1]
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("examples/*/README.md")])
EXAMPLE = ROOT / "examples/paper-leader/swarm.yaml"


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def blocks(page: Path, *languages: str) -> list[str]:
    found = re.findall(r"^```(\w*)\n(.*?)^```$", page.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    return [text for language, text in found if language in languages]


def anchors(page: Path) -> set[str]:
    """The headings, as GitHub names them."""
    headings = re.findall(r"^#+ (.+)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def commands(page: Path) -> Iterator[list[str]]:
    """The arguments of each `swarmctl ...`, in blocks and in sentences."""
    text = page.read_text("utf-8")
    lines = "\n".join(blocks(page, "sh", "console")).replace("\\\n", " ").splitlines()
    shown = [re.sub(r"^\$ ", "", line) for line in lines]
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    shown += [" ".join(one.split()) for one in re.findall(r"`(swarmctl [^`]+)`", prose)]
    for line in shown:
        words = shlex.split(line, comments=True)
        for start in (index for index, word in enumerate(words) if word == "swarmctl"):
            ends = [index for index in range(start, len(words)) if words[index] in ("|", "||", "&&", ">")]
            yield words[start + 1 : min(ends, default=len(words))]


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_its_links_lead_somewhere(page: Path) -> None:
    for link in re.findall(r"\]\(([^)\s]+)\)", page.read_text("utf-8")):
        if re.match(r"https?://", link):
            continue
        path, _, anchor = link.partition("#")
        target = page.parent / path if path else page
        assert target.exists(), link
        assert not anchor or anchor in anchors(target), link


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_its_commands_are_understood(page: Path) -> None:
    for words in commands(page):
        command: Any = typer.main.get_command(app)
        rest = words
        while hasattr(command, "commands") and rest and not rest[0].startswith("-"):
            assert rest[0] in command.commands, words
            command, rest = command.commands[rest[0]], rest[1:]
        context = command.context_class(command, info_name=command.name, resilient_parsing=True)
        command.make_parser(context).parse_args(args=list(rest))  # an unknown option raises


@pytest.mark.parametrize("page", [page for page in PAGES if page.name != "rules.md"], ids=name_of)
def test_its_specs_say_what_can_be_said(page: Path, tmp_path: Path) -> None:
    """A part is laid over the example. (The page of rules shows wrong ones, and has tests of its own.)"""
    for text in blocks(page, "yaml"):
        if re.search(r"^(version|mode|hosts|robots|links|programs|control|multimaster):", text, re.MULTILINE):
            shown = tmp_path / "shown.yaml"
            shown.write_text(text, "utf-8")
            _, found = read(shown) if text.startswith("version:") else load([EXAMPLE, shown])
            assert [one.message for one in found] == []
