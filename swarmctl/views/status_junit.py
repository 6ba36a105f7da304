"""The health of a swarm as JUnit XML: a suite for each host, in it one test case for each finding.

What makes the swarm unhealthy fails. A symptom names its cause; a warning is what a passing test prints.
"""

from __future__ import annotations

from xml.etree.ElementTree import Element, SubElement

from swarmctl.health.root_cause import Finding
from swarmctl.health.swarm_health import Status
from swarmctl.health.verdict import State
from swarmctl.views.escape import printable
from swarmctl.views.findings.junit import written


def render(seen: Status) -> str:
    """Returns the findings as JUnit XML."""
    root = Element("testsuites", {"name": f"swarmctl status {seen.swarm}"})
    troubles = {one.key for one in seen.diagnosis.troubles}
    for host in dict.fromkeys(one.host for one in seen.diagnosis.findings):
        suite = SubElement(root, "testsuite", {"name": host or seen.swarm})
        for one in seen.diagnosis.findings:
            if one.host == host:
                names = {"classname": f"{host or seen.swarm}.{one.check}", "name": printable(one.subject)}
                _result(SubElement(suite, "testcase", names), one, fails=one.key in troubles)
    return written(root)


def _result(case: Element, one: Finding, *, fails: bool) -> None:
    because = f"caused by: {one.cause}" if one.cause else ""
    text = "\n".join(printable(line) for line in (one.message, because, one.hint) if line)
    if fails:
        SubElement(case, "failure", {"type": one.state.value, "message": printable(one.message)}).text = text
    elif one.state in (State.SKIPPED, State.UNKNOWN):
        SubElement(case, "skipped", {"message": printable(one.message)})
    elif one.state is State.WARNING:
        SubElement(case, "system-out").text = text
