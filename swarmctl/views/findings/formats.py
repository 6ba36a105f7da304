"""The formats for programs, by their ``--format`` name."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from swarmctl.views.findings import concise, github, gitlab, json, junit, sarif
from swarmctl.views.findings.report import Report

FORMATS: Mapping[str, Callable[[Report], str]] = {
    "concise": concise.render,
    "json": json.render,
    "github": github.render,
    "gitlab": gitlab.render,
    "sarif": sarif.render,
    "junit": junit.render,
}
