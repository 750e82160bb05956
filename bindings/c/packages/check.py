"""The release folder as Zephyr's and Arduino's tools read it: check.py RELEASE-FOLDER

Checks the keys of zephyr/module.yml, the symbols of zephyr/Kconfig, and the fields and folders that Arduino's library specification
(revision 2.2) requires.
"""

import pathlib
import re
import sys

import kconfiglib
import yaml

# Arduino library specification: every field but `license` and those of linking is required.
REQUIRED = ["name", "version", "author", "maintainer", "sentence", "paragraph", "category", "url", "architectures"]
CATEGORIES = [
    "Display", "Communication", "Signal Input/Output", "Sensors", "Device Control", "Timing", "Data Storage", "Data Processing", "Other",
]


def zephyr(release):
    module = yaml.safe_load((release / "zephyr/module.yml").read_text())
    assert set(module) <= {"name", "build"} and re.fullmatch(r"[a-zA-Z0-9_-]+", module["name"]), module
    assert (release / module["build"]["cmake"] / "CMakeLists.txt").is_file(), module["build"]
    kconfig = kconfiglib.Kconfig(str(release / module["build"]["kconfig"]), warn_to_stderr=False)
    assert kconfig.warnings == [], kconfig.warnings
    on, target = kconfig.syms["FINGERPAD"], kconfig.syms["FINGERPAD_TARGET"]
    assert on.str_value == "n" and target.visibility == 0, "off by default, and the target is hidden then"
    on.set_value("y")
    assert target.visibility == 2 and target.str_value == "", "the target can be set, and is empty at first"
    lists = (release / "zephyr/CMakeLists.txt").read_text()
    assert "CONFIG_FINGERPAD_TARGET" in lists and "CONFIG_FINGERPAD)" in lists
    print(f"Zephyr: module {module['name']}, symbols {sorted(symbol.name for symbol in kconfig.unique_defined_syms)}")


def arduino(release):
    fields = dict(line.split("=", 1) for line in (release / "library.properties").read_text().splitlines() if line)
    missing = [key for key in REQUIRED if not fields.get(key)]
    assert missing == [], f"library.properties lacks {missing}"
    assert re.fullmatch(r"\d+\.\d+\.\d+", fields["version"]), fields["version"]
    assert re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9 _.-]{0,62}", fields["name"]), fields["name"]
    assert fields["category"] in CATEGORIES, fields["category"]
    assert re.fullmatch(r".+ <[^@<>]+@[^@<>]+>", fields["maintainer"]), fields["maintainer"]
    assert fields["sentence"].endswith(".") and fields["paragraph"].endswith(".")
    for header in fields["includes"].split(","):
        assert (release / "src" / header).is_file(), f"src/{header}, which library.properties includes"
    assert fields["precompiled"] == "true" and fields["ldflags"] == "-lfingerpad"
    sketches = list((release / "examples").glob("*/*.ino"))
    assert sketches and all(sketch.stem == sketch.parent.name for sketch in sketches), sketches
    sources = [path.name for path in (release / "src").rglob("*") if path.suffix in (".c", ".cpp", ".S")]
    assert sources == [], "nothing is left to compile"
    print(f"Arduino: {len(fields)} fields, {len(sketches)} sketch")


zephyr(pathlib.Path(sys.argv[1]))
arduino(pathlib.Path(sys.argv[1]))
