"""Drafts a spec from what a lab has: launch files, an Ansible inventory, a Clearpath robot.yaml."""
