"""Fingertips as passive forces in MuJoCo Warp, in all worlds at once.

Main class: `Callback`. A fingertip is a site of the model; what it touches are geoms. Each pass through MuJoCo Warp's forward dynamics is a
trial on the memory of the contacts; the memory moves on when the time of a world has moved on. Uses `_frames` for the geometry.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
import warp as wp

from fingerpad_warp import _arrays, _bed, _frames, _pad
from fingerpad_warp._errors import InputError
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import Pad
from fingerpad_warp._status import Regime

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

#: Integrators that ask for passive forces once a step.
INTEGRATORS = ("EULER", "IMPLICIT", "IMPLICITFAST")
#: MuJoCo's numbers of the geoms that a finger touches, and those of their shapes.
SHAPES = {
    0: _frames.PLANE, 2: _frames.SPHERE, 3: _frames.CAPSULE, 4: _frames.ELLIPSOID, 5: _frames.CYLINDER, 6: _frames.BOX,
}  # fmt: skip
#: Largest ratio of the semi-axes of an ellipsoid, as in the plugin for MuJoCo.
AXES_RATIO = 1.4

MM_PER_M = wp.constant(wp.float32(1000.0))
# Depth over which the dampers grow from nothing, mm.
DAMPING_DEPTH_MM = wp.constant(wp.float32(0.2))


@wp.kernel
def commit(
    time: wp.array(dtype=float),
    dt_s: float,
    contacts: int,
    trial_time: wp.array(dtype=float),
    trial: wp.array2d(dtype=float),
    past: wp.array2d(dtype=float),
    fresh: wp.array(dtype=float),
):
    """A trial becomes the past of a world whose time has moved on; a world whose time went back starts without memory.

    Where the time is so late that single precision no longer moves it by a step, each pass counts as a step.
    """
    i = wp.tid()
    now = time[i // contacts]
    if now > trial_time[i] or (now == trial_time[i] and now + dt_s == now):
        for row in range(past.shape[0]):
            past[row, i] = trial[row, i]
    elif now < trial_time[i]:
        for row in range(past.shape[0]):
            past[row, i] = 0.0
            if row < fresh.shape[0]:
                past[row, i] = fresh[row]
    trial_time[i] = now


@wp.kernel
def place_sites(
    site: wp.array(dtype=int),
    geom: wp.array(dtype=int),
    kind: wp.array(dtype=int),
    edge_radius_mm: float,
    geom_size: wp.array2d(dtype=wp.vec3),
    site_xpos: wp.array2d(dtype=wp.vec3),
    site_xmat: wp.array2d(dtype=wp.mat33),
    geom_xpos: wp.array2d(dtype=wp.vec3),
    geom_xmat: wp.array2d(dtype=wp.mat33),
    level: wp.mat33,
    at: wp.array(dtype=wp.vec3),
    axes: wp.array(dtype=wp.mat33),
    is_known: wp.array(dtype=int),
    shapes: wp.array(dtype=_frames.Solid),
):
    """Each finger in the frame of its geom, and the shape of the geom."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    tip = site_xpos[world, site[k]]
    middle = geom_xpos[world, geom[k]]
    turn = geom_xmat[world, geom[k]]
    of_site = site_xmat[world, site[k]]
    is_known[i] = 1
    if not wp.isfinite(tip[0] + tip[1] + tip[2] + middle[0] + middle[1] + middle[2]):
        is_known[i] = 0
    for r in range(3):
        for c in range(3):
            if not (wp.isfinite(turn[r, c]) and wp.isfinite(of_site[r, c])):
                is_known[i] = 0
    at[i] = MM_PER_M * (wp.transpose(turn) @ (tip - middle))
    # The finger's own axes first, whose rounding stays the same while only the object moves.
    axes[i] = wp.transpose(turn) @ (of_site @ level)
    size = MM_PER_M * geom_size[world % geom_size.shape[0], geom[k]]
    if kind[k] == wp.static(_frames.SPHERE):
        size = wp.vec3(size[0], size[0], size[0])
    shape = _frames.Solid()
    shape.kind = kind[k]
    shape.size = size
    shape.edge_radius = edge_radius_mm
    shapes[i] = shape


@wp.func
def velocity_at(
    body: int, world: int, at: wp.vec3, body_rootid: wp.array(dtype=int), subtree_com: wp.array2d(dtype=wp.vec3),
    cvel: wp.array2d(dtype=wp.spatial_vector),
):
    """Turn and speed of a body at a point, in the world."""
    v = cvel[world, body]
    turn = wp.spatial_top(v)
    return wp.spatial_vector(turn, wp.spatial_bottom(v) + wp.cross(turn, at - subtree_com[world, body_rootid[body]]))


@wp.kernel
def wrench_of_contacts(
    site: wp.array(dtype=int),
    site_body: wp.array(dtype=int),
    geom_body: wp.array(dtype=int),
    body_rootid: wp.array(dtype=int),
    subtree_com: wp.array2d(dtype=wp.vec3),
    cvel: wp.array2d(dtype=wp.spatial_vector),
    site_xpos: wp.array2d(dtype=wp.vec3),
    site_xmat: wp.array2d(dtype=wp.mat33),
    damping: wp.vec3,
    pad: wp.array(dtype=float),
    radius_mm: wp.vec2,
    level: wp.mat33,
    is_known: wp.array(dtype=int),
    stands: wp.array(dtype=_frames.Stand),
    depth_mm: wp.array(dtype=float),
    response: wp.array2d(dtype=float),
    regime: wp.array(dtype=int),
    on_finger: wp.array(dtype=wp.spatial_vector),
    wrench: wp.array2d(dtype=wp.spatial_vector),
    dampers: wp.array(dtype=wp.vec4),
):
    """Force and moment on the finger about its site, in the world: those of its model, and the dampers."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    wrench[world, k] = wp.spatial_vector()
    dampers[i] = wp.vec4()
    # No force goes to bodies whose place is unknown.
    if regime[i] == wp.static(int(Regime.NO_CONTACT)) or is_known[i] == 0:
        return
    s = stands[i]
    tip = site_xpos[world, site[k]]
    of_site = site_xmat[world, site[k]]
    finger = velocity_at(site_body[k], world, tip, body_rootid, subtree_com, cvel)
    body = velocity_at(geom_body[k], world, tip, body_rootid, subtree_com, cvel)
    turned = _pad.tilted_axes(s.pitch, s.roll)
    to_contact = turned @ wp.transpose(of_site @ level)
    turn = to_contact @ wp.spatial_top(finger - body)
    speed = to_contact @ wp.spatial_bottom(finger - body)
    # Dampers act at the point of the finger that touches first. A bed's follows from the slopes of its depth.
    touch = turned @ _frames.touch_mm(pad, s.pitch, s.roll)
    if pad.shape[0] == 0:
        touch = wp.vec3(
            radius_mm[0] * wp.sin(s.pitch),
            -radius_mm[1] * wp.sin(s.roll) / wp.cos(s.pitch),
            -_frames.lowest_mm(pad, radius_mm, s.pitch, s.roll),
        )
    touch = touch / MM_PER_M
    swept = speed + wp.cross(turn, touch)
    share = wp.min(1.0, depth_mm[i] / DAMPING_DEPTH_MM)
    stuck = share * response[wp.static(_bed.STICK), i]
    # They never pull.
    damp = wp.vec3(
        -stuck * damping[1] * swept[0],
        -stuck * damping[1] * swept[1],
        wp.max(-response[wp.static(_bed.NORMAL_N), i], -share * damping[0] * swept[2]),
    )
    damp_spin = -stuck * damping[2] * turn[2]
    moment = wp.cross(touch, damp) + wp.vec3(-share * damping[2] * turn[0], -share * damping[2] * turn[1], damp_spin)
    to_world = wp.transpose(to_contact)
    felt = on_finger[i]
    wrench[world, k] = wp.spatial_vector(
        of_site @ wp.spatial_top(felt) + to_world @ damp, of_site @ (wp.spatial_bottom(felt) / MM_PER_M) + to_world @ moment
    )
    dampers[i] = wp.vec4(damp[0], damp[1], damp[2], MM_PER_M * damp_spin)


@wp.kernel
def apply(
    site: wp.array(dtype=int),
    site_body: wp.array(dtype=int),
    geom_body: wp.array(dtype=int),
    moves: wp.array2d(dtype=int),
    dof_bodyid: wp.array(dtype=int),
    body_rootid: wp.array(dtype=int),
    subtree_com: wp.array2d(dtype=wp.vec3),
    cdof: wp.array2d(dtype=wp.spatial_vector),
    site_xpos: wp.array2d(dtype=wp.vec3),
    wrench: wp.array2d(dtype=wp.spatial_vector),
    qfrc_passive: wp.array2d(dtype=float),
):
    """Adds the generalised forces: what acts on the finger, and the opposite on the geom's body at the same point."""
    world, dof = wp.tid()
    axis = cdof[world, dof]
    turn = wp.spatial_top(axis)
    com = subtree_com[world, body_rootid[dof_bodyid[dof]]]
    sum = float(0.0)
    for k in range(site.shape[0]):
        # 1 where the degree of freedom moves the body.
        sign = float(moves[site_body[k], dof] - moves[geom_body[k], dof])
        if sign != 0.0:
            w = wrench[world, k]
            at = wp.spatial_bottom(axis) + wp.cross(turn, site_xpos[world, site[k]] - com)
            sum = sum + sign * (wp.dot(at, wp.spatial_top(w)) + wp.dot(turn, wp.spatial_bottom(w)))
    qfrc_passive[world, dof] = qfrc_passive[world, dof] + sum


class Callback:
    """The contacts of fingertips in all worlds of a MuJoCo Warp simulation, as its `m.callback.passive`.

    The site stands where the undeformed pad first touches in the neutral pose and has the axes of the bone: x along the finger from
    proximal to distal, z to the nail's side, so that a finger of pitch 30 has its x axis inclined by 30 degrees. Switch MuJoCo's own
    contact between finger and object off, else there are two.
    """

    def __init__(
        self,
        model: Model | Pad,
        mj_model: Any,
        m: Any,
        d: Any,
        contacts: Sequence[tuple[str, str]],
        *,
        strength_factor: Any = None,
        damping_normal_n_s_per_m: float = 2.0,
        damping_slide_n_s_per_m: float = 2.0,
        damping_spin_n_m_s_per_rad: float = 2e-5,
        pad_radius_mm: tuple[float, float] | None = None,
        edge_radius_mm: float | None = None,
    ) -> None:
        """Hooks the contacts into `m.callback.passive`; a callback that is there already is called first.

        model: a bed of springs, which is of one pose of the finger, or a pad, which follows it. mj_model: the MuJoCo model; m, d: of MuJoCo
        Warp, made from it. contacts: names of a site and of a geom, one pair a contact: a bed touches planes and boxes, a pad also spheres,
        ellipsoids, cylinders, capsules and the edges of boxes. strength_factor: on the friction, a number or an array of shape (worlds,
        contacts); later in the Warp array `strength`. pad_radius_mm: of a bed, radius of the finger along and across (21 and 21 without):
        how depth counts when it tilts. edge_radius_mm: of a pad, radius of the rounding of a box's edges, 0.1 to 10 (2 without). Dampers
        are those of the plugin for MuJoCo: the only part that is not the model of the finger.
        """
        if not isinstance(model, (Model, Pad)):
            raise InputError(f"model: {type(model).__name__} where a Model or a Pad is needed")
        if isinstance(model, Model) and model.effects:
            warnings.warn(f"steps leave out the {model.effects} effects of this model file", stacklevel=2)
        integrator = getattr(m.opt.integrator, "name", None) or type_name(m.opt.integrator)
        if integrator not in INTEGRATORS:
            raise InputError(f"mj_model.opt.integrator: {integrator} is none of {', '.join(INTEGRATORS)}")
        is_pad = isinstance(model, Pad)
        self.contacts = [_pair(mj_model, each, is_pad) for each in _listed(contacts)]
        self.worlds, self.device = d.nworld, d.qpos.device
        count = self.worlds * len(self.contacts)
        self._dt_s = float(mj_model.opt.timestep)
        self._damping = wp.vec3(
            _positive("damping_normal_n_s_per_m", damping_normal_n_s_per_m),
            _positive("damping_slide_n_s_per_m", damping_slide_n_s_per_m),
            _positive("damping_spin_n_m_s_per_rad", damping_spin_n_m_s_per_rad),
        )
        if is_pad and pad_radius_mm is not None:
            raise InputError(f"pad_radius_mm: {pad_radius_mm!r}, but a pad has a shape of its own; leave it out")
        if not is_pad and edge_radius_mm is not None:
            raise InputError(f"edge_radius_mm: {edge_radius_mm!r}, but a bed touches no edges; leave it out")
        radii = (_frames.BED_RADIUS_MM,) * 2 if pad_radius_mm is None else pad_radius_mm
        if np.shape(radii) != (2,):
            raise InputError(f"pad_radius_mm: {radii!r} where two numbers are needed")
        self._radii = wp.vec2(*(_positive("pad_radius_mm", radius, 1000.0) for radius in radii))
        self._edge_radius_mm = _positive("edge_radius_mm", 2.0 if edge_radius_mm is None else edge_radius_mm, 10.0, 0.1)
        self._shapes = wp.zeros(count, dtype=_frames.Solid, device=self.device)
        self._frames = _frames.Frames(model, count, self.device, self._shapes, tuple(self._radii))
        sites, geoms = ([pair[k] for pair in self.contacts] for k in (0, 1))
        ints = {
            "site": sites, "geom": geoms, "kind": [SHAPES[kind] for kind in mj_model.geom_type[geoms]],
            "site_body": mj_model.site_bodyid[sites], "geom_body": mj_model.geom_bodyid[geoms],
        }  # fmt: skip
        for name, values in ints.items():
            setattr(self, f"_{name}", wp.array(np.asarray(values, np.int32), dtype=int, device=self.device))
        self._moves = wp.array(_moved_bodies(mj_model), dtype=int, device=self.device)
        self._trial_time = wp.full(count, -np.inf, dtype=float, device=self.device)
        given = _arrays.numbers("strength_factor", 1.0 if strength_factor is None else strength_factor, (self.worlds, len(sites)))
        outside = given[~((given >= 0.1) & (given <= 5))]
        if outside.size:
            raise InputError(f"strength_factor: {outside[0]:g} is not between 0.1 and 5")
        #: Factor on the friction of each contact: a Warp array, world by world.
        self.strength = wp.array(given.reshape(-1), dtype=float, device=self.device)
        self._frames.motion["strength_factor"] = self.strength
        self._wrench = wp.zeros((self.worlds, len(sites)), dtype=wp.spatial_vector, device=self.device)
        self._dampers = wp.zeros(count, dtype=wp.vec4, device=self.device)
        #: What the contacts answered in the last pass: contact k of world w is number w * contacts + k.
        self.response = self._frames.response
        self._before = m.callback.passive
        m.callback.passive = self

    def __call__(self, m: Any, d: Any) -> None:
        """Adds the forces of the contacts to `d.qfrc_passive`."""
        if self._before is not None:
            self._before(m, d)
        if d.nworld != self.worlds:
            raise InputError(f"d: {d.nworld} worlds where {self.worlds} are needed; make a Callback for each Data")
        frames, each = self._frames, (self.worlds, len(self.contacts))
        wp.launch(
            commit,
            dim=self._trial_time.shape[0],
            inputs=[d.time, self._dt_s, len(self.contacts), self._trial_time, frames.trial, frames.past, frames.fresh],
            device=self.device,
        )
        wp.launch(
            place_sites,
            dim=each,
            inputs=[
                self._site, self._geom, self._kind, self._edge_radius_mm, m.geom_size, d.site_xpos, d.site_xmat, d.geom_xpos, d.geom_xmat,
                frames.level,
            ],
            outputs=[frames.at, frames.axes, frames.is_known, self._shapes],
            device=self.device,
        )  # fmt: skip
        frames.step(self._dt_s)
        wp.launch(
            wrench_of_contacts,
            dim=each,
            inputs=[
                self._site, self._site_body, self._geom_body, m.body_rootid, d.subtree_com, d.cvel, d.site_xpos, d.site_xmat, self._damping,
                frames.pad, self._radii, frames.level, frames.is_known, frames.stands, frames.motion["depth_mm"], self.response.values,
                self.response.regime, frames.on_finger,
            ],
            outputs=[self._wrench, self._dampers],
            device=self.device,
        )  # fmt: skip
        wp.launch(
            apply,
            dim=(self.worlds, m.nv),
            inputs=[
                self._site, self._site_body, self._geom_body, self._moves, m.dof_bodyid, m.body_rootid, d.subtree_com, d.cdof,
                d.site_xpos, self._wrench,
            ],
            outputs=[d.qfrc_passive],
            device=self.device,
        )  # fmt: skip

    def read(self) -> np.ndarray[Any, Any]:
        """What the contacts answered in the last pass, a structured array of shape (worlds, contacts)."""
        return self.response.numpy().reshape(self.worlds, len(self.contacts))

    def depth_mm(self) -> np.ndarray[Any, Any]:
        """Depth of the contacts in the last pass, mm, shape (worlds, contacts); negative in the air."""
        return self._frames.motion["depth_mm"].numpy().reshape(self.worlds, len(self.contacts))


def type_name(integrator: Any) -> str:
    """Name of an integrator that is given by its number."""
    from mujoco import mjtIntegrator

    return mjtIntegrator(int(integrator)).name.removeprefix("mjINT_")


def _listed(contacts: Any) -> list[Any]:
    try:
        pairs = [(str(site), str(geom)) for site, geom in contacts]
    except (TypeError, ValueError):
        raise InputError(f"contacts: {contacts!r} where pairs of the names of a site and a geom are needed") from None
    if not pairs:
        raise InputError("contacts: at least one pair is needed")
    return pairs


def _pair(mj_model: Any, names: tuple[str, str], is_pad: bool) -> tuple[int, int]:
    """Numbers of a site and a geom; refused by name."""
    import mujoco

    site = mujoco.mj_name2id(mj_model, mujoco.mjtObj.mjOBJ_SITE, names[0])
    geom = mujoco.mj_name2id(mj_model, mujoco.mjtObj.mjOBJ_GEOM, names[1])
    if site < 0:
        raise InputError(f"contacts: the model has no site {names[0]!r}")
    if geom < 0:
        raise InputError(f"contacts: the model has no geom {names[1]!r}")
    kind = int(mj_model.geom_type[geom])
    name = mujoco.mjtGeom(kind).name.removeprefix("mjGEOM_").lower()
    if SHAPES.get(kind) not in ((*SHAPES.values(),) if is_pad else (_frames.PLANE, _frames.BOX)):
        touched = "planes, boxes, spheres, ellipsoids, cylinders and capsules" if is_pad else "planes and boxes"
        raise InputError(f"contacts: geom {names[1]!r} is a {name}; a {'pad' if is_pad else 'bed'} touches {touched}")
    axes = mj_model.geom_size[geom]
    if SHAPES[kind] == _frames.ELLIPSOID and max(axes) > AXES_RATIO * min(axes):
        ratio = max(axes) / min(axes)
        raise InputError(f"contacts: geom {names[1]!r} has semi-axes of ratio {ratio:.3g}; a pad touches ellipsoids up to {AXES_RATIO}")
    return site, geom


def _moved_bodies(mj_model: Any) -> np.ndarray[Any, Any]:
    """Whether a degree of freedom moves a body: shape (bodies, degrees of freedom)."""
    moves = np.zeros((mj_model.nbody, max(mj_model.nv, 1)), np.int32)
    for body in range(1, mj_model.nbody):
        moves[body] = moves[mj_model.body_parentid[body]]
        start, count = mj_model.body_dofadr[body], mj_model.body_dofnum[body]
        if count:
            moves[body, start : start + count] = 1
    return moves


def _positive(name: str, value: Any, most: float = 1e6, least: float = 0.0) -> float:
    number = _arrays.one_number(name, value)
    if not least <= number <= most:
        raise InputError(f"{name}: {number:g} is not between {least:g} and {most:g}")
    return number
