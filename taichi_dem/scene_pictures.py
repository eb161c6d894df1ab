"""How meshes and scenes are drawn before a run; matplotlib loads with the first picture."""

from taichi_dem.kit.pictures import drawn_by
from taichi_dem.mesh.mesh import Mesh
from taichi_dem.scene import Scene


def picture_of_mesh(mesh: Mesh) -> bytes:
    """The mesh coloured by group, as PNG."""
    # Imported here, so that matplotlib loads only where a picture is shown.
    from taichi_dem.plot.groups import picture_of_groups

    return picture_of_groups(mesh)


def picture_of_scene(scene: Scene) -> bytes:
    """The mesh coloured by group, with what acts on each group, as PNG."""
    from taichi_dem.plot.groups import picture_of_groups

    acting: dict[str, str] = {}
    for effect in scene.effects:
        if hasattr(effect, "group"):
            words = [acting[effect.group]] if effect.group in acting else []
            acting[effect.group] = ", ".join([*words, effect.name.replace("_", " ")])
    return picture_of_groups(scene.mesh, acting)


drawn_by(Mesh, picture_of_mesh)
drawn_by(Scene, picture_of_scene)
