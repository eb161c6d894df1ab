"""Meshes made of others: joined, moved, with named groups, and their picture."""

import io

import numpy as np
import pytest
from PIL import Image

from taichi_dem import CONCRETE, Scene, effects, join
from taichi_dem.mesh.face_groups import with_body_group, with_outer_group
from taichi_dem.mesh.mesh import group_area, volumes
from taichi_dem.mesh.shapes import bar, single
from taichi_dem.mesh.topology import topology_of
from tests.bad_input.refusals import assert_refused
from tests.turns import matrix, quaternion

BAR = bar(0.2, 0.1, (2, 1, 1))
AFTER = BAR.moved(by=(0.2, 0.0, 0.0))
JOINED = join(BAR, AFTER.moved(by=(1.0, 0.0, 0.0)), names=["left", "right"])


def test_a_moved_mesh_turns_about_its_middle_and_keeps_its_groups():
    named = BAR.body_group("half", lambda x: x[:, 0] < 0.1)
    turned = named.moved(turned=(30.0, -40.0, 70.0), by=(1.0, 2.0, 3.0))
    angle = np.radians(np.sqrt(30.0**2 + 40.0**2 + 70.0**2))
    turn = matrix(quaternion([30.0, -40.0, 70.0], angle))
    middle = np.array([0.1, 0.05, 0.05])
    expected = middle + (BAR.points - middle) @ turn.T + [1.0, 2.0, 3.0]
    np.testing.assert_allclose(turned.points, expected, atol=2e-15)
    assert turned.body_groups["half"].tolist() == named.body_groups["half"].tolist()
    assert all((turned.groups[name] == BAR.groups[name]).all() for name in BAR.groups)
    shift = np.array([0.5, 0.0, 0.0])
    assert (BAR.moved(by=shift).points == BAR.points + shift).all()


def test_a_quarter_turn_is_exact():
    upright = BAR.moved(turned=(0.0, 0.0, 90.0), about=(0.0, 0.0, 0.0))
    x, y, z = BAR.points.T
    assert (upright.points == np.stack([-y, x, z], axis=1)).all()


def test_groups_by_predicate_are_those_of_the_functions():
    for method, function in ((BAR.group, with_outer_group), (BAR.body_group, with_body_group)):
        made, other = method("some", _left), function(BAR, "some", _left)
        for groups, others in ((made.groups, other.groups), (made.body_groups, other.body_groups)):
            assert {k: v.tolist() for k, v in groups.items()} == {
                k: v.tolist() for k, v in others.items()
            }


def _left(x):
    return x[:, 0] < 0.1


def test_meshes_apart_keep_their_groups_under_their_names():
    both = join(BAR, single(0.05).moved(by=(0.0, 0.5, 0.0)), names=["beam", "weight"])
    assert topology_of(both).bond_count == topology_of(BAR).bond_count
    assert both.body_groups["weight"].tolist() == [BAR.body_count]
    assert group_area(both, "beam_left") == pytest.approx(group_area(BAR, "left"))
    assert {"left", "base", "weight_base"} <= set(both.groups)
    assert "beam_base" not in both.groups


def test_meshes_that_touch_are_bonded_only_where_asked():
    apart, bonded = join(BAR, AFTER), join(BAR, AFTER, bonded=True)
    single_bonds = topology_of(BAR).bond_count
    assert topology_of(apart).bond_count == 2 * single_bonds and apart.has_open_faces
    # The end of a bar of one box is two triangles.
    assert topology_of(bonded).bond_count == 2 * single_bonds + 2
    assert volumes(bonded).tobytes() == volumes(apart).tobytes()
    assert set(bonded.inner_groups) == {"first_right", "second_left"}
    assert group_area(bonded, "left") == pytest.approx(0.01)
    whole = bar(0.4, 0.1, (4, 1, 1))
    assert topology_of(whole).bond_count == topology_of(bonded).bond_count


def test_the_picture_of_a_scene_shows_every_group(tmp_path):
    scene = Scene(BAR, CONCRETE, "auto", loads=[effects.Fixed("left")])
    for thing, name in ((BAR, "mesh.png"), (scene, "scene.png"), (single(), "single.png")):
        thing.picture(tmp_path / name)
        image = np.asarray(Image.open(tmp_path / name).convert("RGB"))
        assert image.shape[1] > 900 and (image < 250).any()
        assert "data:image/png;base64," in thing._repr_html_()
    assert Image.open(io.BytesIO((tmp_path / "mesh.png").read_bytes())).format == "PNG"


REFUSED = {
    "one": (lambda: join(BAR), "join must have at least two meshes", "got 1"),
    "clash": (
        lambda: join(JOINED, JOINED.moved(by=(9.0, 0.0, 0.0)), names=["left", "left_left"]),
        "names must give each group a name of its own",
        "left_",
    ),
    "no mesh": (lambda: join(BAR, 3), "mesh 1 must be a Mesh", "3"),
    "names": (lambda: join(BAR, AFTER, names=["a"]), "names must be 2 different names", "['a']"),
    "alike": (lambda: join(BAR, AFTER, names=["a", "a"]), "names must be 2 different", "'a', 'a'"),
    "bonded": (lambda: join(BAR, AFTER, bonded=1), "bonded must be True or False", "1"),
    "apart": (lambda: join(BAR, AFTER.moved(by=(1, 0, 0)), bonded=True), "share no face"),
    "by": (lambda: BAR.moved(by=3.0), "by must be three finite numbers", "3.0"),
    "turned": (lambda: BAR.moved(turned=(0, 90)), "turned must be three finite", "(0, 90)"),
    "about": (lambda: BAR.moved(about="x"), "about must be three finite numbers", "'x'"),
    "chosen": (lambda: BAR.group("a", 3), "chosen must be a function", "3"),
    "taken": (lambda: BAR.group("left", _left), "name must be that of a new group", "'left'"),
    "picture": (lambda: BAR.picture("mesh.jpg"), "path must end in .png", "mesh.jpg"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_no_mesh_name_or_place_is_refused(case):
    call, *words = REFUSED[case]
    assert_refused(call, *words)
