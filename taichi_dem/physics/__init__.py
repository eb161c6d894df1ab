"""Physics as pure functions of numbers: no fields, no loops over the system, no clock."""
