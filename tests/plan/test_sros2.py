"""A host whose enclaves of SROS 2 are not signed, or lack a key, is unfit, and nothing on it changes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest
from swarm_onboard.agent.steps import Kind
from swarm_onboard.agent.verbs.observe import Facts

from swarmctl.cli import exit_codes, next_command
from swarmctl.cli.app import run
from swarmctl.cli.spec_args import SpecFiles
from swarmctl.plan import preflight
from swarmctl.plan.observed_host import NOTHING, Observed
from swarmctl.plan.plan import HostPlan
from swarmctl.plan.reconcile import reconcile
from swarmctl.render.bundle import Bundle
from swarmctl.spec import keystore
from tests.onboard.agent.fakehost import RUNS
from tests.sros2 import bundles_in, write_fake_keystore, write_spec

UNSIGNED = {
    "koala-laptop": "hosts/koala-laptop, robots/koala, programs/gamepad, programs/joystick",
    "k3-pi": "hosts/k3-pi, robots/k3",
    "epuck-pi": "hosts/epuck-pi, robots/epuck",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The leader's swarm, whose keystore is complete."""
    write_spec(tmp_path)
    write_fake_keystore(tmp_path)
    return tmp_path


def on_fit_host(bundle: Bundle, secrets: Mapping[str, str]) -> HostPlan:
    """The plan of a host that has all programs, and these ``secrets`` by state."""
    has = {**dict.fromkeys(bundle.asks, "/x"), "avrdude": "/x", "chronyd": "/x", "iw": "/x"}
    facts = Facts("pi", "x86_64", "3.11.2", True, 0, "b", 0.0, 1, 1, has, [], "", None, None)
    return reconcile(bundle, Observed(None, None, facts=facts, secrets=secrets))


def test_enclaves_that_nobody_signed_make_hosts_unfit(tmp_path: Path) -> None:
    spec = write_spec(tmp_path)
    for name, bundle in bundles_in(tmp_path).items():
        problem = reconcile(bundle, NOTHING).problem
        assert problem is not None
        assert problem.kind == preflight.UNFIT
        assert problem.message == (f"the permissions of {UNSIGNED[name]} are not signed as the spec has them")
        complete = next_command.completing(SpecFiles((spec,)), ["--lab-name", "b", "--limit", name])
        assert complete(problem.hint) == f"`swarmctl keys {spec}` signs them"


#: What the keystore lacks, by what is removed from it.
GONE = {
    f"{keystore.folder('newswarm', 'robots/k3')}/{keystore.CERTIFICATE}": ["robots/k3"],
    f"{keystore.folder('newswarm', 'hosts/k3-pi')}/{keystore.PERMISSIONS}": ["hosts/k3-pi"],
    keystore.GOVERNANCE: ["hosts/k3-pi", "robots/k3"],
    keystore.CA: ["hosts/k3-pi", "robots/k3"],
}


@pytest.mark.parametrize("path", GONE)
def test_each_file_of_an_enclave_is_looked_for(path: str, folder: Path) -> None:
    assert [bundle.unsigned for bundle in bundles_in(folder).values()] == [[], [], []]
    (folder / path).unlink()
    assert bundles_in(folder)["k3-pi"].unsigned == GONE[path]


def test_permissions_are_signed_as_the_spec_has_them_or_not_at_all(folder: Path) -> None:
    write_spec(folder, ros="distro: jazzy, sros2: true, domain: 42")
    assert {name: ", ".join(one.unsigned) for name, one in bundles_in(folder).items()} == UNSIGNED


def test_a_driver_without_its_key_makes_its_host_unfit(folder: Path) -> None:
    bundle = bundles_in(folder)["epuck-pi"]
    secrets = {"epuck-pin": "missing", "sros2-hosts-epuck-pi": "kept", "sros2-robots-epuck": "missing"}
    assert {*secrets} == {*bundle.secrets}
    plan = on_fit_host(bundle, secrets)
    assert plan.problem == preflight.Problem(
        preflight.UNFIT,
        "swarm-newswarm.epuck.service needs the secret sros2-robots-epuck, which is not on the host",
        "write it to `secrets/sros2-robots-epuck` beside the spec (docs/secrets.md)",
    )
    assert [note.split(" is ")[0] for note in plan.notes if "secret" in note] == ["the secret epuck-pin"]
    assert on_fit_host(bundle, dict.fromkeys(bundle.secrets, "new")).problem is None


@pytest.mark.parametrize(("key", "restarted"), [("sros2-robots-k3", "k3"), ("sros2-hosts-k3-pi", "enclaves")])
def test_another_key_restarts_what_has_it(key: str, restarted: str, folder: Path) -> None:
    bundle = bundles_in(folder)["k3-pi"]
    units = dict.fromkeys((unit.name for unit in bundle.units), RUNS)
    observed = Observed(bundle.digest, bundle.manifest, units=units, secrets={key: "other"})
    steps = [(step.kind, step.target) for step in reconcile(bundle, observed).steps]
    assert steps == [(Kind.SECRET, key), (Kind.RESTART, f"swarm-newswarm.{restarted}.service")]


def test_render_names_the_enclaves_that_are_not_signed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_spec(tmp_path)
    assert run(["render", "swarm.yaml", "--out", "out"]) == exit_codes.OK
    assert capsys.readouterr().err == "".join(
        f"note: {host}: {names} not signed; `swarmctl keys` signs them\n" for host, names in UNSIGNED.items()
    )
    write_fake_keystore(tmp_path)
    assert run(["render", "swarm.yaml", "--out", "out"]) == exit_codes.OK
    assert capsys.readouterr().err == ""
