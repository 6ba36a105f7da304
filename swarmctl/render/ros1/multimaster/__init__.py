"""Multimaster providers, which join the masters of several islands: one module each."""
