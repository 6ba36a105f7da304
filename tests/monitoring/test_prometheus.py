"""A real Prometheus reads the metrics, the alerts and every query of the dashboard."""

from __future__ import annotations

import json
import re
import subprocess
import time
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import prometheus_client
import pytest
import yaml

from swarmctl.resources import cache_folder, templates
from swarmctl.views.status_metrics import LastLook, registry, render
from tests.monitoring.looks import look_at, troubled
from tests.ports import free_port
from tests.timing import wait_for

BIN = cache_folder() / "monitoring-tools/usr/bin"
PROMETHEUS, PROMTOOL = BIN / "prometheus", BIN / "promtool"
ALERTS = templates() / "monitoring/alerts.yaml"
DASHBOARD = json.loads((templates() / "monitoring/dashboard.json").read_text("utf-8"))
QUERIES = [target["expr"] for panel in DASHBOARD["panels"] for target in panel["targets"]]
RULES = yaml.safe_load(ALERTS.read_text("utf-8"))["groups"][0]["rules"]
#: Alerts that the swarm of `troubled` does not raise: their queries return nothing.
QUIET = {"SwarmTopicTooSlow", "SwarmUnitRestarts", "SwarmLookTooOld"}

pytestmark = pytest.mark.skipif(
    not (PROMETHEUS.exists() and PROMTOOL.exists()), reason="needs prometheus: make monitoring-tools"
)


def promtool(*words: str, text: bytes | None = None) -> str:
    ran = subprocess.run([PROMTOOL, *words], input=text, capture_output=True, check=False)
    shown = (ran.stdout + ran.stderr).decode()
    assert ran.returncode == 0, shown
    return shown


class Server:
    """A Prometheus that scrapes an exporter each second."""

    def __init__(self, port: int) -> None:
        self._url = f"http://127.0.0.1:{port}/api/v1"

    def get(self, path: str, **parameters: str) -> Any:
        """The data of an answer; None before the server answers. An error in a query fails the test."""
        try:
            with urllib.request.urlopen(f"{self._url}/{path}?{urllib.parse.urlencode(parameters)}") as answer:
                return json.load(answer)["data"]
        except urllib.error.HTTPError as error:
            if error.code != 503:  # it starts
                pytest.fail(error.read().decode())
        except (urllib.error.URLError, ConnectionError):
            pass
        return None

    def query(self, expression: str) -> list[Any]:
        data = self.get("query", query=expression)
        return list(data["result"]) if data else []


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """Prometheus with the shipped alerts, and the metrics of `troubled` as its exporter serves them."""
    folder = tmp_path_factory.mktemp("prometheus")
    exporter, port = free_port(), free_port()
    last = LastLook()
    last.look = look_at(troubled(), began=time.time())
    scrape = {"job_name": "swarmctl", "static_configs": [{"targets": [f"127.0.0.1:{exporter}"]}]}
    config = {
        "global": {"scrape_interval": "1s", "evaluation_interval": "1s"},
        "rule_files": [str(ALERTS)],
        "scrape_configs": [scrape],
    }
    (folder / "prometheus.yml").write_text(yaml.safe_dump(config))
    serving, thread = prometheus_client.start_http_server(exporter, "127.0.0.1", registry(last))
    options = {
        "config.file": folder / "prometheus.yml",
        "storage.tsdb.path": folder / "data",
        "web.listen-address": f"127.0.0.1:{port}",
    }
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(
            [PROMETHEUS, *(f"--{name}={value}" for name, value in options.items())], stdout=log, stderr=log
        )
    try:
        found = Server(port)
        counted = "count_over_time(swarm_unit_restarts_total[1m]) > 1"  # increase() needs two samples
        wait_for(lambda: process.poll() is not None or found.query(counted), interval=0.1)
        assert process.poll() is None, (folder / "log").read_text()
        yield found
    finally:
        process.terminate()
        process.wait()
        serving.shutdown()
        serving.server_close()
        thread.join()


@pytest.mark.parametrize("expression", QUERIES)
def test_each_query_of_the_dashboard_has_samples(server: Server, expression: str) -> None:
    assert 'swarm=~"$swarm"' in expression
    assert server.query(expression.replace("$swarm", ".*"))


def test_the_variable_of_the_dashboard_has_values(server: Server) -> None:
    (query,) = [one["query"] for one in DASHBOARD["templating"]["list"] if one["type"] == "query"]
    metric, label = re.fullmatch(r"label_values\((\w+), (\w+)\)", query).groups()  # type: ignore[union-attr]
    assert [one["metric"][label] for one in server.query(metric)] == ["newswarm"]


@pytest.mark.parametrize("rule", RULES, ids=[one["alert"] for one in RULES])
def test_the_query_of_each_alert_finds_what_is_wrong(server: Server, rule: dict[str, Any]) -> None:
    assert bool(server.query(rule["expr"])) is (rule["alert"] not in QUIET)


def test_only_causes_raise_alerts(server: Server) -> None:
    def causes() -> set[str]:
        alerts = (server.get("alerts") or {"alerts": []})["alerts"]
        return {one["labels"]["cause"] for one in alerts}

    wait_for(lambda: causes() >= {"host epuck-pi", "device k3"}, interval=0.1)
    assert causes() == {"host epuck-pi", "device k3"}


def test_every_metric_is_in_the_dashboard_or_an_alert() -> None:
    text = render(look_at(troubled())).decode()
    used = " ".join([*QUERIES, *(one["expr"] for one in RULES)])
    served = {line.partition("{")[0] for line in text.splitlines() if not line.startswith("#")}
    assert {name for name in served if name not in used} == set()


def test_promtool_accepts_the_metrics() -> None:
    assert promtool("check", "metrics", text=render(look_at(troubled()))) == ""


def test_promtool_accepts_the_alerts() -> None:
    promtool("check", "rules", str(ALERTS))
    promtool("test", "rules", str(Path(__file__).with_name("alerts_test.yaml")))
