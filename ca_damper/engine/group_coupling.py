"""The step of a group of scenes whose boxes are at places of one structure; one group a thread."""

from typing import Any

import taichi as ti

from ca_damper.engine.coupling import _F64, Coupling
from ca_damper.filling import Action, Motion
from ca_damper.scenes.scene_fields import SceneFields


@ti.data_oriented
class GroupCoupling(Coupling):
    """Fillings of a group, in order, then their structure; as ``Coupling`` for one container.

    order[g]: first scene of the g-th group. wait: whether fillings step in two parts, so that the
    blows of all boxes are resolved together.
    """

    def __init__(self, table: SceneFields, *parts: Any):
        super().__init__(table, *parts)
        self.before = table.vector(3, ti.f64)
        self.wait = hasattr(self.device, "find_blows")

    @ti.kernel
    def start(self, initial: _F64):
        """Begin at step 0, places at initial[s] = (x, v) of their scenes."""
        for t in range(self.padding * self.table.scenes[None]):
            if t % self.padding == 0:
                first = t // self.padding
                if first == self.container.first(first):
                    for s in range(first, first + self.container.group[None]):
                        self._start_container(s, initial[s, 0], initial[s, 1])
                    self.container.complete_start(first)
                    for s in range(first, first + self.container.group[None]):
                        self._start_filling(s)

    @ti.kernel
    def advance(self, share: ti.f64):
        """Step every group to a share of the steps from its begin to its goal."""
        for t in range(self.padding * (self.table.scenes[None] // self.container.group[None])):
            if t % self.padding == 0:
                self._advance_scene(self.order[t // self.padding], share)

    @ti.func
    def _is_sound(self, s):
        sound = True
        for other in range(s, s + self.container.group[None]):
            if self.status[other] != 0:
                sound = False
        return sound

    @ti.func
    def _advance_step(self, s):
        end = s + self.container.group[None]
        for each in range(s, end):
            motion = self.container.motion(each)
            self.before[each] = ti.Vector([motion.x, motion.v, motion.a])
            self._record(each, motion)
        self._set_actions(s)
        attempts = self.container.advance(s)
        for each in range(s, end):
            before, ours = self.before[each], 0
            if each == s:
                ours = attempts
            action = Action(self.container.impulse[each], self.container.carried[each])
            self._book(each, Motion(before[0], before[1], before[2]), action, ours)

    @ti.func
    def _set_actions(self, s):
        """Actions of the fillings of a group on their places; those without a box have none."""
        end = s + self.container.boxes[None]
        if ti.static(self.wait):
            for each in range(s, end):
                motion = self.container.motion(each)
                blows = self.device.find_blows(each, self.step[each], motion)
                self.container.set_blows(each, blows)
            self.container.resolve(s)
        for each in range(s, end):
            motion, action = self.container.motion(each), Action(0.0, 0.0)
            if ti.static(self.wait):
                recoil = self.container.recoil_of(each)
                action = self.device.carry_out(each, self.step[each], motion, recoil)
            else:
                action = self.device.advance(each, self.step[each], motion)
            self.container.set_action(each, action)
