"""``--limit`` and the other selections of verbs: what they select, and that nothing selected is an error."""

from __future__ import annotations

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from swarmctl.cli import exit_codes, selected
from swarmctl.cli.app import run
from swarmctl.lab import lab
from swarmctl.lab.lab_plan import part_of, plan_of
from tests.loading import load_swarm

SPEC = """\
version: 1
name: shelf
mode: leader
leader: laptop
hosts:
  laptop: {address: 192.168.77.10}
  pi-[1-3]: {address: "192.168.77.[11-13]", labels: [shelf]}
robots:
  k3-[1-4]: {type: khepera3, host: "pi-[1-3,3]"}
  rover: {type: arduino-rover, host: laptop}
groups:
  old: [k3-1, k3-2]
links:
  - {kind: wlan, name: lab, hosts: ["*"]}
  - {kind: serial, host: "pi-[1-3,3]", robot: "k3-[1-4]", usb: {serial: "FT-[1-4]"}}
  - {kind: serial, host: laptop, robot: rover, usb: {serial: "5573"}}
control:
  - {by: laptop, of: ["@old", rover]}
"""


@pytest.fixture
def spec(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("NO_COLOR", "1")
    path = tmp_path / "swarm.yaml"
    path.write_text(SPEC)
    return str(path)


@dataclass
class Fleet:
    """The lab of ``spec``, or of a part of it, and the calls that verbs make of it."""

    spec: str
    patch: pytest.MonkeyPatch
    calls: list[str] = field(default_factory=list)

    def boot(self, *only: str) -> None:
        swarm, _ = load_swarm(Path(self.spec))
        assert swarm is not None
        plan = part_of(plan_of(swarm), list(only) or list(swarm.hosts))
        self.patch.setattr(lab, "plan", lambda _: plan)
        self.patch.setattr(lab, "operator", lambda _: SimpleNamespace(swarm="shelf"))
        self.patch.setattr(lab, "fault", self._fault)
        self.patch.setattr(lab, "repair", self._repair)

    def _fault(self, _: str, kind: str, target: str, value: object) -> str:
        self.calls.append(" ".join([kind, target, *([] if value is None else [str(value)])]))
        return kind

    def _repair(self, _: str, __: object, hosts: list[str] | None, robots: list[str] | None) -> None:
        self.calls.append(f"repair {hosts} {robots}")


@pytest.fixture
def fleet(spec: str, monkeypatch: pytest.MonkeyPatch) -> Fleet:
    found = Fleet(spec, monkeypatch)
    found.boot()
    return found


def rendered(spec: str, *selections: str) -> list[str]:
    """The hosts of which ``render`` writes the releases."""
    out = Path(spec).parent / "out"
    limits = [word for one in selections for word in ("--limit", one)]
    assert run(["render", spec, "--out", str(out), *limits]) == exit_codes.OK
    return sorted(one.name for one in out.iterdir())


@pytest.mark.parametrize(
    ("selections", "hosts"),
    [
        (["pi-*"], "pi-1 pi-2 pi-3"),
        (["@shelf,!pi-2"], "pi-1 pi-3"),
        (["@old"], "pi-1 pi-2"),
        (["pi-[1-2]", "laptop", "!k3-1"], "laptop pi-2"),
        (["type:arduino-rover"], "laptop"),
        (["mode:leader&pi-3"], "pi-3"),
    ],
)
def test_limit_selects_hosts(spec: str, selections: list[str], hosts: str) -> None:
    assert rendered(spec, *selections) == hosts.split()


def test_a_robot_means_its_host_and_a_note_names_both(spec: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert rendered(spec, "k3-4") == ["pi-3"]
    assert "note: --limit selects hosts: pi-3 for k3-4 (pi-3 drives k3-3 too)\n" in capsys.readouterr().err


VERBS = [
    ("plan", "--offline", "--limit"),
    ("deploy", "--limit"),
    ("status", "--limit"),
    ("prepare", "--yes", "--limit"),
    ("remove", "--yes", "--limit"),
    ("render", "--out", "nowhere", "--host"),
    ("trust", "--host"),
    ("graph", "--limit"),
    ("lab up", "--only"),
]


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb[0])
def test_nothing_selected_is_an_error(
    spec: str, verb: tuple[str, ...], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(Path(spec).parent)
    name, *words = verb
    assert run([*name.split(), spec, *words, "pi-*&laptop"]) == exit_codes.ERROR
    err = capsys.readouterr().err
    option = words[-1].replace("--host", "--limit")
    assert f"error: {option}: `pi-*&laptop` selects no host\n" in err
    assert "the hosts are: `laptop`, `pi-1`, `pi-2`, `pi-3`\n" in err
    assert "groups, labels and islands: `@old`, `@shelf`\n" in err
    assert not Path("nowhere").exists()


def graph(spec: str, capsys: pytest.CaptureFixture[str], *options: str) -> str:
    assert run(["graph", spec, *options]) == exit_codes.OK
    return capsys.readouterr().out


def test_a_graph_of_a_part(spec: str, capsys: pytest.CaptureFixture[str]) -> None:
    """The rest of the swarm is left out, but who commands the part is named."""
    whole, part = (
        json.loads(graph(spec, capsys, "--format", "json", *limit)) for limit in ([], ["--limit", "pi-1"])
    )
    assert [one["id"] for one in part["nodes"]] == ["host:laptop", "host:pi-1", "robot:k3-1", "network:lab"]
    assert {(one["start"], one["end"]) for one in part["edges"]} == {
        ("host:pi-1", "network:lab"), ("host:pi-1", "robot:k3-1"), ("host:laptop", "robot:k3-1"),
    }  # fmt: skip
    assert [(one["from"], one["to"]) for one in part["paths"]] == [("laptop", "k3-1")]
    assert [one["robot"] for one in part["budgets"]["lines"]] == ["k3-1"]
    assert part["budgets"]["networks"] == whole["budgets"]["networks"]  # others send there too
    lost = {(one["kind"], one["name"]) for one in part["impact"]}
    assert {("host", "pi-1"), ("host", "laptop"), ("network", "lab"), ("robot", "k3-1")} <= lost
    assert not lost & {("host", "pi-2"), ("robot", "rover")}
    tree = graph(spec, capsys, "--limit", "pi-1")
    assert "pi-1  " in tree
    assert "commanded by laptop" in tree
    assert "\n  laptop" not in tree


def test_the_graph_of_all_hosts_is_that_without_a_limit(
    spec: str, leader_spec: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for one in (spec, str(leader_spec)):
        assert graph(one, capsys, "--format", "json", "--limit", "*") == graph(
            one, capsys, "--format", "json"
        )


def test_an_error_names_the_column_and_a_likely_word(spec: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["plan", spec, "--offline", "--limit", "pi-*,!@sehlf"]) == exit_codes.ERROR
    err = capsys.readouterr().err
    assert "error: --limit `pi-*,!@sehlf`, column 7: there is no group or label called `sehlf`\n" in err
    assert "did you mean `@shelf`?" in err


def test_boards_are_selected_too(spec: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["firmware", "flash", spec, "k3-[1-2]", "--dry-run"]) == exit_codes.ERROR
    assert "no robot of this swarm has a board" in capsys.readouterr().err
    assert run(["firmware", "flash", spec, "type:nothing", "--dry-run"]) == exit_codes.ERROR
    assert "ROBOT: there is no robot of the type `nothing`" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("line", "called", "printed"),
    [
        ("fault link-down @shelf,!pi-2", "link-down pi-1; link-down pi-3", "pi-[1,3]: link-down\n"),
        (
            "fault link-down pi-1 k3-4 --network lab",
            "link-down pi-1 lab; link-down pi-3 lab",
            "pi-[1,3]: link-down\n",
        ),
        ("fault power-off pi-*", "power-off pi-1; power-off pi-2; power-off pi-3", "pi-[1-3]: power-off\n"),
        ("fault loss pi-1 --percent 2", "loss pi-1 2.0", "pi-1: loss\n"),
        ("fault unplug @old", "unplug k3-1; unplug k3-2", "k3-[1-2]: unplug\n"),
        ("fault kill pi-3", "kill k3-3; kill k3-4", "k3-[3-4]: kill\n"),
        ("repair", "repair None None", "lab shelf: no faults\n"),
        ("repair pi-3", "repair ['pi-3'] ['k3-3', 'k3-4']", "pi-3, k3-[3-4]: no faults\n"),
        ("repair k3-3 pi-1", "repair ['pi-1'] ['k3-1', 'k3-3']", "pi-1, k3-[1,3]: no faults\n"),
    ],
)
def test_faults_of_a_lab_take_selections(
    fleet: Fleet, line: str, called: str, printed: str, capsys: pytest.CaptureFixture[str]
) -> None:
    words = line.split()
    at = 2 if words[0] == "fault" else 1
    assert run(["lab", *words[:at], fleet.spec, *words[at:]]) == exit_codes.OK
    assert "; ".join(fleet.calls) == called
    assert capsys.readouterr().out == printed


@pytest.mark.parametrize(
    ("verb", "called"),
    [
        (["unplug", "k3-[1-2]"], ["unplug k3-1", "unplug k3-2"]),
        (["power-off", "k3-4", "laptop"], ["power-off laptop", "power-off pi-3"]),
    ],
)
def test_faults_of_a_named_lab_need_no_valid_spec(fleet: Fleet, verb: list[str], called: list[str]) -> None:
    Path(fleet.spec).write_text(SPEC.replace("mode:", "mod:"))
    word, *selections = verb
    assert run(["lab", "fault", word, fleet.spec, *selections, "--name", "shelf"]) == exit_codes.OK
    assert fleet.calls == called


def test_a_group_in_a_named_lab_needs_the_spec(fleet: Fleet, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["lab", "fault", "unplug", fleet.spec, "@old", "--name", "shelf"]) == exit_codes.OK
    assert fleet.calls == ["unplug k3-1", "unplug k3-2"]
    Path(fleet.spec).write_text(SPEC.replace("mode:", "mod:"))
    assert run(["lab", "fault", "unplug", fleet.spec, "@old", "--name", "shelf"]) == exit_codes.ERROR
    assert "`mode`" in capsys.readouterr().err


def test_what_a_lab_of_a_part_lacks_is_left_out(fleet: Fleet, capsys: pytest.CaptureFixture[str]) -> None:
    fleet.boot("laptop", "pi-1")
    assert run(["lab", "fault", "power-off", fleet.spec, "pi-*"]) == exit_codes.OK
    assert fleet.calls == ["power-off pi-1"]
    assert "note: lab shelf has no pi-[2-3]\n" in capsys.readouterr().err
    assert run(["lab", "fault", "power-off", fleet.spec, "pi-2"]) == exit_codes.ERROR
    err = capsys.readouterr().err
    assert "error: lab shelf has no pi-2\n  help: it has laptop, pi-1\n" in err


ONE_NAME = [
    (("lab shell", "pi-*"), "error: HOST: `pi-*` selects 3 hosts, and one is needed\n", "pi-[1-3]"),
    (("graph", "--path", "laptop", "@old"), "error: --path TO: `@old` selects 2 robots", "k3-[1-2]"),
    (("graph", "--path", "pi-*", "rover"), "error: --path FROM: `pi-*` selects 3 hosts", "pi-[1-3]"),
    (("graph", "--path", "laptop", "rovr"), "error: --path TO: there is no", "did you mean `rover`"),
]


def test_the_hosts_and_robots_of_a_lab_that_are_shown(
    fleet: Fleet, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    hosts = [{"name": name} for name in ("laptop", "pi-1", "pi-2", "pi-3")]
    monkeypatch.setattr(lab, "status", lambda _: {"hosts": hosts, "networks": []})
    robots: dict[str, object] = {name: {} for name in ("k3-1", "k3-2", "k3-3", "k3-4", "rover")}
    monkeypatch.setattr(lab, "robots", lambda _: robots)
    assert run(["lab", "status", fleet.spec, "--json", "--limit", "@shelf,!k3-2"]) == exit_codes.OK
    shown = json.loads(capsys.readouterr().out)
    assert [one["name"] for one in shown["hosts"]] == ["pi-1", "pi-3"]
    assert run(["lab", "robots", fleet.spec, "--json", "--limit", "@old,pi-3"]) == exit_codes.OK
    assert list(json.loads(capsys.readouterr().out)["robots"]) == ["k3-1", "k3-2", "k3-3", "k3-4"]
    assert run(["lab", "robots", fleet.spec, "--limit", "k3-9"]) == exit_codes.ERROR
    assert "error: --limit: there is no" in capsys.readouterr().err


def test_robots_with_stand_ins_are_shown_in_a_lab_that_is_named(
    fleet: Fleet, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    cart = SimpleNamespace(robot="cart", host="pi-1")
    plan = replace(lab.plan("shelf"), stand_ins=(cart,))
    monkeypatch.setattr(lab, "plan", lambda _: plan)
    monkeypatch.setattr(lab, "robots", lambda _: {"cart": {}, "rover": {}})
    assert run(["lab", "robots", fleet.spec, "--name", "shelf", "--json", "--limit", "cart"]) == exit_codes.OK
    assert list(json.loads(capsys.readouterr().out)["robots"]) == ["cart"]
    assert run(["lab", "fault", "unplug", fleet.spec, "cart", "--name", "shelf"]) == exit_codes.ERROR
    assert "error: lab shelf has no cable of cart" in capsys.readouterr().err


def test_a_spec_that_is_not_there_is_an_error_for_a_named_lab_too(
    fleet: Fleet, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(["lab", "robots", "no-spec.yaml", "--name", "shelf"]) == exit_codes.ERROR
    assert "there is no file `no-spec.yaml`" in capsys.readouterr().err


@pytest.mark.parametrize(("words", "error", "candidates"), ONE_NAME)
def test_where_one_name_is_needed_several_are_an_error(
    fleet: Fleet, words: tuple[str, ...], error: str, candidates: str, capsys: pytest.CaptureFixture[str]
) -> None:
    verb, *rest = words
    assert run([*verb.split(), fleet.spec, *rest]) == exit_codes.ERROR
    err = capsys.readouterr().err
    assert error in err
    assert candidates in err


def test_a_selection_of_one_robot_is_its_name(spec: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["graph", spec, "--path", "laptop", "type:arduino-rover"]) == exit_codes.OK
    captured = capsys.readouterr()
    assert "rover" in captured.out
    assert captured.err == "note: --path TO selects rover\n"


@pytest.mark.parametrize(
    ("words", "found"),
    [
        ((), {"laptop": [], "pi-1": [], "pi-2": [], "pi-3": []}),
        (("k3-1",), {"pi-1": ["k3-1"]}),
        (("k3-3", "pi-1"), {"pi-1": [], "pi-3": ["k3-3"]}),
        (("@old",), {"pi-1": ["k3-1"], "pi-2": ["k3-2"]}),
        (("map", "k3-3"), {"laptop": ["map"], "pi-3": ["k3-3"]}),
        (("program:map", "laptop"), {"laptop": []}),
    ],
)
def test_parts_of_hosts_are_robots_and_programs(
    spec: str, words: tuple[str, ...], found: dict[str, list[str]]
) -> None:
    Path(spec).write_text(f"{SPEC}programs:\n  map: {{host: laptop, command: [map]}}\n")
    swarm, _ = load_swarm(Path(spec))
    assert swarm is not None
    assert selected.parts(swarm.candidates, words, "SELECTION") == found


def test_the_effective_spec_shows_the_names(spec: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["spec", spec, "--expanded", "--json"]) == exit_codes.OK
    effective = json.loads(capsys.readouterr().out)
    assert effective["spec"]["control"][0]["of"] == ["k3-1", "k3-2", "rover"]
    assert effective["spec"]["groups"] == {"old": ["k3-1", "k3-2"]}
    assert effective["origins"]["/control/0/of/0"]["line"] == 18
