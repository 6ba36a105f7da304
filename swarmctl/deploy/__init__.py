"""Executes plans on hosts and reports events. All decisions are in the plan."""
