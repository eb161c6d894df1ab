"""Pictures of a result, one function each."""
