"""Rule set "place": grains meet where their places meet, not where their cells touch."""
