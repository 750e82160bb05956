"""The observer of the margin has the bits of the core along the readings of the core's own test (core/tests/all/margin.rs)."""

from __future__ import annotations

import struct

import pytest

import fingerpad
from fingerpad import Finger, InputError, MarginObserver, Model, Pad, Sphere, Status

DIGEST = 0xDEBBCAD0
KNOWN = ["no_contact", "prior", "part", "strength"]


def single(x: float) -> float:
    """The number rounded to 32 bits."""
    return struct.unpack("<f", struct.pack("<f", x))[0]


def test_the_bits_are_those_of_the_core() -> None:
    observer = MarginObserver(Model.shipped())
    seed, digest, variance = 7, 0, 2.0**-15

    def noise() -> float:
        nonlocal seed
        seed = (seed * 1664525 + 1013904223) % 2**32
        return ((seed >> 8) / 2**24 - 0.5) / 64

    for k in range(600):
        # The words in the order in which the core's test draws them.
        normal = single(min(k, 256) / 512 + noise())
        friction = [single(max(k - 300, 0) / 1024 + noise()), noise()]
        slide = [single((2**-7 if k > 300 else 0) + noise()), noise()]
        m = observer.step(
            normal,
            *friction,
            *slide,
            dt_s=0 if k % 97 == 96 else 2**-10,
            normal_variance_n2=variance,
            friction_covariance_n2=(variance, variance, 0),
            slide_covariance_mm2=(variance, variance, 0),
            stick_ratio=single(1 - max(k - 300, 0) / 512 + noise()),
            stick_variance=2**-8 if k % 128 >= 64 else 0,
        )
        if k % 97 == 96:
            assert Status(m.status) == Status.BAD_TIME_STEP
        floats = [
            m.strength_factor,
            m.strength_low,
            m.strength_high,
            m.slip_margin,
            m.margin_low,
            m.margin_high,
            m.slip_chance,
            m.stiffness_factor,
            m.information,
        ]
        words = [struct.unpack("<I", struct.pack("<f", x))[0] for x in floats]
        for word in [*words, KNOWN.index(m.known), int(m.surface_changed), m.status]:
            digest = (digest << 5 & 0xFFFFFFFF | digest >> 27) ^ word
    assert digest == DIGEST, hex(digest)


def test_settings_out_of_range_are_refused() -> None:
    with pytest.raises(InputError, match="out of range"):
        MarginObserver(fingerpad.Model.shipped(), confidence=1.0)


@pytest.mark.parametrize(("body", "pitch_deg"), [(None, 45.0), (Sphere(12.0), None)])
def test_a_pad_finds_the_strength_in_its_pose_and_on_a_body(body: Sphere | None, pitch_deg: float | None) -> None:
    pad = Pad.shipped()
    finger = Finger(pad, body=body, pitch_deg=pitch_deg)
    observer = MarginObserver(pad, body=body, pitch_deg=pitch_deg)
    strength = 1.5
    for k in range(1500):
        depth, slide = 1.5 * min(k / 300, 1), 0.004 if k > 300 else 0.0
        r = finger.step(depth, slide, strength_factor=strength)
        m = observer.step(r.normal_force_n, r.friction_x_n, r.friction_y_n, slide, 0.0)
        if k > 300 and r.slip_margin < 0.1:
            break
    assert m.known in ("part", "strength") and m.strength_low < strength < m.strength_high
    assert m.margin_low <= r.slip_margin <= m.margin_high


def test_the_moment_of_a_turn_tells_a_pad_the_strength() -> None:
    widths = []
    for variance in (0.0, 0.01):
        finger, observer = Finger(Pad.shipped()), MarginObserver(Pad.shipped())
        for k in range(1000):
            spin = 1e-3 if k > 300 else 0.0
            r = finger.step(1.5 * min(k / 300, 1), spin_rad=spin)
            m = observer.step(
                r.normal_force_n,
                r.friction_x_n,
                r.friction_y_n,
                0.0,
                0.0,
                spin_rad=spin,
                spin_moment_n_mm=r.spin_moment_n_mm,
                spin_variance_n2_mm2=variance,
            )
        widths.append(m.strength_high / m.strength_low)
    assert widths[1] < 0.6 * widths[0]


def test_what_is_not_of_a_pad_is_refused() -> None:
    with pytest.raises(InputError, match="body"):
        MarginObserver(Model.shipped(), body=Sphere(12.0))
    with pytest.raises(InputError, match="pitch_deg"):
        MarginObserver(Pad.shipped(), pitch_deg=500.0)
    with pytest.raises(InputError, match="RELX"):
        MarginObserver(Pad.shipped().relaxing([(0.5, 0.1)]))
