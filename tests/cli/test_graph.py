"""`swarmctl graph` word for word on the example; what other programs are to read, read by them."""

from __future__ import annotations

import doctest
import json
import re
import shlex
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import lxml.html
import networkx as nx
import pydot
import pytest

import swarmctl
from swarmctl.analysis.diagram import Diagram, Edge, Node
from swarmctl.cli import exit_codes
from swarmctl.cli.app import run
from swarmctl.views.graph import dot, mermaid, page, svg
from swarmctl.yamltext import hostlist
from tests import ROOT

GOLDEN = Path(__file__).parent / "golden/graph"

PAGE = (ROOT / "docs/graph.md").read_text("utf-8")
COMMANDS = re.findall(r"^swarmctl (.+?)(?: +#.*)?$", PAGE, re.MULTILINE)
NASTY = 'a "quoted" \\ <b>name</b>; end\n]} #35; ünïcode'


@pytest.fixture(autouse=True)
def beside_the_example(monkeypatch: pytest.MonkeyPatch, leader_spec: Path) -> None:
    monkeypatch.chdir(leader_spec.parent)
    monkeypatch.delenv("FORCE_COLOR", raising=False)
    monkeypatch.setenv("NO_COLOR", "1")


def printed(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert run(["graph", "swarm.yaml", *arguments]) == exit_codes.OK
    return capsys.readouterr().out


def test_two_formats_are_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["graph", "swarm.yaml", "--json", "--format", "dot"]) == exit_codes.USAGE
    assert capsys.readouterr().err == "error: --json and --format dot exclude each other\n"


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("overview.txt", []),
        ("impact.txt", ["--impact"]),
        ("paths.txt", ["--paths"]),
        ("budgets.txt", ["--budgets"]),
        ("flows.txt", ["--security"]),
        ("graph.dot", ["--format", "dot"]),
        ("graph.mermaid", ["--format", "mermaid"]),
        ("graph.svg", ["--format", "svg"]),
        ("graph.graphml", ["--format", "graphml"]),
        ("graph.json", ["--format", "json"]),
        ("graph.json", ["--json"]),
    ],
)
def test_word_for_word(
    name: str,
    arguments: list[str],
    golden: Callable[[Path, str], None],
    capsys: pytest.CaptureFixture[str],
) -> None:
    golden(GOLDEN / name, printed(capsys, *arguments))


def test_graphviz_reads_the_dot(capsys: pytest.CaptureFixture[str]) -> None:
    [read] = pydot.graph_from_dot_data(printed(capsys, "--format", "dot"))
    document = json.loads(printed(capsys, "--format", "json"))
    edges = {(one.get_source().strip('"'), one.get_destination().strip('"')) for one in read.get_edges()}
    assert edges == {(one["start"], one["end"]) for one in document["edges"]}
    nodes = {
        node.get_name().strip('"') for part in (read, *read.get_subgraphs()) for node in part.get_nodes()
    }
    assert {one["id"] for one in document["nodes"]} <= nodes


def test_edges_join_nodes_that_there_are(capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(printed(capsys, "--format", "json"))
    ids = {one["id"] for one in document["nodes"]}
    assert all({one["start"], one["end"]} <= ids for one in document["edges"])


def nasty() -> Diagram:
    """A picture whose every text is foreign."""
    nodes = (Node("host", "h", NASTY, NASTY), Node("program", "p", NASTY))
    return Diagram(NASTY, "leader", ((NASTY, "h"),), nodes, (Edge("data", "host:h", "program:p", NASTY),))


def test_no_text_breaks_out_of_the_dot() -> None:
    [read] = pydot.graph_from_dot_data(dot.graph(nasty()))
    assert [len(read.get_edges()), len(read.get_subgraphs())] == [1, 1]
    [edge] = read.get_edges()
    assert edge.get_label().strip('"').replace('\\"', '"').replace("\\\\", "\\") == NASTY


def test_no_text_breaks_out_of_the_mermaid() -> None:
    drawn = mermaid.graph(nasty())
    assert len(drawn.splitlines()) == 6  # flowchart, subgraph, host, end, program, edge
    for text in re.findall(r'"(.*?)"', drawn):
        assert not re.search(r'[<>\\"\[\]{}|;]', re.sub(r"#\d+;|<br/>", "", text))


def test_no_text_breaks_out_of_the_svg_or_the_page() -> None:
    read = ElementTree.fromstring(svg.graph(nasty()))
    assert f"data {NASTY}".replace("\n", "\\x0a") in [
        one.text for one in read.iter("{http://www.w3.org/2000/svg}title")
    ]
    shown = lxml.html.fromstring(page.graph(nasty()))
    assert not shown.xpath("//b")
    [data] = shown.xpath("//script[@id='diagram']/text()")
    assert json.loads(data)["swarm"] == NASTY


def test_the_page_needs_nothing_but_itself(capsys: pytest.CaptureFixture[str]) -> None:
    shown = lxml.html.fromstring(printed(capsys, "--format", "html"))
    assert shown.xpath("//*[@src or @href]/@href | //@src") == ["data:,"]
    assert len(shown.xpath("//*[@data-id]")) == 7


def test_a_drawing_has_no_tables(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["graph", "swarm.yaml", "--format", "dot", "--impact"]) == exit_codes.USAGE
    assert "tables are text or json" in capsys.readouterr().err


def test_networkx_reads_the_graphml(capsys: pytest.CaptureFixture[str]) -> None:
    whole = swarmctl.graph("swarm.yaml")
    read = nx.parse_graphml(printed(capsys, "--format", "graphml"), force_multigraph=True)
    assert dict(read.nodes(data=True)) == dict(whole.nodes(data=True))
    assert set(read.edges(data="role")) == set(whole.edges(data="role"))
    part = nx.parse_graphml(printed(capsys, "--format", "graphml", "--limit", "k3-pi"), force_multigraph=True)
    assert set(part) == {"host:k3-pi", "network:lab", "line:k3", "robot:k3"}


def test_the_graph_in_a_notebook() -> None:
    [shown] = re.findall("```pycon\n(.+?)```", PAGE, re.DOTALL)
    ran = doctest.DocTestRunner().run(doctest.DocTestParser().get_doctest(shown, {}, "graph.md", None, None))
    assert (ran.failed, ran.attempted > 3) == (0, True)


def test_a_spec_with_errors_has_no_graph(tmp_path: Path) -> None:
    spec = tmp_path / "swarm.yaml"
    spec.write_text(Path("swarm.yaml").read_text("utf-8").replace("mode: leader", "mode: leeder"), "utf-8")
    with pytest.raises(ValueError, match=r"swarm.yaml:\d+:\d+: .*leeder"):
        swarmctl.graph(spec)


def test_a_misspelt_commander_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["graph", "swarm.yaml", "--path", "koala-laptob", "k3"]) == exit_codes.ERROR
    assert "did you mean `koala-laptop`?" in capsys.readouterr().err


@pytest.mark.parametrize("command", COMMANDS)
def test_the_commands_of_the_page_run(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(shlex.split(command)) == exit_codes.OK
    assert capsys.readouterr().out


def test_the_page_shows_what_is_printed(capsys: pytest.CaptureFixture[str]) -> None:
    shown = re.findall("```text\n(.+?)```", PAGE, re.DOTALL)
    options = (["--impact"], ["--path", "koala-laptop", "k3"], ["--budgets"])
    for block, arguments in zip(shown, options, strict=True):
        lines = printed(capsys, *arguments).splitlines()
        assert block.splitlines() == [line.rstrip() for line in lines]


def test_every_key_of_the_document_is_explained(capsys: pytest.CaptureFixture[str]) -> None:
    document = json.loads(printed(capsys, "--format", "json"))
    rows = "".join(line for line in PAGE.splitlines() if line.startswith("|"))
    words = set(re.findall(r"`(\w+)`", rows))
    assert set(document) - {"v"} <= words
    for part in ("islands", "nodes", "edges", "impact"):
        assert {key for one in document[part] for key in one} <= words


def test_a_plan_names_where_the_swarm_is_weakest(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert run(["plan", "--offline", "swarm.yaml"]) == exit_codes.OK
    assert (
        "single points of failure\n"
        "  ! host koala-laptop  koala loses its driver; k3, epuck lose command; "
        "island newswarm loses its master\n"
        "  ! master newswarm    koala, k3, epuck lose command; island newswarm loses its master\n"
        "  ! network lab        k3, epuck lose command\n"
    ) in capsys.readouterr().out
    assert run(["plan", "--offline", "--json", "swarm.yaml"]) == exit_codes.OK
    weakest = json.loads(capsys.readouterr().out)["single_points_of_failure"]
    assert [(one["kind"], one["name"]) for one in weakest] == [
        ("host", "koala-laptop"),
        ("master", "newswarm"),
        ("network", "lab"),
    ]


def test_the_tree_of_a_fleet_folds_equal_hosts(capsys: pytest.CaptureFixture[str]) -> None:
    fleet = str(ROOT / "examples/lab-fleet/swarm.yaml")
    assert run(["graph", fleet]) == exit_codes.OK
    folded = capsys.readouterr().out.splitlines()
    assert run(["graph", fleet, "--details"]) == exit_codes.OK
    each = capsys.readouterr().out.splitlines()
    assert "  tb3-[01-20]  20 hosts, each raspberry-pi-3b; on lab" in folded
    assert (
        "    robot epuck-[07-12]  epuck2 by bluetooth hci[0-1]; commanded by joystick, circle-epucks"
        in folded
    )
    assert len(folded) < 30
    assert len(each) > 90
    assert listed(folded) == listed(each)


def listed(lines: list[str]) -> list[tuple[str, str]]:
    """What the lines of a tree name, by kind: hosts, robots and programs, ranges written out."""
    found: list[tuple[str, str]] = []
    for line in lines:
        if line.startswith("  "):
            words, _, _ = line.strip().partition("  ")
            kind, _, names = words.partition(" ") if line.startswith("    ") else ("host", "", words)
            for text in names.split(", "):
                one = hostlist.read(text)
                each = one.names if isinstance(one, hostlist.Range) else [text]
                found += [(kind, name) for name in each]
    return sorted(found)
