"""The checks of ``swarmctl status``, a module each, found by its name: nothing else names them.

A module has ``TABLE``: by the name of a check, as ``status --json`` has it, what it can find, and what that
means, for docs/checks.md. Its ``compare(found, context)`` files one finding for each thing that it compares.
What may explain a finding is named by key, whether it was filed or not, so checks may run in any order.

What a host itself has, such as its disks, is checked by the modules of ``swarm_onboard.host_checks``.
"""
