"""The benchmarks of deploying run against a small host: each step has a time, each job does its work."""

from __future__ import annotations

import json
import time
from pathlib import Path

import compare
import deploy as benchmark
import pytest
from deploy_cost import contestants, hosts, profile
from swarm_onboard.agent.steps import Kind

from swarmctl.plan.reconcile import reconcile
from swarmctl.remote.transport import Target
from swarmctl.render.build_bundle import bundles
from swarmctl.render.bundle import Bundle, File
from tests.loading import load_swarm
from tests.plan.test_reconcile import running
from tests.remote import sshd

pytestmark = pytest.mark.skipif(bool(sshd.missing()), reason=f"needs {sshd.missing()}")


def test_the_jobs_and_the_steps(tmp_path: Path) -> None:
    with hosts.running(tmp_path, 1) as (host,):
        tools = compare.commands(tmp_path, [host])
        known = json.loads((tmp_path / "hosts.json").read_text())
        compare.write(tmp_path / "files", {0: 1, 1: 1})
        contestants.bare(known, tmp_path, "files")
        assert sorted(path.name for path in Path(host.app).iterdir()) == ["0.yaml", "1.yaml"]
        for version in (1, 2):
            compare.write(tmp_path / "files", {0: version})
            contestants.swarmctl(known, tmp_path, "files")
        current = Path(host.prefix, "opt/swarm/new/current/app/0.yaml")
        assert current.read_bytes() == (tmp_path / "files/0.yaml").read_bytes()
        assert Path(host.prefix, "units/bench.service").exists()
        target = Target("h0", "127.0.0.1", "root", host.port, (host.key,), (Path(host.identity),))
        steps = profile.on_a_host(target, Bundle((File("a", b"a"),), swarm="new", host="h0"), 1)
        made = profile.of_a_deploy(
            lambda transport: benchmark.carry_out(
                {"h0": Bundle((File("a", b"%d" % time.time_ns()),), swarm="new", host="h0")},
                {"h0": target}, transport, changes=True,
            ), 1,
        )  # fmt: skip
        lowest = profile.floor(target, lambda: None, 1)
    assert {"login", "start the agent", "first `observe`"} <= steps.keys()
    assert {"`apply`", "`lease`, given back"} <= made.keys()
    assert not {"a connection, login (2)", "`hold`", "`confirm`"} & made.keys()  # these files run nothing
    assert lowest["fsync"][0] >= 0
    others = {"asyncssh", "fabric", "mitogen", "ansible-core", "pyinfra"}
    assert set(tools) == {compare.BARE, "swarmctl", *others}
    assert benchmark.spec_of(2).count("khepera3") == 2


def test_the_drivers_restart_or_take_it_live_as_the_rows_say(tmp_path: Path) -> None:
    spec = tmp_path / "bench.yaml"
    spec.write_text(benchmark.spec_of(1))
    swarm, _ = load_swarm(spec)
    assert swarm is not None
    wanted = bundles(swarm)
    live = benchmark.retuned(wanted, 1, live=True)
    restarted = benchmark.retuned(wanted, 2)
    driver = ["swarm-bench.r-h0.service"]
    assert [*reconcile(live["h0"], running(wanted["h0"])).targets(Kind.RELOAD_UNIT)] == driver
    assert [*reconcile(restarted["h0"], running(live["h0"])).targets(Kind.RESTART)] == driver
