"""View of a block in a browser: one HTML page with the frames of a run."""
