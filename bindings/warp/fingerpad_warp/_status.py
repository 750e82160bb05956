"""What a contact as a whole does, and what is to be remarked about a step."""

from __future__ import annotations

from enum import IntEnum, IntFlag


class Regime(IntEnum):
    """What a contact as a whole does."""

    NO_CONTACT = 0
    STICK = 1
    PARTIAL_SLIP = 2
    SLIP = 3


class Status(IntFlag):
    """Remarks on a step; none is 0. The numbers are those of the core."""

    BAD_INPUT = 1 << 1
    BAD_TIME_STEP = 1 << 2
    DEPTH_ABOVE_RANGE = 1 << 3
    LARGE_INCREMENT = 1 << 4
    SPIN_IGNORED = 1 << 6
    MEMORY_LOST = 1 << 7
    POSE_OUT_OF_RANGE = 1 << 9
    NOT_CONVERGED = 1 << 10
    BODY_TOO_SHARP = 1 << 11
    BEGAN_INSIDE = 1 << 12
    BEYOND_EDGE = 1 << 13
    #: Of the callback for MuJoCo Warp alone.
    STEP_TOO_LONG = 1 << 14
