"""Each fault that a running robot has to bear, and the test in which it does."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tests.conftest import ROOT
from tests.loops import for_all

REAL, ROUNDS = "runtime/test_real_processes.py", "faults/test_rounds.py"
ROWS = {
    "a step raises": ("runtime/test_host.py", "a_component_that_raises_is_restarted_and_the_others_go_on"),
    "a process is killed": (REAL, "a_killed_process_is_started_again"),
    "a process is killed while it drives": (ROUNDS, "what_died_or_hung_comes_back_and_the_mission_succeeds"),
    "a process hangs": (REAL, "a_process_that_hangs_ends_itself_and_says_where"),
    "a process is stopped": (
        REAL,
        "a_suspended_process_is_shown_as_such_and_told_to_the_others_before_it_is_started_again",
    ),
    "a process is stopped before it is ready": (
        "runtime/test_conductor.py",
        "a_process_that_is_suspended_while_it_gets_ready_is_ended_and_one_that_takes_long_is_not",
    ),
    "simulated truth is lost": (ROUNDS, "without_what_cannot_come_back_the_robot_comes_to_rest_and_ends"),
    "a process dies again and again": (REAL, "a_process_that_dies_again_and_again_fails_the_robot"),
    "somebody on the path of commands fails for good": (
        "runtime/test_apply_for_real.py",
        "who_needs_what_has_failed_for_good_is_blocked_until_the_next_apply",
    ),
    "the supervisor is killed": (REAL, "without_its_supervisor_the_robot_comes_to_rest_and_ends"),
    "the supervisor is stopped": (REAL, "down_ends_a_robot_whose_supervisor_is_stopped"),
    "the pre-fork parent is killed": (REAL, "without_the_prefork_parent_the_robot_goes_down"),
    "the pre-fork parent is stopped": (ROUNDS, "without_what_cannot_come_back_the_robot_comes_to_rest_and_ends"),
    "the router is killed": (REAL, "a_killed_router_comes_again_where_it_was"),
    "the router that robots share is killed": (
        "faults/test_common_router.py",
        "without_the_router_the_base_stands_and_with_it_the_patrol_goes_on",
    ),
    "a process gets no processor": (
        "runtime/test_silence.py",
        "a_process_that_waits_for_a_processor_is_told_but_not_ended_until_it_had_one",
    ),
    "the session on the bus is stuck": (
        "runtime/test_lifeline.py",
        "a_stuck_session_is_opened_again_with_all_that_was_declared",
    ),
    "no session can be opened": (
        "runtime/test_lifeline_retries.py",
        "it_is_tried_again_and_told_until_there_is_a_session",
    ),
    "a goal comes before its server is active": (
        "bus/test_waiting.py",
        "a_goal_waits_and_is_judged_by_what_holds_then",
    ),
    "the disk of the log is full": (
        "runtime/test_log_file.py",
        "a_full_disk_costs_lines_and_is_told_when_there_is_room",
    ),
    "the state cannot be written": (
        "faults/test_folder.py",
        "a_state_that_cannot_be_written_is_told_and_the_robot_goes_on",
    ),
    "the machine sleeps": ("faults/test_stop.py", "a_machine_that_slept_brakes_and_goes_on"),
    "files of the running robot are removed": (
        "faults/test_folder.py",
        "a_robot_whose_files_were_removed_is_found_and_restores_them",
    ),
    "the wall clock jumps": ("testing/test_clocks.py", "cores_components_and_the_sdk_never_ask_for_time"),
    "a clock from outside stands still": (
        "runtime/test_external_clock.py",
        "a_real_robot_follows_stands_goes_on_jumps_and_bears_a_dispute",
    ),
    "a clock from outside is told by two": (
        "base/test_external_clock.py",
        "sources_that_disagree_are_told_once_and_time_stands_still",
    ),
    "several start it at once": ("faults/test_folder.py", "of_many_that_start_it_at_once_one_does"),
    "the terminal goes": (REAL, "the_end_of_the_terminal_is_the_end_of_the_robot"),
    "commands are flooded": ("faults/test_flood.py", "a_flood_is_refused_and_told_while_the_patrol_goes_on"),
}


def promises_of(file: str) -> Iterator[str]:
    tree = ast.parse((ROOT / "tests" / file).read_text(encoding="utf-8"))
    return (node.name.removeprefix("test_") for node in tree.body if isinstance(node, ast.FunctionDef))


@for_all("fault", ROWS)
def test_a_fault_has_its_test(fault: str) -> None:
    file, name = ROWS[fault]
    assert name in set(promises_of(file))
