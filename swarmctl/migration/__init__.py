"""Versions of the spec format, and the migration of a spec's text from an older version to a newer one."""
