"""Carries a plan out, host by host, and reports what happened as events. Decides nothing the plan did not."""
