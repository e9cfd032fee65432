"""Joints in the order from the ground outward, which follows from the names of their parents."""

from collections.abc import Iterable
from dataclasses import replace
from itertools import combinations

from bicycle.parameters.rigid_bodies import Body, Joint
from tyre.ground.errors import InputError, unknown

FRONT_FRAME = "front frame"
STEER = "steer"


class JointTree:
    """Joints attached to one another by name: the order in which effects add them does not matter.

    The parent of the steer axis is the joint that carries the front frame with it, where there is one. A joint carries
    all its descendants, and what is fixed to them.
    """

    def __init__(self, joints: Iterable[Joint], bodies: Iterable[Body]) -> None:
        self.joints = {joint.name: joint for joint in joints}
        self._bodies = list(bodies)
        for joint in self.joints.values():
            if joint.hangs_on and joint.hangs_on not in self.joints:
                unknown_joint = unknown("joint", joint.hangs_on, list(self.joints))
                raise InputError(f"the joint {joint.name!r}: hangs_on names an {unknown_joint}")
        carriers = [j.name for j in self.joints.values() if FRONT_FRAME in j.carries and not self.hangs(j.name, STEER)]
        self.joints[STEER] = replace(self.joints[STEER], hangs_on=max(carriers, key=self.depth))

    def ancestors(self, name: str) -> list[str]:
        """Names of the parent of a joint, of the parent of that one, and so on to the ground."""
        names: list[str] = []
        while parent := self.joints[name].hangs_on:
            if parent in names:
                raise InputError(
                    f"the joints {parent!r} and {name!r} carry each other; give one of them hangs_on='lean'"
                )
            names.append(parent)
            name = parent
        return names

    def depth(self, name: str) -> int:
        """Number of joints between a joint and the ground."""
        return len(self.ancestors(name))

    def hangs(self, name: str, ancestor: str) -> bool:
        """True if a joint is another one or one of its descendants."""
        return ancestor in (name, *self.ancestors(name))

    def outward(self) -> list[Joint]:
        """Joints of the frame, the steer axis, those behind it: each after its parent, with all it carries."""
        carried = self._bodies_by_joint()
        for first, second in combinations(self.joints, 2):
            shared = carried[first] & carried[second]
            if shared and not (self.hangs(first, second) or self.hangs(second, first)):
                raise InputError(
                    f"the joints {first!r} and {second!r} both carry the {min(shared)}, and neither carries the "
                    f"other; add one of them with hangs_on={first!r} or {second!r}, or leave one out"
                )
        order = sorted(self.joints, key=lambda name: (self.hangs(name, STEER), self.depth(name)))
        return [replace(self.joints[name], carries=frozenset(carried[name])) for name in order]

    def _bodies_by_joint(self) -> dict[str, set[str]]:
        """Names of the bodies that each joint carries."""
        carried = {name: set(joint.carries) for name, joint in self.joints.items()}
        for _ in (*self._bodies, *self.joints):  # each time one step farther: bodies are fixed to fixed bodies
            for names in carried.values():
                names |= {body.name for body in self._bodies if body.fixed_to in names}
            for name, joint in self.joints.items():
                if joint.hangs_on:
                    carried[joint.hangs_on] |= carried[name]
        return carried
