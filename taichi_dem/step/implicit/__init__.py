"""Dashpots of all bonds and contacts solved together in every step."""
