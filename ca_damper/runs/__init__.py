"""Runs of many scenes: responses, sweeps, maps, time histories, films."""
