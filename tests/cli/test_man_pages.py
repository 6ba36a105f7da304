"""Every verb has a manual page, made from the parser of the command line, and troff can read it."""

from __future__ import annotations

import shutil
import subprocess
from functools import cache

import pytest

from swarmctl.cli.app import Verbs
from tools.man_pages import pages


@cache
def written() -> dict[str, str]:
    return dict(pages())


def test_every_verb_has_a_page() -> None:
    assert {f"swarmctl-{verb.name}" for verb in Verbs.verbs} < written().keys()
    assert {"swarmctl", "swarmctl-lab-fault-unplug", "swarmctl-mode-convert"} < written().keys()


def test_a_page_names_options_and_exit_codes() -> None:
    page = written()["swarmctl-plan"].replace("\\-", "-")
    assert ".B swarmctl plan\n[OPTIONS] [SPEC]\n" in page
    assert "\n\\fB--detailed-exitcode\\fR\nExit with 2 if there are changes.\n" in page
    assert "\\fBSPEC\\fR\n" in page
    assert ".SH EXIT STATUS\n0 success; " in page


@pytest.mark.skipif(shutil.which("groff") is None, reason="needs groff")
def test_troff_reads_them_without_a_warning() -> None:
    text = "".join(written().values())
    command = ["groff", "-man", "-Tutf8", "-ww", "-z"]
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=True)
    assert done.stderr == ""
