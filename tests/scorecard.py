"""``python -m tests.scorecard``: what a deploy promises under faults, with the tests that show it.

Each row is a fault. It is green if all its tests pass, red if one fails, skipped if one did not run, and
open, with what is missing, where no test shows it yet.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).parents[1]
LAB = "tests/e2e/"


@dataclass(frozen=True)
class Row:
    """One case. ``tests``: FILE::FUNCTION; ``note``: what they leave out, or why there are none."""

    case: str
    fault: str
    tests: tuple[str, ...] = ()
    note: str = ""


def _agent(file: str, *names: str) -> tuple[str, ...]:
    return tuple(f"tests/onboard/agent/test_{file}.py::test_{name}" for name in names)


def _at(file: str, *names: str) -> tuple[str, ...]:
    folder, _, module = file.rpartition("/")
    return tuple(f"tests/{folder}/test_{module}.py::test_{name}" for name in names)


_POWER = _at("power/power_cuts", "a_host_is_whole_wherever_its_power_goes")
_FULL = "`make power-cuts` makes all cuts on ext4, xfs and btrfs"
_LOCKOUTS = _at("e2e/lockouts", "hosts_that_lock_their_operator_out_go_back")
_KILLED = _at("deploy/killed_processes", "after_a_kill_in_any_state_the_next_run_completes")
_DEAD_MAN = _at("e2e/dead_man", "whatever_fails_robots_stand_in_time")

ROWS = (
    Row(
        "R01",
        "a host is down",
        _at("remote/ssh", "kinds_of_unreachable_hosts_are_distinguished")
        + _at("e2e/faults", "an_unreachable_host_fails_alone_and_soon"),
    ),
    Row(
        "R02",
        "a name is unknown",
        _at("remote/ssh", "kinds_of_unreachable_hosts_are_distinguished"),
        "a literal IPv6 address is refused by the rule NET003: ROS 1 nodes cannot advertise it",
    ),
    Row(
        "R03",
        "a connection ends before the login",
        _at("remote/ssh", "a_port_that_sends_nothing_times_out")
        + _at("remote/stalls", "a_connection_that_ends_before_the_login_is_named"),
    ),
    Row(
        "R04",
        "a connection ends in the upload",
        _at("remote/stalls", "a_network_that_goes_amid_an_upload_ends_it")
        + _at("deploy/interrupted_upload", "the_next_run_sends_only_what_was_not_complete"),
        "where the host cannot notice the end for 60 s, a run in between sends all",
    ),
    Row(
        "R05",
        "no network for 3 s",
        _at("remote/stalls", "an_upload_completes_though_the_network_is_away_for_3_s")
        + _at("e2e/outages", "each_step_of_a_deploy_meets_3_s_without_network"),
    ),
    Row(
        "R06",
        "a connection ends while the host changes",
        _agent("transaction", "once_begun_a_deploy_outlives_its_connection")
        + _at(
            "deploy/host_transaction",
            "of_a_killed_agent_the_same_run_says_what_became_of_it",
            "the_next_run_confirms_what_an_earlier_one_has_applied",
        )
        + _KILLED,
    ),
    Row(
        "R07",
        "2 % loss and 8 Mbit/s for 20 hosts, also with 200 ms of delay",
        _at("e2e/bad_radio", "a_first_deploy_of_20_hosts_is_confirmed_by_all"),
    ),
    Row(
        "R08",
        "sshd stands still",
        _at("remote/ssh", "a_frozen_server_is_given_up_on")
        + _at("remote/stalls", "wherever_a_host_stalls_it_is_given_up_on"),
    ),
    Row(
        "R09",
        "sshd takes few connections",
        _at("remote/ssh", "a_server_that_drops_newcomers_is_tried_again")
        + _at("remote/old_hosts", "one_session_a_connection_is_enough"),
    ),
    Row(
        "R10",
        "a jump host dies",
        _at(
            "remote/ssh",
            "a_dead_jump_host_is_tried_once_for_all_behind_it",
            "a_jump_host_that_was_restarted_is_logged_in_to_again",
        )
        + _at("deploy/killed_processes", "after_a_jump_host_dies_the_next_run_completes"),
    ),
    Row(
        "R11",
        "the disk is full",
        _agent("transaction", "a_full_disk_while_staging_changes_nothing")
        + _agent("staging", "a_full_disk_is_noticed_before_anything_is_written"),
    ),
    Row(
        "R12",
        "no inode is free",
        _agent(
            "full_disk",
            "without_inodes_nothing_is_written",
            "wherever_inodes_run_out_the_old_release_runs",
        ),
    ),
    Row("R13", "the disk is read-only", _agent("staging", "a_read_only_disk_is_named")),
    Row("R14", "the power goes, the log is lost", _POWER, _FULL),
    Row("R15", "the power goes, the log is written", _POWER, _FULL),
    Row("R16", "the power goes in an undo", _POWER, _FULL),
    Row(
        "R17",
        "the power goes while old releases are removed",
        _at("power/power_cuts", "a_cut_while_old_releases_are_removed_leaves_a_whole_host"),
        _FULL,
    ),
    Row(
        "R18",
        "a bit of a release flips",
        _agent("staging", "every_single_flipped_bit_is_noticed")
        + _agent("transaction", "a_damaged_release_is_repaired_under_its_own_name"),
    ),
    Row(
        "R19",
        "a file was edited on the host",
        _at("e2e/change", "a_file_edited_by_hand_is_named_and_repaired")
        + _at(
            "deploy/edited_files",
            "an_edit_holds_all_hosts_back",
            "a_replaced_edit_is_kept_on_the_host",
            "an_edit_that_the_spec_has_by_now_is_no_conflict",
            "layout_and_comments_of_an_edit_are_no_conflict",
        ),
    ),
    Row(
        "R20",
        "`current` is not a link to a release",
        _agent(
            "transaction",
            "a_link_that_leads_nowhere_of_ours_is_put_right",
            "a_folder_in_place_of_the_link_is_refused",
        ),
    ),
    Row(
        "R21",
        "xfs and btrfs",
        _at("power/power_cuts", "a_host_is_whole_on_other_file_systems"),
        f"{_FULL}; F2FS needs a kernel that has it, and VFAT has no links, which a release needs",
    ),
    Row(
        "R22",
        "kill -9 of the agent",
        _agent(
            "undo",
            "what_a_dead_agent_left_is_undone_without_a_person",
            "after_a_kill_at_any_step_the_next_deploy_completes",
        )
        + _agent("confirm", "a_confirmation_that_is_cut_off_is_old_or_new")
        + _agent("secrets", "wherever_a_change_ends_early_its_host_has_the_old_value")
        + _KILLED,
    ),
    Row(
        "R23",
        "kill -9 of the operator",
        _KILLED
        + _at("deploy/two_operators", "the_lease_of_a_killed_run_is_taken_over_at_once")
        + _at("deploy/host_transaction", "the_next_run_confirms_what_an_earlier_one_has_applied"),
    ),
    Row(
        "R24",
        "Ctrl-C once and twice",
        _at(
            "remote/parallel_hosts",
            "the_first_stop_lets_running_hosts_finish_and_starts_no_more",
            "the_second_stop_cuts_the_running_hosts_off",
        ),
    ),
    Row(
        "R25",
        "a reboot before the confirmation",
        _agent("confirm", "a_host_that_restarts_before_the_confirmation_goes_back"),
    ),
    Row(
        "R26",
        "a unit keeps ending",
        _agent("confirm", "a_change_whose_units_do_not_keep_running_is_undone")
        + _at("e2e/short_lives", "a_program_that_ends_takes_its_host_back"),
    ),
    Row(
        "R27",
        "a unit ends after 5 s",
        _agent("confirm", "a_change_whose_units_do_not_keep_running_is_undone")
        + _at("e2e/short_lives", "a_program_that_ends_takes_its_host_back"),
    ),
    Row(
        "R28",
        "the release before is bad, too",
        _agent("transaction", "a_bad_release_is_not_tried_again_after_another_bad_one"),
    ),
    Row(
        "R29",
        "a first deploy fails",
        _agent("undo", "a_failed_first_deploy_leaves_the_host_as_it_was")
        + _agent("confirm", "a_first_release_that_nobody_confirms_leaves_nothing"),
    ),
    Row(
        "R30",
        "two operators at once",
        _at("deploy/two_operators", "of_two_operators_at_once_one_deploys")
        + _at("deploy/two_operators", "a_plan_made_amid_a_change_of_another_changes_no_host")
        + _at("e2e/faults", "of_two_deploys_at_the_same_moment_one_has_all_hosts"),
        "`make races`: 50 times",
    ),
    Row(
        "R31",
        "an operator pauses for longer than a lease",
        _agent("lease", "a_run_whose_lease_another_one_took_changes_nothing"),
    ),
    Row(
        "R32",
        "the holder of a lease is killed",
        _at("deploy/two_operators", "the_lease_of_a_killed_run_is_taken_over_at_once"),
    ),
    Row(
        "R33",
        "a host changes after its plan",
        _at("cli/saved_plan", "a_stale_plan_is_refused_with_the_reason")
        + _at("e2e/change", "a_saved_plan_is_executed_as_it_was_or_refused"),
    ),
    Row(
        "R34",
        "a confirmation at its deadline",
        _agent("confirm", "confirmation_and_deadline_agree_whoever_comes_first"),
        "`make races`: 1 000 times",
    ),
    Row("R35", "a confirmation of another change", _agent("confirm", "another_change_is_not_confirmed")),
    Row(
        "R36",
        "a host is away when leases are taken",
        _at("deploy/rollout", "a_host_that_is_away_holds_the_others_back"),
    ),
    Row(
        "R37",
        "a change locks its operator out",
        _at(
            "deploy/host_transaction",
            "a_change_that_locks_its_operator_out_goes_back",
            "the_login_that_confirms_begins_once_units_have_kept_running",
        )
        + _LOCKOUTS,
        "by a firewall, and by a wlan that goes",
    ),
    Row("R38", "sshd is changed wrongly", _LOCKOUTS, "its port; its users and a stopped one in R40"),
    Row("R39", "a key of WireGuard is wrong", (), "swarmctl renders no WireGuard"),
    Row(
        "R40",
        "the power goes while the operator is locked out",
        _at("e2e/lockouts", "a_power_cut_while_the_operator_is_locked_out_changes_nothing") + _POWER,
        _FULL,
    ),
    Row(
        "R41",
        "a daemon refuses its file",
        _at("e2e/host_preparation", "a_file_that_its_daemon_refuses_takes_the_change_back"),
        "chrony.conf; swarmctl renders no firewall",
    ),
    Row(
        "R42",
        "a site has its own firewall",
        _at(
            "e2e/host_preparation",
            "a_sites_own_firewall_is_untouched_by_all_that_swarmctl_does",
            "removed_nothing_is_left",
        ),
    ),
    Row("R43", "the canary fails", _at("deploy/deployment", "after_a_failed_canary_no_other_host_changes")),
    Row(
        "R44",
        "more hosts fail than may",
        _at(
            "deploy/deployment",
            "as_many_hosts_may_fail_as_the_operator_says",
            "three_of_twenty_failures_stop_a_rollout_that_may_have_two",
        ),
    ),
    Row(
        "R45",
        "an unreachable host counts as failed",
        _at("deploy/rollout", "a_host_that_is_away_holds_the_others_back"),
    ),
    Row(
        "R46",
        "one of the hosts that belong together fails",
        _at("deploy/deployment", "hosts_that_belong_together_go_back_together"),
    ),
    Row(
        "R47",
        "the operator is killed between two confirmations",
        _at("deploy/deployment", "a_run_that_dies_between_confirmations_is_finished")
        + _at("health/status_command", "hosts_that_have_not_the_release_of_the_spec_are_named"),
    ),
    Row(
        "R48",
        "a robot is taken out of the spec",
        _at("e2e/change", "a_robot_taken_out_of_the_spec_is_gone_from_its_host")
        + _at("cli/left_hosts", "a_host_that_left_the_spec_is_removed_where_it_was_reached")
        + _at("deploy/host_lists", "another_operator_is_shown_the_host_that_left"),
    ),
    Row(
        "R49",
        "the clock of a host is wrong",
        _agent(
            "wrong_clock",
            "a_change_is_confirmed_whatever_the_date",
            "a_lease_lasts_as_long_whatever_the_date",
            "the_last_three_releases_are_kept_whatever_the_date",
        )
        + _at("plan/reconcile", "a_clock_that_is_far_off_is_a_note")
        + _at("plan/run_order", "a_clock_that_lost_its_battery_does_not_mislead_a_rollback"),
        "with a date that the agent's process gets",
    ),
    Row(
        "R51",
        "a deploy to a robot in use",
        _agent("motion_gate", "a_robot_in_use_is_not_touched", "it_is_stopped_first_and_stays_stopped")
        + _at("e2e/change", "its_deploy_stops_that_robot_while_the_others_drive_on"),
    ),
    Row("R52", "a commander dies", _DEAD_MAN),
    Row("R53", "kill -9 of a driver", _DEAD_MAN),
    Row("R54", "a driver stands still", _DEAD_MAN),
    Row(
        "R55",
        "a command that is not a number",
        _at("onboard/driver/session", "a_senseless_command_stops_the_robot_at_once"),
    ),
    Row(
        "R56",
        "a serial line fails",
        _at("onboard/driver/session", "every_fault_in_every_state_ends_standing_still_and_recovers")
        + _at("e2e/driver_unit", "a_pulled_cable_restarts_nothing_and_stops_the_robot"),
    ),
    Row(
        "R57",
        "a deploy to the leader",
        _at("plan/dependent_robots", "a_unit_concerns_the_robots_that_it_serves")
        + _at(
            "deploy/motion_guard",
            "a_commander_is_not_restarted_under_a_robot_of_another_host",
            "they_are_stopped_on_their_hosts_before_any_host_changes",
            "a_robot_that_is_used_after_the_survey_keeps_the_change_away",
            "hosts_outside_the_selection_count_too",
            "what_a_silent_host_does_is_not_known",
            "a_rollback_is_refused_as_a_deploy_is",
            "a_removal_leaves_the_units_of_robots_in_use",
        )
        + _at("e2e/change", "a_master_does_not_stop_under_a_robot_of_another_host"),
    ),
    Row(
        "R58",
        "another host's key",
        _at(
            "remote/ssh",
            "a_changed_key_is_refused_before_authentication",
            "the_key_of_another_host_is_not_good_for_this_one",
        )
        + _at("remote/old_hosts", "two_hosts_that_exchanged_addresses_are_both_refused"),
    ),
    Row(
        "R59",
        "a host floods",
        _at("remote/ssh", "a_flooding_command_is_cut_off")
        + _at("remote/stalls", "an_endless_banner_is_cut_off")
        + _at("remote/agent_session", "a_flood_ends_the_session_and_is_not_an_answer"),
    ),
    Row(
        "R60",
        "hostile names and sizes in answers",
        _at("remote/hostile_answers", "a_damaged_answer_is_a_value_or_the_hosts_error"),
    ),
    Row(
        "R61",
        "terminal sequences from hosts",
        _at("remote/agent_client", "text_from_a_host_cannot_steer_a_terminal")
        + _at("remote/trust", "no_escape_sequence_of_a_stranger_reaches_the_terminal"),
    ),
    Row(
        "R62",
        "a host that lies",
        _at("remote/hostile_answers", "a_host_that_confirms_another_release_is_no_success"),
    ),
)


def main() -> int:
    """Runs the tests, prints the table. Returns 1 if a row is red."""
    parser = argparse.ArgumentParser(prog="python -m tests.scorecard", description=__doc__)
    parser.add_argument("--without-lab", action="store_true", help="leave out the tests that need the lab")
    chosen = parser.parse_args()
    wanted = sorted({one for row in ROWS for one in row.tests if not (chosen.without_lab and LAB in one)})
    seen = _run(wanted)
    states = [_state(row, seen) for row in ROWS]
    for row, (state, seconds) in zip(ROWS, states, strict=True):
        time = f"{seconds:6.1f} s" if seconds else " " * 8
        print(f"{row.case}  {state:8} {time}  {row.fault}{f' ({row.note})' if row.note else ''}")
    counts = {
        name: [state for state, _ in states].count(name) for name in ("green", "red", "open", "skipped")
    }
    print(", ".join(f"{count} {name}" for name, count in counts.items() if count))
    return int("red" in {state for state, _ in states})


def _run(tests: Sequence[str]) -> Mapping[str, tuple[str, float]]:
    """The worst outcome and the seconds of each test function."""
    found: dict[str, tuple[str, float]] = {}
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [
            sys.executable,
            "-m",
            "pytest",
            "-q",
            "-n",
            "2",
            "--dist",
            "loadfile",
            f"--junitxml={report}",
        ]
        subprocess.run([*command, *tests], cwd=ROOT, stdout=sys.stderr, check=False)
        for case in ElementTree.parse(report).iter("testcase"):
            file = case.get("classname", "").replace(".", "/") + ".py"
            name = f"{file}::{case.get('name', '').partition('[')[0]}"
            outcome = next((one.tag for one in case if one.tag in ("failure", "error", "skipped")), "passed")
            before, seconds = found.get(name, ("passed", 0.0))
            worst = max(before, outcome, key=["passed", "skipped", "error", "failure"].index)
            found[name] = worst, seconds + float(case.get("time", 0))
    return found


def _state(row: Row, seen: Mapping[str, tuple[str, float]]) -> tuple[str, float]:
    results = [seen[one] for one in row.tests if one in seen]
    seconds = sum(one for _, one in results)
    outcomes = {outcome for outcome, _ in results}
    if not row.tests:
        return "open", 0.0
    if outcomes & {"failure", "error"}:
        return "red", seconds
    whole = outcomes == {"passed"} and len(results) == len(row.tests)
    return ("green" if whole else "skipped"), seconds


if __name__ == "__main__":
    sys.exit(main())
