"""Runs that are made up: values by level and twin from a formula, without any simulation."""

import math
from types import SimpleNamespace

import numpy as np


class MadeUpRuns:
    """Stands for ``taichi_dem.accuracy.runs.Runs``.

    formula(level, twin): a value, None for a run that diverges. change: of a usual body between two
    levels. events: whether anything broke. certificate: of each run. residual: energy [J] that it
    leaves unexplained, of 1 J. A run at level k takes 2^k seconds.
    """

    formula, change_between, events = None, staticmethod(lambda a, b: 0.0), False
    certificate, residual = None, 0.0

    def __init__(self, job, listen):
        self.seconds, self.count, self.failure = 0.0, 0, "it diverged"
        self.results, self.cost, self.known = {}, {}, {}

    def value(self, level, twin=0, tight=False):
        key = level, twin, tight
        if key not in self.known:
            self.count, self.seconds = self.count + 1, self.seconds + 2.0**level
            self.known[key] = type(self).formula(level, twin)
            self.cost[level] = 2.0**level
            report = SimpleNamespace(
                broken_faces=int(self.events),
                pair_evaluations=0,
                bond_slip=None,
                certificate=self.certificate,
                energy_balance={"kinetic": 1.0, "residual": self.residual},
                round_off_J=0.0,
                needs=(),
            )
            self.results[level] = SimpleNamespace(report=report)
        return self.known[key]

    def change(self, coarse, fine):
        return self.change_between(coarse, fine)

    leap = peak_change = change

    def same_breaks(self, coarse, fine):
        return not self.events

    def parting(self, level):
        return 0.5


def searched(monkeypatch, job, formula, **more):
    """Answer of a search over made-up runs; more: members of ``MadeUpRuns``, budget, first."""
    from taichi_dem.accuracy import search

    given = {name: more.pop(name) for name in ("budget", "first") if name in more}
    members = {name: staticmethod(one) if callable(one) else one for name, one in more.items()}
    members["formula"] = staticmethod(formula)
    monkeypatch.setattr(search, "Runs", type("Runs", (MadeUpRuns,), members))
    found = search.Search(job, given.get("budget", math.inf), None, given.get("first", 0))
    return found.answer()


def scattered(spread, centre=3.0):
    """Formula of values that scatter about a centre, whatever the level."""

    def formula(level, twin):
        return centre + spread * float(np.random.default_rng([level, twin]).standard_normal())

    return formula
