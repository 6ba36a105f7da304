"""Every page: its links lead somewhere, its commands exist, its specs are valid."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import typer

from swarmctl.cli.app import app
from swarmctl.spec.load import load
from tests import ROOT
from tests.loading import load_swarm

PAGES = sorted(
    [
        *ROOT.glob("*.md"),
        *ROOT.glob("docs/*.md"),
        *ROOT.glob("examples/*/README.md"),
        ROOT / "tests/README.md",
    ]
)
#: The pages for contributors name files of the repository, and short names beside the file named before.
OF_FILES = [ROOT / one for one in ("docs/architecture.md", "CONTRIBUTING.md", "tests/README.md")]
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


def context_of(command: Any) -> Any:
    return command.context_class(command, info_name=command.name, resilient_parsing=True)


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
            _, command, rest = command.resolve_command(context_of(command), list(rest))
        command.make_parser(context_of(command)).parse_args(args=list(rest))  # an unknown option raises


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_its_specs_are_valid(page: Path, tmp_path: Path) -> None:
    """A part is laid over the spec beside the page, else over the example."""
    base = page.with_name("swarm.yaml") if page.with_name("swarm.yaml").exists() else EXAMPLE
    for text in blocks(page, "yaml"):
        if re.search(r"^(version|mode|hosts|robots|links|programs|control|multimaster):", text, re.MULTILINE):
            shown = tmp_path / "shown.yaml"
            shown.write_text(text, "utf-8")
            _, found = load_swarm(shown) if text.startswith("version:") else load([base, shown])
            assert [one.message for one in found] == []


@pytest.mark.parametrize("page", OF_FILES, ids=name_of)
def test_files_that_a_page_names_exist(page: Path) -> None:
    folder = ROOT
    for line in page.read_text("utf-8").splitlines():
        for named in re.findall(r"`([\w*./<>-]+)`", line):
            path = re.sub(r"<\w+>|NAME|what", "*", named)
            if re.match(r"(swarmctl|templates|tests|docs|examples|benchmarks)/", path):
                assert list(ROOT.glob(path)) or "*" in path.rpartition("/")[2], named
                folder = ROOT / path.rpartition("/")[0]
            elif re.fullmatch(r"[\w.]+\.(py|j2)", path):
                near = [*folder.glob(path), *(ROOT / "templates").glob(f"*/{path}"), *page.parent.glob(path)]
                assert near, named


def test_the_layers_of_the_page_are_those_of_the_contract() -> None:
    contract = re.search(r"^layers = \[\n(.*?)^\]", (ROOT / "pyproject.toml").read_text("utf-8"), re.S | re.M)
    assert contract
    layers = re.findall(r'"(.+)"', contract[1])
    assert "\n".join(layers).replace("swarmctl.", "") in (ROOT / "docs/architecture.md").read_text("utf-8")
