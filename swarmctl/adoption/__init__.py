"""Brings what people have edited on hosts into the files of a spec."""
