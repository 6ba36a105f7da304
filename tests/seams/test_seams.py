"""A middleware and a provider from outside go from the spec to bundle, plan and expected graph."""

from __future__ import annotations

import ast
import io
import re
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest
from swarm_onboard.agent.steps import Kind
from swarm_onboard.agent.verbs.observe import Facts

from swarmctl.analysis.host_load import host_budgets
from swarmctl.diagnostics import Diagnostic
from swarmctl.health.collect import request
from swarmctl.health.diagnosis import diagnose
from swarmctl.health.expected_graph import ExpectedBridge, ExpectedMultimaster, Release, expected_graph
from swarmctl.linter.context import RuleContext
from swarmctl.plan.observed_host import Observed
from swarmctl.plan.reconcile import reconcile
from swarmctl.plugins import MIDDLEWARES, MULTIMASTERS, SECURITY_LEVELS
from swarmctl.remote.agent_archive import agent
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.render.middleware import Middleware
from swarmctl.render.multimaster import MultimasterProvider
from swarmctl.resources import HostModule
from swarmctl.schema.json_schema import without_ranges
from swarmctl.spec.load import load
from tests import ROOT
from tests.loading import load_swarm
from tests.seams.toy import MESH, Mesh, Pebble
from tests.seams.toy_spec import HUB, SILENT, swarm_of, written

MULTIMASTER = ExpectedMultimaster("swarm-newswarm.multimaster.service", (f"/mesh_{HUB}",), f"/mesh_{HUB}")


def findings(spec: Path, rule: str) -> list[Diagnostic]:
    return [one for one in load_swarm(spec)[1] if one.code == rule]


def paths(bundle: Bundle) -> set[str]:
    return {file.path for file in bundle.files}


def releases(made: Mapping[str, Bundle]) -> dict[str, Release]:
    return {name: Release(one.digest, tuple(unit.name for unit in one.units)) for name, one in made.items()}


@pytest.mark.parametrize(("protocol", "toy"), [(Middleware, Pebble), (MultimasterProvider, Mesh)])
def test_the_toys_have_what_the_protocols_ask_and_nothing_else(protocol: type, toy: type) -> None:
    def members(of: type) -> set[str]:
        return {name for name in vars(of) if not name.startswith("_")}

    assert members(toy) == members(protocol)


@pytest.mark.usefixtures("registered")
def test_a_spec_that_names_them_has_no_finding(tmp_path: Path) -> None:
    assert load_swarm(written(tmp_path))[1] == ()


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
    assert made[HUB].requires == {"pebbled": ("robots",)}
    assert not [path for path in paths(made[HUB]) if re.search(r"\bros|launch|\.master\.", path)]


@pytest.mark.usefixtures("registered")
def test_a_swarm_without_a_provider_has_no_file_of_ros_1(tmp_path: Path) -> None:
    """Its middleware joins no islands, and the spec names nothing that does: a single island is left."""
    spec = written(tmp_path, provider="")
    assert [one.code for one in findings(spec, "MODE017")] == ["MODE017"]
    text = spec.read_text("utf-8")
    spec.write_text(text.replace("mode: standalone", f"mode: central\nhub: {HUB}"), "utf-8")
    swarm = swarm_of(spec)
    made = bundles(swarm)
    text = "".join(f"{file.path}\n{file.content.decode()}" for one in made.values() for file in one.files)
    assert re.findall(r"/ros|ROS_|fkie|launch|11311|\bmaster", text) == []
    assert {tuple(one.requires) for one in made.values()} == {("pebbled",)}
    graph = expected_graph(swarm, releases(made))
    assert [host.multimaster for host in graph.hosts if host.multimaster] == []


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
    space = (1 << 30, 1 << 20)
    facts = Facts(HUB, "armv7l", "3.8.10", True, 0, "x", 0.0, *space, {}, [], "", None, None)
    problem = reconcile(bundle, Observed(facts=facts)).problem
    assert problem is not None
    assert problem.hint == "`swarmctl prepare` installs it; by hand: `pebble install pebbled`"


@pytest.mark.usefixtures("registered")
def test_the_expected_graph_has_their_nodes(tmp_path: Path) -> None:
    swarm = swarm_of(written(tmp_path))
    graph = expected_graph(swarm, releases(bundles(swarm)))
    hosts = {host.name: host for host in graph.hosts}
    assert hosts[HUB].multimaster == MULTIMASTER
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
    graph = expected_graph(swarm, releases(bundles(swarm)))
    assert request(graph, graph.hosts[0], 2.0).module == "pebble_probe.observe"
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
def test_rules_know_what_the_provider_reads(tmp_path: Path) -> None:
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
    definitions = without_ranges("swarm")["definitions"]
    assert definitions["Multimaster"]["properties"]["provider"]["enum"] == ["fkie", "static", "relay", "mesh"]
    assert definitions["Ros"]["properties"]["distro"]["enum"] == [*MIDDLEWARES.built_in, "pebble"]


def test_an_unknown_name_is_an_error(tmp_path: Path) -> None:
    [provider] = findings(written(tmp_path, distro="noetic"), "SPEC003")
    assert provider.message == "`provider` cannot be `mesh`"
    assert provider.help == ("it is one of: `fkie`, `relay`, `static`",)


def test_the_provider_alone_joins_masters_of_ros_1(tmp_path: Path, registered: None) -> None:
    """The third provider under the middleware that is built in: from the spec to bundle, plan and bridges."""
    swarm = swarm_of(written(tmp_path, distro="noetic"))
    made = bundles(swarm)
    assert {"mesh/topics.txt", "env/ros.env"} <= paths(made[HUB])
    assert "swarm-newswarm.multimaster.service" in reconcile(made[HUB], Observed()).targets(Kind.START)
    graph = expected_graph(swarm, releases(made))
    assert graph.bridges == (
        ExpectedBridge("/k3/odom", "nav_msgs/Odometry", SILENT, SILENT, HUB, HUB, robots=("k3",)),
    )
    [hub] = [host for host in graph.hosts if host.multimaster is not None]
    assert (hub.name, hub.multimaster) == (HUB, MULTIMASTER)
    assert f"/mesh_{HUB}" in request(graph, hub, 2.0).nodes


def test_an_installed_package_brings_its_probe(tmp_path: Path, installed: Path) -> None:
    swarm = swarm_of(written(tmp_path))
    probe = expected_graph(swarm, releases(bundles(swarm))).hosts[0].probe
    assert probe.folder == installed
    with zipfile.ZipFile(io.BytesIO(agent(("probe",), probe).archive)) as archive:
        names = set(archive.namelist())
        assert {"pebble_probe/observe.py", "pebble_probe/daemon.py", "swarm_onboard/agent/texts.py"} <= names
    assert not [
        name for name in names if name.startswith(("swarm_onboard/ros1_probe", "swarm_onboard/common/xmlrpc"))
    ]


def test_a_probe_that_is_not_there_is_an_error_before_any_host() -> None:
    with pytest.raises(ModuleNotFoundError, match=r"pebble_probe\.other"):
        agent(("probe",), HostModule("pebble_probe.other", ROOT / "tests/seams"))


#: Where the names of built-in plugins, and what only ROS 1 has, may stand.
HOMES = (
    "plugins.py",
    "render/ros1/",
    "render/ros2/",
    "importing/",  # what labs of ROS 1 have
)
_LEVELS = set(SECURITY_LEVELS.names()) - {SECURITY_LEVELS.default}  # other keys can be `off`, too
NAMES = {*MIDDLEWARES.names(), *MULTIMASTERS.names(), *_LEVELS, "melodic", "kinetic"}
ROS1 = re.compile(r"^ros-noetic-|^(roscore|rosmaster|roslaunch|rospy)$|\.launch$")
#: Rules about ROS 1 may name these; each is marked by what it `needs` or asks the middleware.
OF_ROS1_HOSTS = re.compile(r"/opt/ros|ROS_MASTER_URI|ROS_IP|TCPROS|\brosnode |\brostopic |\b11311\b")
#: ROS 1 by their subject: the lab's own image, the spec's driver and examples, a word for suggestions, hints
#: that only a swarm with masters gets.
EXEMPT = {
    *(("lab/hosts/image.py", one) for one in ("roscore", "roslaunch")),
    ("lab/hosts/workspace.py", "/opt/ros/"),
    ("suggest.py", "roscore"),
    ("spec/model_lookup.py", "relay"),  # a key that somebody may try
    ("robot_types/ros_launchable.py", "joystick.launch"),
    ("spec/model.py", "jazzy"),  # an example of a distribution
    *(("spec/model.py", one) for one in ("filtered", "sealed")),  # those of `security`
    ("spec/model.py", "Where the others reach it; also its ROS_IP (see `ros.naming`)."),
    ("render/quoting.py", ".launch"),
    ("rules/well_known_nodes.py", "relay"),  # of topic_tools
    # Debian packages of any ROS, by the Ubuntu that each is for
    *(("rules/packages.py", one) for one in ("kinetic", "melodic", "noetic", "humble", "jazzy", "kilted")),
    ("rules/program_files.py", "roslaunch"),  # a command of the other ROS
    ("rules/program_files.py", ".launch"),  # a rule with `needs="launch-xml"`
    ("scaffold/starting_files.py", ".launch"),  # a robot type with `driver: {launch: FILE}`
    ("spec/package_search.py", ".launch"),  # the packages of ROS 1 that lie beside a spec
    (
        "health/checks/driver.py",
        "ROS_IP or ROS_HOSTNAME is overridden; run swarmctl deploy, then restart the unit",
    ),
    ("health/checks/gate.py", " ended: `rosnode cleanup` removes the entry"),
    (
        "health/checks/bridge.py",
        "a program with another island's ROS_MASTER_URI or a second multimaster; `rosnode cleanup` on ",
    ),
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
            if not name.startswith("rules/"):
                wrong |= {text for text in strings(file) if OF_ROS1_HOSTS.search(text)}
            found += [(name, text) for text in sorted(wrong) if (name, text) not in EXEMPT]
    assert found == []


def test_no_module_outside_imports_ros_1_or_a_provider() -> None:
    pattern = re.compile(r"swarmctl\.render\.ros[12]")
    outside = [
        file.relative_to(ROOT / "swarmctl").as_posix()
        for file in (ROOT / "swarmctl").rglob("*.py")
        if pattern.search(file.read_text("utf-8"))
    ]
    assert [name for name in outside if not name.startswith(HOMES)] == []
