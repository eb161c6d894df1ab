"""Rule set "paper": particles fly in six directions, and collide where their cells touch."""
