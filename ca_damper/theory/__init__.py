"""Closed forms to compare with."""
