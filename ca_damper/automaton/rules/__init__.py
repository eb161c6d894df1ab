"""Rule sets of the automaton, a file each."""
