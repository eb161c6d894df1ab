"""What steps the scenes: container, coupling, account, and the engine that holds them."""
