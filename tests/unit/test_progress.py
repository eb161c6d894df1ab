"""A job tells how far it is, on a terminal, in Jupyter and to a callback, and leaves no trace."""

from taichi_dem import CONCRETE, Scene, Uniform, simulate
from taichi_dem.mesh.shapes import bar


def test_a_callback_hears_of_the_run_to_its_end():
    told = []
    scene = Scene(bar(0.4, 0.1, (4, 1, 1)), CONCRETE, [])
    simulate(scene, method=Uniform(1e-6), until=1e-3, progress=told.append)
    shares = [progress.share for progress in told if progress.phase == "stepping"]
    assert shares == sorted(shares)
    assert (told[-1].share, told[-1].seconds_left) == (1.0, 0.0)
