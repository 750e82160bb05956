"""Loads the plugin into MuJoCo. `import mujoco` calls :func:`load` by an entry point of the group ``mujoco.plugins``."""

import ctypes
import importlib.metadata
import os
import pathlib

import mujoco

HERE = pathlib.Path(__file__).resolve().parent
#: The folder of the models that ship. An attribute ``model_file`` without a folder may name one of them.
MODELS = HERE / "models"


def load():
    """Registers the plugin with MuJoCo; a second call has no effect. Returns the library.

    Raises ImportError if the plugin was built against another version of MuJoCo, whose structures have another layout.
    """
    wanted = next(line.removeprefix("mujoco==") for line in importlib.metadata.requires("fingerpad-mujoco") if line.startswith("mujoco=="))
    if (found := mujoco.mj_versionString()) != wanted:
        raise ImportError(f"fingerpad-mujoco was built against MuJoCo {wanted}, and MuJoCo {found} is installed; this helps: pip install mujoco=={wanted}")
    library = ctypes.CDLL(str(HERE / "libfingerpad_mujoco.so"))
    library.fingerpad_mujoco_set_models(os.fsencode(MODELS))
    return library
