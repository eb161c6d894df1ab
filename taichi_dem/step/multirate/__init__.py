"""Steps that differ from body to body.

A body steps by dt0 / 2^k, with the least level k at which it moves by no more than l in a step:

    dt <= l / |v|        (Konno et al., 3.1; ``taichi_dem.step_control.Displacement``)

``clock``: ticks, seconds, the step of each level. ``schedule``: levels, who is due.
``active_lists``: by which keys bodies, bonds and pairs are listed. ``lists``: lists by falling key.
``levels``: how far levels of bodies that touch may differ, and up to when they have pushed each
other. ``half_step``: what is recorded at one time. One step for all is one level for all.
"""
