"""View of containers in a browser: one HTML page that plays the frames of a film."""

from ca_damper.viewer.containers import MOST_SCENES, show_containers, show_film

__all__ = ["MOST_SCENES", "show_containers", "show_film"]
