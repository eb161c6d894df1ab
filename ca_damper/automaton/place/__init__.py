"""Rule set "place": grains collide where their positions meet, not where their cells touch."""
