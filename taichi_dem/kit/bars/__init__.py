"""Error bars of ``solve`` and ``ca_damper.solve_response``: goals, answers, what chance does."""
