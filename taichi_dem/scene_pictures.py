"""How meshes and scenes are drawn before a run; matplotlib loads with the first picture."""

from taichi_dem.kit.pictures import drawn_by
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.scene import Scene


def picture_of(thing: Mesh | Scene) -> bytes:
    """The mesh coloured by group, of a scene with what acts on each group, as PNG."""
    # Imported here, so that matplotlib loads only where a picture is shown.
    from taichi_dem.plot.view import picture_of_groups

    acting: dict[str, list[str]] = {}
    for effect in getattr(thing, "effects", ()):
        if hasattr(effect, "group"):
            acting.setdefault(effect.group, []).append(effect.name.replace("_", " "))
    return picture_of_groups(thing.mesh if isinstance(thing, Scene) else thing, acting)


drawn_by(Mesh, picture_of)
drawn_by(Scene, picture_of)
