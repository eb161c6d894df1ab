"""The short report at the end of a run of the damper."""

import json
from dataclasses import asdict, dataclass

from taichi_dem.files import write_text

#: Evaluations of the right-hand side in an attempt of RK45; the first slope is the last one's.
RK45_STAGES = 6


@dataclass(frozen=True)
class Report:
    """What a batch did since it was made, and what it cost.

    method: label of the filling. mount: "spring" or "base". effects: what the filling was asked to
    compute. scenes: number; particles, dt_s: fewest and most. simulated_s: longest time of a scene
    since its start. scene_steps, particle_steps: steps of all scenes, and times their particles.
    container_evaluations: of the container's right-hand side since the start; 0 on the base.
    compile_seconds, run_seconds: cost.
    """

    method: str
    mount: str
    effects: tuple
    scenes: int
    particles: tuple
    dt_s: tuple
    simulated_s: float
    scene_steps: int
    particle_steps: int
    container_evaluations: int
    compile_seconds: float
    run_seconds: float

    @property
    def particle_steps_per_second(self):
        """Speed, without compiling; 0 before anything has run."""
        return self.particle_steps / self.run_seconds if self.run_seconds > 0.0 else 0.0

    def as_dict(self):
        """All figures, for a JSON file."""
        return {**asdict(self), "particle_steps_per_second": self.particle_steps_per_second}

    def write(self, path):
        """Write all figures as JSON. Raises InputError when the file cannot be written."""
        write_text(path, json.dumps(self.as_dict(), indent=1))

    def __str__(self):
        """A table of seven lines."""
        rows = [
            ("method", f"{self.method}, container on the {self.mount}"),
            ("effects", ", ".join(self.effects) or "none"),
            ("scenes", f"{self.scenes:,} with {_range(self.particles)} particles"),
            ("simulated", f"{self.simulated_s:.4g} s in steps of {_range(self.dt_s)} s"),
            ("steps", f"{self.scene_steps:,} of scenes, {self.particle_steps:,} of particles"),
            ("evaluations", f"{self.container_evaluations:,} of the container's motion"),
            (
                "time",
                f"{self.compile_seconds:.1f} s before the first step, {self.run_seconds:.1f} s run "
                f"({1e-6 * self.particle_steps_per_second:.3g} million particle steps a second)",
            ),
        ]
        return "\n".join(f"{name:18s} {text}" for name, text in rows)


def _range(pair):
    low, high = (f"{value:.3g}" for value in pair)
    return low if low == high else f"{low} to {high}"
