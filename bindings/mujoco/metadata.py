"""What the wheel depends on: the very MuJoCo that its plugin is built against, whose structures have another layout in each version."""

import importlib.metadata


def dynamic_metadata(settings, project):
    return {"dependencies": [f"mujoco=={importlib.metadata.version('mujoco')}", "numpy>=1.26"]}
