"""A level of security from outside goes from the spec to releases and findings, and is gone again."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from swarm_onboard.agent.steps import Kind

from swarmctl.plan.observed_host import Observed
from swarmctl.plan.reconcile import reconcile
from swarmctl.plugins import SECURITY_LEVELS
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle
from swarmctl.schema.json_schema import schema_of, without_ranges
from swarmctl.views.graph import analyses
from tests import ROOT
from tests.loading import load_swarm
from tests.render.rendered import text_of
from tests.seams.toy import WATCHED
from tests.seams.toy_spec import swarm_of

EXAMPLES = ("paper-leader", "paper-4-standalone", "ros2-4-standalone")
PEERS, UNIT = "watch/peers.txt", "swarm-newswarm.watchd.service"


def written(folder: Path, level: str, example: str = "paper-leader") -> Path:
    spec = folder / "swarm.yaml"
    text = (ROOT / "examples" / example / "swarm.yaml").read_text("utf-8")
    spec.write_text(f"{text}security: {level}\n", "utf-8")
    return spec


def files(bundle: Bundle) -> dict[str, bytes]:
    return {file.path: file.content for file in bundle.files}


@pytest.mark.usefixtures("registered")
@pytest.mark.parametrize("example", EXAMPLES)
def test_each_host_has_what_the_level_adds_to_that_below_it(example: str, tmp_path: Path) -> None:
    below = bundles(swarm_of(written(tmp_path, "filtered", example)))
    swarm = swarm_of(written(tmp_path, "watched", example))
    made = bundles(swarm)
    assert made.keys() == swarm.hosts.keys()
    for host, bundle in made.items():
        others = files(below[host])
        target = "units/swarm-newswarm.target"
        assert files(bundle).keys() - others.keys() == {PEERS, f"units/{UNIT}"}
        assert {path for path in others if files(bundle)[path] != others[path]} == {target}
        assert text_of(bundle, PEERS).split() == sorted(swarm.peers.get(host, ()))
        assert UNIT in reconcile(bundle, Observed()).targets(Kind.START)


@pytest.mark.usefixtures("registered")
def test_views_rules_and_schema_have_its_name(tmp_path: Path) -> None:
    swarm = swarm_of(written(tmp_path, "watched"))
    assert analyses.flow_heading(swarm).plain == "security: watched in newswarm"
    spec = written(tmp_path, "watched")
    spec.write_text(re.sub(r"192\.168\.77\.11\b", "k3.lab", spec.read_text("utf-8")), "utf-8")
    [found] = [one for one in load_swarm(spec)[1] if one.code == "SEC005"]
    assert "`security: watched` accepts packets by IP address" in found.message
    schema = without_ranges("swarm")
    assert schema["properties"]["security"]["enum"] == ["off", "filtered", "sealed", "watched"]
    of_island = schema["definitions"]["Island"]["properties"]["security"]
    assert of_island["enum"] == ["off", "filtered", "watched"]


@pytest.mark.usefixtures("registered")
def test_an_island_can_have_it_alone(tmp_path: Path) -> None:
    text = (ROOT / "examples/paper-5-combined/swarm.yaml").read_text("utf-8")
    spec = tmp_path / "swarm.yaml"
    spec.write_text(text.replace("{mode: central, ", "{mode: central, security: watched, "), "utf-8")
    swarm = swarm_of(spec)
    assert [host for host, made in bundles(swarm).items() if PEERS in files(made)] == ["epuck-pi"]
    heading = "security: watched in lone-epuck; off in koala-group, khepera-group"
    assert analyses.flow_heading(swarm).plain == heading


def test_without_it_all_is_as_before(tmp_path: Path) -> None:
    schema, before = schema_of("swarm"), bundles(swarm_of(written(tmp_path, "sealed")))
    SECURITY_LEVELS.register("watched", WATCHED)
    bundles(swarm_of(written(tmp_path, "watched")))
    SECURITY_LEVELS.unregister("watched")
    assert (schema_of("swarm"), bundles(swarm_of(written(tmp_path, "sealed")))) == (schema, before)
    [unknown] = load_swarm(written(tmp_path, "watched"))[1]
    assert unknown.message == "`security` cannot be `watched`"
