"""One step of the whole system: the order of the physics, the schedule, the drivers."""
