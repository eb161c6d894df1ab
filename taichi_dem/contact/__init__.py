"""Search for contact pairs, and the pairs themselves."""
