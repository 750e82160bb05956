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

from fingerpad_warp import _arrays, _frames, _semi_implicit
from fingerpad_warp._errors import InputError
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import RADIUS_MM, Pad

wp.set_module_options({"enable_backward": False, "fuse_fp": False})

#: Integrators that ask for passive forces once a step.
INTEGRATORS = ("EULER", "IMPLICIT", "IMPLICITFAST")
#: Geoms that a pad touches: the number of the shape, and how many of MuJoCo's sizes it has.
SHAPES = {
    "plane": (_frames.PLANE, 0), "box": (_frames.BOX, 3), "sphere": (_frames.SPHERE, 1), "ellipsoid": (_frames.ELLIPSOID, 3),
    "cylinder": (_frames.CYLINDER, 2), "capsule": (_frames.CAPSULE, 2),
}  # fmt: skip
#: Those that a bed touches.
FLAT = ("plane", "box")
#: Largest ratio of the semi-axes of an ellipsoid, which counts as a sphere of its local curvature.
AXES_RATIO = 1.4

MM_PER_M = wp.constant(wp.float32(1000.0))


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
def forget(worlds: wp.array(dtype=wp.bool), contacts: int, trial_time: wp.array(dtype=float)):
    """Lets the contacts of the chosen worlds, or of all without `worlds`, start without memory: `commit` finds that the time went back."""
    i = wp.tid()
    if not worlds or worlds[i // contacts]:
        trial_time[i] = wp.inf


@wp.kernel
def sites_of_bodies(
    site: wp.array(dtype=int),
    geom: wp.array(dtype=int),
    kind: wp.array(dtype=int),
    edge_radius_mm: float,
    level: wp.mat33,
    geom_size: wp.array2d(dtype=wp.vec3),
    site_xpos: wp.array2d(dtype=wp.vec3),
    site_xmat: wp.array2d(dtype=wp.mat33),
    geom_xpos: wp.array2d(dtype=wp.vec3),
    geom_xmat: wp.array2d(dtype=wp.mat33),
    shapes: wp.array(dtype=_frames.Solid),
    at: wp.array(dtype=wp.vec3d),
    axes: wp.array(dtype=wp.mat33),
    is_known: wp.array(dtype=int),
):
    """Each finger in the frame of its geom, and the shape of the geom, whose sizes may differ from world to world."""
    world, k = wp.tid()
    i = world * site.shape[0] + k
    to_geom = wp.transpose(geom_xmat[world, geom[k]])
    apart = wp.vec3d(site_xpos[world, site[k]]) - wp.vec3d(geom_xpos[world, geom[k]])
    place = wp.float64(1000.0) * (wp.mat33d(to_geom) @ apart)
    # The finger's own axes first, whose rounding stays the same while only the object moves.
    turned = to_geom @ (site_xmat[world, site[k]] @ level)
    is_known[i] = 0
    if wp.length(wp.vec3(place)) <= _frames.FARTHEST_MM and wp.isfinite(turned):
        is_known[i] = 1
    at[i] = place
    axes[i] = turned
    shape = _frames.Solid()
    shape.kind = kind[k]
    shape.size = MM_PER_M * geom_size[world % geom_size.shape[0], geom[k]]
    if kind[k] == wp.static(_frames.SPHERE):
        shape.size = wp.vec3(shape.size[0], shape.size[0], shape.size[0])
    shape.edge_radius = edge_radius_mm
    shapes[i] = shape


@wp.kernel
def jacobians(
    site: wp.array(dtype=int),
    site_body: wp.array(dtype=int),
    geom_body: wp.array(dtype=int),
    moves: wp.array2d(dtype=int),
    dof_bodyid: wp.array(dtype=int),
    body_rootid: wp.array(dtype=int),
    subtree_com: wp.array2d(dtype=wp.vec3),
    cdof: wp.array2d(dtype=wp.spatial_vector),
    site_xpos: wp.array2d(dtype=wp.vec3),
    jacobian: wp.array3d(dtype=float),
):
    """Shift and turn of each site against the geom's body, in the world, by the degrees of freedom."""
    world, k, dof = wp.tid()
    i = world * site.shape[0] + k
    # 1 where the degree of freedom moves the body.
    sign = float(moves[site_body[k], dof] - moves[geom_body[k], dof])
    turn = wp.spatial_top(cdof[world, dof])
    apart = site_xpos[world, site[k]] - subtree_com[world, body_rootid[dof_bodyid[dof]]]
    shift = wp.spatial_bottom(cdof[world, dof]) + wp.cross(turn, apart)
    for c in range(3):
        jacobian[i, c, dof] = sign * shift[c]
        jacobian[i, 3 + c, dof] = sign * turn[c]


@wp.kernel
def apply(jacobian: wp.array3d(dtype=float), wrench: wp.array2d(dtype=wp.spatial_vector), qfrc_passive: wp.array2d(dtype=float)):
    """Adds the generalised forces: what acts on the finger, and the opposite on the geom's body at the same point."""
    world, dof = wp.tid()
    sum = float(0.0)
    for k in range(wrench.shape[1]):
        w = wrench[world, k]
        # Where the place of a body is unknown so is the Jacobian.
        if wp.dot(w, w) > 0.0:
            for c in range(6):
                sum = sum + jacobian[world * wrench.shape[1] + k, c, dof] * w[c]
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
        Warp, made from it. contacts: names of a site and of a geom, one pair a contact; a bed touches planes and boxes, a pad also spheres,
        ellipsoids, cylinders and capsules. strength_factor: on the friction, a number or an array of shape (worlds, contacts); later in the
        Warp array `strength`. pad_radius_mm: of a bed, radius of the finger along and across (21 and 21 without): how depth counts when it
        tilts. edge_radius_mm: of a pad, radius of the rounding of a box's edges (2 without). Dampers are those of the plugin for MuJoCo: the
        only part that is not the model of the finger.
        """
        if not isinstance(model, (Model, Pad)):
            raise InputError(f"model: {type(model).__name__} where a Model or a Pad is needed")
        if isinstance(model, Model) and model.effects:
            warnings.warn(f"steps leave out the {model.effects} effects of this model file", stacklevel=2)
        integrator = getattr(m.opt.integrator, "name", None) or type_name(m.opt.integrator)
        if integrator not in INTEGRATORS:
            raise InputError(f"mj_model.opt.integrator: {integrator} is none of {', '.join(INTEGRATORS)}")
        is_pad = isinstance(model, Pad)
        if is_pad and pad_radius_mm is not None:
            raise InputError(f"pad_radius_mm: {pad_radius_mm!r}, but a pad has a shape of its own; leave it out")
        if not is_pad and edge_radius_mm is not None:
            raise InputError(f"edge_radius_mm: {edge_radius_mm!r}, but a bed touches no edges; leave it out")
        radii = (_frames.BED_RADIUS_MM,) * 2 if pad_radius_mm is None else pad_radius_mm
        if np.shape(radii) != (2,):
            raise InputError(f"pad_radius_mm: {radii!r} where two numbers are needed")
        self._radii = wp.vec2(*(_arrays.number_within("pad_radius_mm", radius, 0, 1000) for radius in radii))
        self._edge_radius_mm = _arrays.number_within("edge_radius_mm", 2.0 if edge_radius_mm is None else edge_radius_mm, 0.1, 10)
        damping = wp.vec3(
            _arrays.number_within("damping_normal_n_s_per_m", damping_normal_n_s_per_m, 0, 1e6),
            _arrays.number_within("damping_slide_n_s_per_m", damping_slide_n_s_per_m, 0, 1e6),
            _arrays.number_within("damping_spin_n_m_s_per_rad", damping_spin_n_m_s_per_rad, 0, 1e6),
        )
        self.contacts = [_pair(mj_model, each, is_pad) for each in _listed(contacts)]
        self.worlds, self.device = d.nworld, d.qpos.device
        count = self.worlds * len(self.contacts)
        self._dt_s = float(mj_model.opt.timestep)
        sites, geoms = ([pair[k] for pair in self.contacts] for k in (0, 1))
        ints = {
            "site": sites, "geom": geoms, "kind": [SHAPES[_kind(mj_model, geom)][0] for geom in geoms],
            "site_body": mj_model.site_bodyid[sites], "geom_body": mj_model.geom_bodyid[geoms],
        }  # fmt: skip
        for name, values in ints.items():
            setattr(self, f"_{name}", wp.array(np.asarray(values, np.int32), dtype=int, device=self.device))
        self._moves = wp.array(_moved_bodies(mj_model), dtype=int, device=self.device)
        shapes = wp.zeros(count, dtype=_frames.Solid, device=self.device)
        self._frames = _frames.Frames(model, count, self.device, shapes, self._radii)
        self._trial_time = wp.full(count, -np.inf, dtype=float, device=self.device)
        given = _arrays.numbers("strength_factor", 1.0 if strength_factor is None else strength_factor, (self.worlds, len(sites)))
        outside = given[~((given >= 0.1) & (given <= 5))]
        if outside.size:
            raise InputError(f"strength_factor: {outside[0]:g} is not between 0.1 and 5")
        #: Factor on the friction of each contact: a Warp array, world by world.
        self.strength = wp.array(given.reshape(-1), dtype=float, device=self.device)
        self._frames.motion["strength_factor"] = self.strength
        self._wrench = wp.zeros((self.worlds, len(sites)), dtype=wp.spatial_vector, device=self.device)
        self._jacobian = wp.zeros((count, 6, mj_model.nv), dtype=float, device=self.device)
        self._finger = _semi_implicit.finger_of(model, damping, self.device)
        self._tables = self._frames.engine.tables if not is_pad else [_arrays.nothing(self.device), None, wp.zeros((0, 0), dtype=float, device=self.device)]
        #: Of each world, 1 where the forces of the last pass are semi-implicit.
        self.semi_implicit = wp.zeros(self.worlds, dtype=int, device=self.device)
        self._coupling = _semi_implicit.Coupling(self.worlds, integrator != "EULER", self._jacobian)
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
            dim=frames.count,
            inputs=[d.time, self._dt_s, len(self.contacts), self._trial_time, frames.trial, frames.past, frames.fresh],
            device=self.device,
        )
        wp.launch(
            sites_of_bodies,
            dim=each,
            inputs=[
                self._site, self._geom, self._kind, self._edge_radius_mm, frames.level, m.geom_size, d.site_xpos, d.site_xmat, d.geom_xpos,
                d.geom_xmat,
            ],
            outputs=[frames.shapes, frames.at, frames.axes, frames.is_known],
            device=self.device,
        )  # fmt: skip
        frames.step(self._dt_s)
        wp.launch(
            jacobians,
            dim=(*each, m.nv),
            inputs=[
                self._site, self._site_body, self._geom_body, self._moves, m.dof_bodyid, m.body_rootid, d.subtree_com, d.cdof, d.site_xpos,
            ],
            outputs=[self._jacobian],
            device=self.device,
        )  # fmt: skip
        wp.launch(
            _semi_implicit.laws,
            dim=each,
            inputs=[
                self._site, self._geom, d.site_xmat, d.geom_xmat, d.qvel, self._finger, *self._tables[::2], frames.pad, self._radii,
                frames.motion["depth_mm"], frames.stands, frames.is_known, frames.face, frames.on_finger, self.response.values,
                self.response.regime, self._dt_s, self._jacobian,
            ],
            outputs=[self._coupling.law, self._wrench, self.response.status],
            device=self.device,
        )  # fmt: skip
        self._coupling.solve(m, d, self._dt_s, self._wrench, self.semi_implicit, self.response.status)
        wp.launch(apply, dim=(self.worlds, m.nv), inputs=[self._jacobian, self._wrench], outputs=[d.qfrc_passive], device=self.device)

    def reset(self, worlds: Any = None) -> None:
        """Contacts of these worlds start without memory: a Warp array of bool, one per world; all without it. For resets that leave the time as it is."""
        wp.launch(forget, dim=self._frames.count, inputs=[worlds, len(self.contacts), self._trial_time], device=self.device)

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
    kind, touched = _kind(mj_model, geom), tuple(SHAPES) if is_pad else FLAT
    if kind not in touched:
        raise InputError(f"contacts: geom {names[1]!r} is of type {kind}; a {'pad' if is_pad else 'bed'} touches {', '.join(touched)}")
    size_mm = 1000 * mj_model.geom_size[geom][: SHAPES[kind][1]]
    if kind == "ellipsoid" and size_mm.max() > AXES_RATIO * size_mm.min():
        raise InputError(f"contacts: geom {names[1]!r} has the semi-axes {size_mm} mm; a pad takes a ratio of up to {AXES_RATIO}")
    if any(not RADIUS_MM[0] <= size <= RADIUS_MM[1] for size in size_mm):
        raise InputError(f"contacts: geom {names[1]!r} has the sizes {size_mm} mm; a finger touches sizes of 0.1 to 1e6 mm")
    if mj_model.geom_bodyid[geom] == mj_model.site_bodyid[site]:
        raise InputError(f"contacts: geom {names[1]!r} belongs to the body of the site {names[0]!r}")
    return site, geom


def _kind(mj_model: Any, geom: int) -> str:
    """The type of a geom, by MuJoCo's name."""
    import mujoco

    return mujoco.mjtGeom(int(mj_model.geom_type[geom])).name.removeprefix("mjGEOM_").lower()


def _moved_bodies(mj_model: Any) -> np.ndarray[Any, Any]:
    """Whether a degree of freedom moves a body: shape (bodies, degrees of freedom)."""
    moves = np.zeros((mj_model.nbody, max(mj_model.nv, 1)), np.int32)
    for body in range(1, mj_model.nbody):
        moves[body] = moves[mj_model.body_parentid[body]]
        start, count = mj_model.body_dofadr[body], mj_model.body_dofnum[body]
        if count:
            moves[body, start : start + count] = 1
    return moves
