"""A middleware and a provider from outside go from the spec to bundle, plan and expected graph."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from swarm_agent.messages import Facts

from swarmctl import plugins
from swarmctl.analysis.host_load import host_budgets
from swarmctl.diagnostics import Diagnostic
from swarmctl.health.expected_bridges import ExpectedMultimaster
from swarmctl.health.expected_graph import Release, expected_graph
from swarmctl.health.probe_request import request
from swarmctl.health.root_cause import diagnose
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.plan import Kind
from swarmctl.plan.reconcile import reconcile
from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.middleware import Middleware
from swarmctl.render.multimaster.base import MultimasterProvider
from swarmctl.rules.context import RuleContext
from swarmctl.rules.runner import load_swarm
from swarmctl.schema.json_schema import schema_of
from swarmctl.spec.load import load
from swarmctl.swarm.resolved import Swarm
from tests import ROOT
from tests.seams.toy import MESH, PEBBLE

SPEC = ROOT / "tests/mode_conversion/modes/standalone.yaml"
TOPICS = "topics: [{topic: /k3/odom, to: [koala-laptop]}]"
HUB, SILENT = "koala-laptop", "k3-pi"


@pytest.fixture
def registered() -> Iterator[None]:
    middleware: Middleware = PEBBLE
    provider: MultimasterProvider = MESH
    MIDDLEWARES.register("pebble", middleware)
    MULTIMASTERS.register("mesh", provider)
    yield
    MIDDLEWARES.unregister("pebble")
    MULTIMASTERS.unregister("mesh")


def written(
    tmp_path: Path, distro: str = "pebble", provider: str = "mesh", more: str = "", name: str = "newswarm"
) -> Path:
    spec = tmp_path / "swarm.yaml"
    text = f"{SPEC.read_text('utf-8')}ros: {{distro: {distro}}}\n".replace("name: newswarm", f"name: {name}")
    spec.write_text(f"{text}multimaster: {{provider: {provider}, {more}{TOPICS}}}\n", "utf-8")
    return spec


def swarm_of(spec: Path) -> Swarm:
    swarm, found = load_swarm(spec)
    assert swarm is not None, found
    return swarm


def findings(spec: Path, rule: str) -> list[Diagnostic]:
    return [one for one in load_swarm(spec)[1] if one.code == rule]


def paths(bundle: Bundle) -> set[str]:
    return {file.path for file in bundle.files}


@pytest.mark.usefixtures("registered")
def test_the_bundle_has_their_files_and_units(tmp_path: Path) -> None:
    made = bundles(swarm_of(written(tmp_path)))
    assert {"pebble/robots.txt", "pebble.bash", "mesh/topics.txt"} <= paths(made[HUB])
    assert "mesh/topics.txt" not in paths(made[SILENT])
    names = [unit.name for unit in made[HUB].units]
    assert [name for name in names if "pebbled" in name or "multimaster" in name] == [
        "swarm-newswarm.pebbled.service",
        "swarm-newswarm.multimaster.service",
    ]
    assert made[HUB].requires == ("pebbled",)
    assert not [path for path in paths(made[HUB]) if re.search(r"\bros|launch|\.master\.", path)]


@pytest.mark.usefixtures("registered")
def test_the_plan_starts_their_units(tmp_path: Path) -> None:
    bundle = bundles(swarm_of(written(tmp_path)))[HUB]
    plan = reconcile(bundle, Observed())
    assert "swarm-newswarm.pebbled.service" in plan.targets(Kind.START)
    assert "swarm-newswarm.multimaster.service" in plan.targets(Kind.START)
    assert "mesh/topics.txt" in plan.targets(Kind.CREATE)


@pytest.mark.usefixtures("registered")
def test_the_plan_shows_how_to_install_what_is_missing(tmp_path: Path) -> None:
    bundle = bundles(swarm_of(written(tmp_path)))[HUB]
    facts: Facts = {
        "hostname": HUB, "machine": "armv7l", "python": "3.8.10", "systemd": True, "uid": 0, "boot_id": "x",
        "time": 0.0, "free_bytes": 1 << 30, "free_inodes": 1 << 20, "has": {}, "absent": [],
    }  # fmt: skip
    problem = reconcile(bundle, Observed(facts=facts)).problem
    assert problem is not None
    assert problem.hint == "`pebble install pebbled`"


@pytest.mark.usefixtures("registered")
def test_the_expected_graph_has_their_nodes(tmp_path: Path) -> None:
    swarm = swarm_of(written(tmp_path))
    releases = {
        name: Release(one.digest, tuple(unit.name for unit in one.units))
        for name, one in bundles(swarm).items()
    }
    graph = expected_graph(swarm, releases)
    hosts = {host.name: host for host in graph.hosts}
    assert hosts[HUB].multimaster == ExpectedMultimaster(
        "swarm-newswarm.multimaster.service", ("/mesh_koala-laptop",), "/mesh_koala-laptop"
    )
    assert hosts[SILENT].multimaster is None
    assert [(one.topic, one.type, one.to) for one in graph.bridges] == [
        ("/k3/odom", "nav_msgs/msg/Odometry", HUB)
    ]
    [koala] = hosts[HUB].robots
    assert (koala.unit, koala.node) == ("swarm-newswarm.pebbled.service", "/pebbled_koala-laptop")
    assert [(one.name, one.type) for one in koala.topics] == [("/koala/odom", "nav_msgs/msg/Odometry")]
    assert (koala.command, koala.command_type) == (
        "/koala/cmd_vel",
        "geometry_msgs/msg/Twist",
    )
    assert hosts[HUB].master_uri == ""
    assert hosts[HUB].master_unit is None


@pytest.mark.usefixtures("registered")
def test_status_probes_with_their_module_and_no_master(tmp_path: Path) -> None:
    swarm = swarm_of(written(tmp_path))
    releases = {name: Release(one.digest, ()) for name, one in bundles(swarm).items()}
    graph = expected_graph(swarm, releases)
    assert request(graph, graph.hosts[0], 2.0)["module"] == "pebble_probe.observe"
    assert not [one for one in diagnose(graph, {}).findings if one.check == "master"]


@pytest.mark.usefixtures("registered")
def test_ports_and_memory_are_theirs(tmp_path: Path) -> None:
    document, found = load([written(tmp_path)])
    assert document is not None, found
    context = RuleContext(document)
    assert {(one.host, one.port, one.what) for one in context.listeners if one.port != 22} == {
        *((host, 7400, "pebble's router") for host in document.spec.hosts),
        *((host, 11361, "the mesh") for host in document.spec.hosts),
    }
    budgets = {one.host: dict(one.parts) for one in host_budgets(context, context.bridges)}
    assert budgets[HUB]["multimaster"] == MESH.memory_mb
    assert "multimaster" not in budgets[SILENT]


@pytest.mark.usefixtures("registered")
def test_rules_take_the_limits_of_the_provider(tmp_path: Path) -> None:
    [slow] = findings(written(tmp_path, more="heartbeat_hz: 0.4, "), "MM009")
    assert "0.5 Hz" in slow.help[0]
    [unused] = findings(written(tmp_path, more="port: 11600, "), "MM015")
    assert unused.message == "provider `mesh` does not use `port`"
    assert "`provider: fkie`" in unused.help[0]


@pytest.mark.usefixtures("registered")
def test_a_misspelt_name_gets_a_suggestion(tmp_path: Path) -> None:
    [provider] = findings(written(tmp_path, provider="mehs"), "SPEC003")
    assert provider.message == "`provider` cannot be `mehs`"
    assert provider.help == ("did you mean `mesh`?",)
    assert provider.fix is not None
    [distro] = findings(written(tmp_path, distro="peble"), "SPEC003")
    assert distro.help == ("did you mean `pebble`?",)


@pytest.mark.usefixtures("registered")
def test_the_schema_lists_their_names() -> None:
    definitions = schema_of("swarm")["definitions"]
    assert definitions["Multimaster"]["properties"]["provider"]["enum"] == ["fkie", "static", "mesh"]
    assert definitions["Ros"]["properties"]["distro"]["enum"] == ["noetic", "pebble"]


def test_an_unknown_name_is_an_error(tmp_path: Path) -> None:
    [provider] = findings(written(tmp_path, distro="noetic"), "SPEC003")
    assert provider.message == "`provider` cannot be `mesh`"
    assert provider.help == ("it is one of: `fkie`, `static`",)


def test_an_entry_point_registers_a_provider(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    points = {"swarmctl.multimaster": [EntryPoint("mesh", "tests.seams.toy:MESH", "swarmctl.multimaster")]}
    monkeypatch.setattr(plugins, "entry_points", lambda group: points.get(group, []))
    try:
        made = bundles(swarm_of(written(tmp_path, distro="noetic")))
    finally:
        MULTIMASTERS.unregister("mesh")
    assert {"mesh/topics.txt", "env/ros.env"} <= paths(made[HUB])


#: Where the names of built-in plugins, and what only ROS 1 has, may stand.
HOMES = ("plugins.py", "render/ros1/", "render/multimaster/fkie", "render/multimaster/static")
NAMES = {*MIDDLEWARES.names(), *MULTIMASTERS.names(), "melodic", "kinetic"}
ROS1 = re.compile(r"^ros-noetic-|^(roscore|rosmaster|roslaunch|rospy)$|\.launch$")
#: ROS 1 by their subject: the lab's own image, the spec's driver and examples, a word for suggestions.
EXEMPT = {
    *(("lab/hosts/image.py", one) for one in ("roscore", "roslaunch")),
    ("suggest.py", "roscore"),
    ("spec/model.py", "joystick.launch"),
    ("render/quoting.py", ".launch"),
}


def strings(file: Path) -> Iterator[str]:
    """The string literals of a module, parts of f-strings included."""
    for node in ast.walk(ast.parse(file.read_text("utf-8"))):
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def test_no_module_outside_knows_their_names() -> None:
    found = []
    for file in sorted((ROOT / "swarmctl").rglob("*.py")):
        name = file.relative_to(ROOT / "swarmctl").as_posix()
        if not name.startswith(HOMES):
            wrong = {text for text in strings(file) if text in NAMES or ROS1.search(text)}
            found += [(name, text) for text in sorted(wrong) if (name, text) not in EXEMPT]
    assert found == []


def test_no_module_outside_imports_ros_1_or_a_provider() -> None:
    pattern = re.compile(
        r"swarmctl\.render\.(ros1|multimaster\.(?!base))|render\.multimaster import (?!base)"
    )
    outside = [
        file.relative_to(ROOT / "swarmctl").as_posix()
        for file in (ROOT / "swarmctl").rglob("*.py")
        if pattern.search(file.read_text("utf-8"))
    ]
    assert [name for name in outside if not name.startswith(HOMES)] == []
