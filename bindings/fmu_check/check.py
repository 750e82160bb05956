"""An FMU as an importing tool meets it, by FMPy: check.py FINGER.fmu CHARGED.fmu STORY-FOLDER

The story's folder has the paths by places with the core's own answers (bindings/c/story); every answer is compared bit for bit.
"""

import math
import pathlib
import random
import struct
import sys

import numpy
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi1 import FMICallException
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

INPUTS = ["depth_mm", "slide_x_mm", "slide_y_mm", "spin_rad", "strength_factor"]
# A column of the user's own, which only the charged model reads; last in the story's rows.
OWN = "voltage_v"
OUTPUTS = [
    "normal_force_n", "friction_x_n", "friction_y_n", "spin_moment_n_mm", "stick_ratio", "friction_limit_n",
    "slip_margin", "pressure_centre_x_mm", "pressure_centre_y_mm", "contact_area_mm2", "band_normal_n",
    "band_friction_n",
]
DT_S = 1e-3
# The rule by which the unit divides a step.
SUBSTEP_MM, ARM_MM, SUBSTEPS_MAX = 0.005, 4.0, 1000
WARNING, DISCARD, ERROR = 1, 2, 3


def read_rows(path):
    """Inputs as floats and answers as text, one pair a step."""
    rows = []
    for line in pathlib.Path(path).read_text().splitlines():
        inputs, answers = line.split(" | ")
        rows.append(([struct.unpack(">d", bytes.fromhex(word))[0] for word in inputs.split()], answers))
    return rows


class Finger:
    """One instance, set up to step."""

    def __init__(self, fmu, name="finger", token=None, model=None):
        """`model`: bytes in place of the model file inside."""
        self.description = read_model_description(fmu)
        self.folder = extract(fmu)
        if model is not None:
            pathlib.Path(self.folder, "resources", "model.fpm").write_bytes(model)
        self.names = {variable.name: variable.valueReference for variable in self.description.modelVariables}
        self.messages = []
        self.unit = FMU3Slave(
            guid=token or self.description.guid,
            unzipDirectory=self.folder,
            modelIdentifier=self.description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        # FMPy passes fmi3Warning over; the unit's message has it.
        self.unit.instantiate(
            loggingOn=True,
            logMessage=lambda environment, status, category, message: self.messages.append((int(status), message.decode())),
        )
        self.unit.enterInitializationMode(startTime=0.0)
        self.unit.exitInitializationMode()
        self.step_number = 0
        self.inputs = [self.names[name] for name in [*INPUTS, OWN] if name in self.names]
        self.outputs = [self.names[name] for name in OUTPUTS]

    def step(self, inputs, dt_s=DT_S):
        """Advances by one step; returns the status and the answer as the story has it."""
        self.unit.setFloat64(self.inputs, inputs[: len(self.inputs)])
        self.messages.clear()
        try:
            self.unit.doStep(self.step_number * dt_s, dt_s)
        except FMICallException as exception:
            return int(exception.status), self.answer()
        self.step_number += 1
        return max((status for status, _ in self.messages), default=0), self.answer()

    def number(self, name):
        return self.unit.getFloat64([self.names[name]])[0]

    def substeps(self):
        return self.unit.getInt32([self.names["substeps"]])[0]

    def answer(self):
        numbers = self.unit.getFloat64(self.outputs)
        words = [struct.pack(">f", number).hex() for number in numbers]
        # The outputs are 32-bit numbers in 64 bits: nothing may be lost on the way back.
        assert [struct.unpack(">f", bytes.fromhex(word))[0] for word in words] == list(numbers)
        return " ".join(words + [str(n) for n in self.unit.getInt32([self.names["regime"], self.names["status"]])])

    def close(self):
        self.unit.terminate()
        self.unit.freeInstance()


def refused(call, status):
    """Whether a call is answered by that status."""
    try:
        answered = call()
    except FMICallException as exception:
        return int(exception.status) == status
    return answered is not None and int(answered) == status


def same_bits(fmu, rows, what):
    finger = Finger(fmu)
    bad_input = 0
    for i, (inputs, want) in enumerate(rows):
        status, got = finger.step(inputs)
        assert got == want, f"{what}, step {i} {inputs}:\ncore {want}\nFMU  {got}"
        flagged = int(want.split()[-1]) & (2 | 128) != 0
        assert (status == WARNING) == flagged, f"{what}, step {i}: status {status} for flags {want.split()[-1]}"
        bad_input += flagged
    finger.close()
    print(f"{what}: {len(rows)} steps bit for bit, {bad_input} with bad input answered by fmi3Warning")
    return bad_input


def state_goes_back(fmu, rows):
    finger, other = Finger(fmu), Finger(fmu, "other")
    middle = len(rows) // 2
    for inputs, _ in rows[:middle]:
        finger.step(inputs)
    state = finger.unit.getFMUState()
    text = finger.unit.serializeFMUState(state)
    first = [finger.step(inputs) for inputs, _ in rows[middle:]]
    finger.unit.setFMUState(state)
    finger.step_number = middle
    assert [finger.step(inputs) for inputs, _ in rows[middle:]] == first, "a state that was set goes on otherwise"
    restored = other.unit.deserializeFMUState(text)
    other.unit.setFMUState(restored)
    other.step_number = middle
    assert [other.step(inputs) for inputs, _ in rows[middle:]] == first, "a state from bytes goes on otherwise"
    assert [answer for _, answer in first] == [want for _, want in rows[middle:]]
    damaged = bytearray(text)
    damaged[200] ^= 1
    assert refused(lambda: other.unit.deserializeFMUState(bytes(damaged)), ERROR), "a damaged state"
    assert refused(lambda: other.unit.deserializeFMUState(text[:-1]), ERROR), "a cut state"
    for each, states in ((finger, [state]), (other, [restored])):
        for state in states:
            each.unit.freeFMUState(state)
        each.close()
    print(f"states: got, set, serialised to {len(text)} bytes and read by another instance; damaged ones refused")


def two_at_once(fmu, clean, disturbed):
    one, two = Finger(fmu, "one"), Finger(fmu, "two")
    for (inputs, want), (more, wanted) in zip(clean, disturbed):
        assert one.step(inputs)[1] == want and two.step(more)[1] == wanted, "two instances disturb each other"
    one.close()
    two.close()
    print("two instances at once: each as alone")


def misuse(fmu, rows):
    finger = Finger(fmu)
    for inputs, _ in rows[:50]:
        finger.step(inputs)
    before = finger.unit.serializeFMUState(finger.unit.getFMUState())
    inputs = rows[50][0]
    for k, value in ((4, float("nan")), (4, 9.0)):
        bad = list(inputs)
        bad[k] = value
        assert finger.step(bad)[0] == DISCARD, f"{INPUTS[k]} {value} is to be discarded"
        assert finger.messages == [(DISCARD, f"{INPUTS[k]} is {value:g}; the allowed range is 0.1 to 5")], finger.messages
    finger.unit.setFloat64(finger.inputs, rows[49][0][: len(finger.inputs)])
    after = finger.unit.serializeFMUState(finger.unit.getFMUState())
    assert after == before, "a discarded step changes the state"
    assert finger.step(inputs)[1] == rows[50][1], "after discarded steps it does not go on as before"
    for dt in (0.0, -1e-3, float("nan")):
        assert refused(lambda: finger.unit.doStep(0.051, dt), ERROR), f"a step of {dt} s"
    assert refused(lambda: finger.unit.getFloat64([999]), ERROR), "an unknown variable is read"
    assert refused(lambda: finger.unit.setFloat64([finger.names["normal_force_n"]], [1.0]), ERROR), "an output is set"
    assert refused(lambda: finger.unit.setFloat64([finger.names["size"]], [1.1]), ERROR), "a parameter is set too late"
    assert "size is a fixed parameter" in finger.messages[-1][1], finger.messages
    finger.close()
    good = pathlib.Path(finger.folder, "resources", "model.fpm").read_bytes()
    flipped = good[:3000] + bytes([good[3000] ^ 1]) + good[3001:]
    for what, wrong in {
        "another instantiation token": {"token": "{another}"},
        "a cut model file": {"model": good[: len(good) // 2]},
        "an empty model file": {"model": b""},
        "a damaged model file": {"model": flipped},
        "another file": {"model": b"solid cube\n"},
    }.items():
        assert not can_be_made(fmu, wrong), f"{what} is taken"
    assert can_be_made(fmu, {"model": good})
    print("misuse: discarded steps leave the state; bad steps, variables, parameters, tokens and model files are errors")


def refused_parameters(fmu):
    """A parameter out of its range is named, with its value and the range; the bounds themselves are taken."""
    finger = Finger(fmu)
    count = 0
    for name, least, most in (("size", 0.5, 2), ("stiffness", 0.2, 5), ("lambda", 0.1, 10)):
        for value in (least, most, least - 0.01, most + 0.01, float("nan"), float("inf")):
            finger.unit.reset()
            finger.messages.clear()
            finger.unit.enterInitializationMode(startTime=0.0)
            finger.unit.setFloat64([finger.names[name]], [value])
            if value in (least, most):
                finger.unit.exitInitializationMode()
                assert finger.messages == [], finger.messages
                continue
            assert refused(finger.unit.exitInitializationMode, ERROR), f"{name} {value}"
            assert finger.messages == [(ERROR, f"{name} is {value:g}; the allowed range is {least} to {most}")], finger.messages
            count += 1
    finger.unit.reset()
    finger.messages.clear()
    finger.unit.enterInitializationMode(startTime=0.0)
    finger.unit.setFloat64([finger.names["size"], finger.names["lambda"]], [3.0, 0.0])
    assert refused(finger.unit.exitInitializationMode, ERROR) and len(finger.messages) == 2, "both are named"
    finger.unit.freeInstance()
    print(f"parameters: {count} values out of range, each refused with name, value and range")


def long_steps(fmu):
    """Steps of 10 ms agree with steps of 1 ms along the same places: slides, reversals, turns, depth and spin at once."""
    draw = random.Random(20111)
    worst = {}
    for kind in ("slides and reversals along x", "slides in all directions", "with depth", "with depth and spin"):
        for speed_mm_s in (5.0, 20.0, 100.0):
            for _ in range(3):
                error = largest_difference(fmu, draw, kind, speed_mm_s)
                worst[kind] = max(worst.get(kind, 0.0), error)
    for kind, error in worst.items():
        assert 0.0 < error < 0.5, f"{kind}: {error} % of the limit"
    print("steps of 10 ms against 1 ms, friction over its limit:", ", ".join(f"{k} {e:.3f} %" for k, e in worst.items()))


def largest_difference(fmu, draw, kind, speed_mm_s):
    long, short = Finger(fmu, "long"), Finger(fmu, "short")
    at, velocity, left, worst, most = [0.0] * 4, [0.0] * 4, 0, 0.0, 0
    for i in range(150):
        before = list(at)
        if i < 20:
            velocity = [5.0, 0.0, 0.0, 0.0]
        elif left == 0:
            left = draw.randint(3, 30)
            angle = draw.choice((0.0, math.pi)) if kind.endswith("along x") else draw.uniform(0.0, 2 * math.pi)
            speed = draw.uniform(0.0, speed_mm_s)
            sinking = draw.uniform(-1.0, 1.0) if "depth" in kind else 0.0
            velocity = [sinking, speed * math.cos(angle), speed * math.sin(angle), draw.uniform(-1, 1) if "spin" in kind else 0.0]
        left = max(left - 1, 0)
        at = [x + v * 0.01 for x, v in zip(at, velocity)]
        at[0] = min(max(at[0], 0.2), 1.6)
        assert long.step([*at, 1.0], 0.01)[0] == 0
        moved = [abs(x - y) for x, y in zip(at, before)]
        needed = (sum(moved[:3]) + ARM_MM * moved[3]) / SUBSTEP_MM
        assert needed - 1e-6 <= long.substeps() < needed + 1 + 1e-6 or long.substeps() == 1, (long.substeps(), needed)
        most = max(most, long.substeps())
        for k in range(1, 11):
            part = [y + (x - y) * k / 10 for x, y in zip(at, before)] if k < 10 else at
            assert short.step([*part, 1.0])[0] == 0
        difference = [long.number(name) - short.number(name) for name in ("friction_x_n", "friction_y_n")]
        worst = max(worst, 100 * math.hypot(*difference) / short.number("friction_limit_n"))
    assert most > 3, "no step was divided"
    # A jump of a metre is divided into the largest number of parts, and the place is reached.
    assert long.step([1.0, at[1] + 1000.0, at[2], at[3], 1.0], 0.01)[0] == 0 and long.substeps() == SUBSTEPS_MAX
    assert long.step([1.0, at[1] + 1000.0, at[2], at[3], 1.0], 0.01)[0] == 0 and long.substeps() == 1
    long.close()
    short.close()
    return worst


def can_be_made(fmu, arguments):
    try:
        Finger(fmu, **arguments).close()
    except Exception:
        return False
    return True


def by_simulation(fmu, rows):
    """The whole tool: the clean path as a table of inputs."""
    # FMPy applies the input of a time to the step that starts there. The first row is the finger in the air at the place from
    # which the path is counted; a step of a power of two keeps FMPy's interpolation between equal times exact.
    dt_s = 1 / 1024
    start = [0.0] * 4 + [1.0]
    table = numpy.array(
        [tuple([i * dt_s] + inputs) for i, inputs in enumerate([start] + [inputs[: len(INPUTS)] for inputs, _ in rows])],
        dtype=[("time", float)] + [(name, float) for name in INPUTS],
    )
    result = simulate_fmu(
        fmu,
        stop_time=(len(rows) + 1) * dt_s,
        step_size=dt_s,
        output_interval=dt_s,
        input=table,
        output=OUTPUTS,
    )
    for i, (_, want) in enumerate(rows):
        got = [struct.pack(">f", result[name][i + 2]).hex() for name in OUTPUTS]
        assert got == want.split()[: len(OUTPUTS)], f"simulate_fmu, step {i}"
    print(f"simulate_fmu: {len(rows)} rows bit for bit")


def own_column(plain, charged, rows):
    """A law of the user's own has its column as an input, with unit and start value, and the forces follow it."""
    assert OWN not in Finger(plain).names, "the shipped model reads no column of the user's own"
    variables = {variable.name: variable for variable in read_model_description(charged).modelVariables}
    voltage = variables[OWN]
    assert (voltage.causality, voltage.unit, float(voltage.start)) == ("input", "V", 20.0), voltage
    answers = []
    for volts in (None, 20.0, 200.0, 400.0):
        finger = Finger(charged)
        finger.inputs = finger.inputs[: len(INPUTS) + (volts is not None)]
        answers.append([finger.step([*inputs[: len(INPUTS)], volts])[1] for inputs, _ in rows[:300]])
        finger.close()
    unset, start, strong, beyond = answers
    limit = [struct.unpack(">f", bytes.fromhex(answer[-1].split()[OUTPUTS.index("friction_limit_n")]))[0] for answer in answers]
    assert unset == start, "an input that is not set has its start value"
    assert limit[2] > 1.3 * limit[1], f"the voltage does not act: {limit}"
    assert limit[3] == limit[2] and int(beyond[-1].split()[-1]) & 256, "beyond its table it is held and flagged"
    print(f"{OWN}: friction limit {limit[1]:.4f} N at 20 V, {limit[2]:.4f} N at 200 V")


def main(shipped, charged, story):
    story = pathlib.Path(story)
    rows = {
        (path, model): read_rows(story / f"places_{path}_{model}.txt")
        for path in ("clean", "disturbed")
        for model in ("shipped", "charged")
    }
    bad_input = 0
    for model, fmu in (("shipped", shipped), ("charged", charged)):
        problems = validate_fmu(fmu)
        assert problems == [], problems
        print(f"{model}: validate_fmu has nothing to say")
        for path in ("clean", "disturbed"):
            bad_input += same_bits(fmu, rows[path, model], f"{model}, {path}")
        state_goes_back(fmu, rows["disturbed", model][:2000])
    assert bad_input > 10, "the disturbed paths hold no bad input"
    two_at_once(shipped, rows["clean", "shipped"], rows["disturbed", "shipped"])
    misuse(shipped, rows["clean", "shipped"])
    refused_parameters(shipped)
    long_steps(shipped)
    by_simulation(shipped, rows["clean", "shipped"])
    own_column(shipped, charged, rows["clean", "charged"])
    exchanged = Finger(charged)
    answers = [exchanged.step(inputs)[1] for inputs, _ in rows["clean", "shipped"]]
    assert answers != [want for _, want in rows["clean", "shipped"]], "the comparison does not see another model"
    exchanged.close()


main(*sys.argv[1:])
