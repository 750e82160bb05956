"""Fingertips in Newton, in all worlds of a `SolverMuJoCo`.

Main function: `attach`. It finds sites and geoms by the labels of Newton's shapes and hooks the contacts into the MuJoCo Warp model within the
solver. Uses `mujoco` for the contacts.
"""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import Any

import mujoco

from fingerpad_warp import _arrays
from fingerpad_warp._errors import InputError
from fingerpad_warp._model import Model
from fingerpad_warp._pad_model import Pad
from fingerpad_warp.mujoco import Callback, _listed

#: MuJoCo's kinds of elements that become ends of a contact.
KINDS = {"site": mujoco.mjtObj.mjOBJ_SITE, "geom": mujoco.mjtObj.mjOBJ_GEOM}


class Contacts(Callback):
    """The contacts of fingertips in all worlds of a Newton simulation; `attach` makes them."""

    def __call__(self, m: Any, d: Any) -> None:
        """Adds the forces of the contacts; the first step outside a CUDA graph is refused if its length is not that of `attach`."""
        if not self._is_checked and not self.device.is_capturing:
            dt_s = float(m.opt.timestep.numpy()[0])
            if abs(dt_s - self._dt_s) > 1e-6 * self._dt_s:
                raise InputError(f"dt_s: {self._dt_s:g} s at attach, but the solver steps by {dt_s:g} s")
            self._is_checked = True
        super().__call__(m, d)

    _is_checked = False


def attach(model: Model | Pad, solver: Any, contacts: Sequence[tuple[str, str]], dt_s: float, **options: Any) -> Contacts:
    """Hooks fingertips into a `newton.solvers.SolverMuJoCo` on MuJoCo Warp (not `use_mujoco_cpu`).

    contacts: labels of a site (`builder.add_site`) and of a geom, one pair a contact; a label may have the wildcards of Newton's selections
    (`*/tip`) and must match one shape of the first world. dt_s: length of the steps of the solver, s. options: those of
    `fingerpad_warp.mujoco.Callback`. Keep the object: it has the responses, and `reset` for worlds that the solver resets.
    """
    if getattr(solver, "mjw_data", None) is None or solver.use_mujoco_cpu:
        raise InputError("solver: a SolverMuJoCo on MuJoCo Warp is needed (use_mujoco_cpu=False)")
    mj_model = solver.mj_model
    pairs = [(_named(solver, "site", site), _named(solver, "geom", geom)) for site, geom in _listed(contacts)]
    mj_model.opt.timestep = _arrays.number_within("dt_s", dt_s, 1e-6, 1)
    solver.mjw_model.opt.timestep.fill_(mj_model.opt.timestep)
    return Contacts(model, mj_model, solver.mjw_model, solver.mjw_data, pairs, **options)


def _named(solver: Any, kind: str, label: str) -> str:
    """The name in MuJoCo, `<label>_<number of the shape>`, of the one shape that a label matches."""
    mj_model, labels, found = solver.mj_model, solver.model.shape_label, []
    for number in range(mj_model.nsite if kind == "site" else mj_model.ngeom):
        name = mujoco.mj_id2name(mj_model, KINDS[kind], number) or ""
        own, _, shape = name.rpartition("_")
        if shape.isdecimal() and int(shape) < len(labels) and labels[int(shape)] == own and fnmatchcase(own, label):
            found.append((own, name))
    if not found:
        hint = "" if kind == "site" else "; the solver leaves out shapes that collide with nothing unless skip_visual_only_geoms=False"
        raise InputError(f"contacts: the solver has no {kind} with the label {label!r}{hint}")
    if len(found) > 1:
        raise InputError(f"contacts: the label {label!r} matches {len(found)} {kind}s: {', '.join(own for own, _ in found)}")
    return found[0][1]
