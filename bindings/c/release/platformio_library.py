# PlatformIO: links the library of the board's processor.
Import("env", "projenv")
import os

root = env.Dir("lib/fingerpad").srcnode().abspath
board = env.BoardConfig() if env.get("BOARD") else None
cpu = (board.get("build.cpu", "") if board else "").lower()
flags = " ".join(str(flag) for flag in env.get("CCFLAGS", []) + env.get("LINKFLAGS", []))

if "-mfloat-abi=hard" in flags and cpu in ("cortex-m4", "cortex-m7", "cortex-m33"):
    target = "thumbv7em-none-eabihf"
elif cpu.startswith("cortex-m"):
    target = "thumbv6m-none-eabi"
elif "rv32imac" in flags:
    target = "riscv32imac-unknown-none-elf"
elif env.get("PIOPLATFORM") == "native":
    target = "@HOST@"
else:
    target = env.GetProjectOption("custom_fingerpad_target", "")
folder = os.path.join(root, target)
if not target or not os.path.isdir(folder):
    raise SystemExit(
        f"fingerpad: no library for {cpu or 'this board'}; there are {sorted(os.listdir(root))}: "
        "choose with custom_fingerpad_target in platformio.ini"
    )
for each in (env, projenv):
    each.Append(LIBPATH=[folder], LIBS=["fingerpad"])
