#!/usr/bin/env python3
"""Each room includes only what the architecture allows (docs/architecture.md), and no two headers give the same name
to different types of the project's namespace, which the linker would mix up: exit 1 and the lines that break it."""
import pathlib
import re
import sys

ALLOWED = {
    "calib": set(),
    "measure": {"calib"},
    "drivers": set(),
    "protocol": {"calib"},
    "config": {"calib", "measure", "drivers", "protocol"},
    "daemon": {"calib", "measure", "drivers", "protocol", "config"},
    "sim": {"calib", "config"},
}
# Single doors between rooms that otherwise do not know each other.
DOORS = {
    ("protocol", "measure/code.h"),
    ("sim", "protocol/can_collector.h"),
    ("sim", "protocol/can_node.h"),
    ("sim", "protocol/can_socket.h"),
    ("sim", "protocol/codec.h"),
    ("sim", "protocol/conventions.h"),
    ("sim", "protocol/report.h"),
    ("sim", "protocol/line_socket.h"),
    ("sim", "measure/code.h"),
    ("sim", "measure/job.h"),
}
# What a pure room must not know.
IMPURE = re.compile(r"#include <(nlohmann|spdlog|fstream|iostream|thread|sys/|arv|modbus)")
PURE = {"calib", "measure"}

TYPE = re.compile(r"(?:struct|class|enum class|enum) (\w+)(?: final)? ?(?:: .*)?\{")


def double_types(root: pathlib.Path) -> list[str]:
    """Types that two headers define in namespace zeropose itself."""
    places: dict[str, list[str]] = {}
    for room in ALLOWED:
        for path in sorted((root / room).glob("**/*.h")):
            lines = path.read_text().splitlines()
            if "namespace zeropose {" not in lines:
                continue
            for number, line in enumerate(lines, 1):
                match = TYPE.match(line)
                if match:
                    places.setdefault(match.group(1), []).append(f"{path}:{number}")
    return [f"{name} is defined in {' and '.join(where)}" for name, where in places.items() if len(where) > 1]


def main() -> int:
    root = pathlib.Path(sys.argv[1])
    broken = double_types(root)
    files = 0
    for room, allowed in ALLOWED.items():
        for path in sorted((root / room).glob("**/*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            files += 1
            for number, line in enumerate(path.read_text().splitlines(), 1):
                match = re.match(r'#include "(\w+)/([^"]+)"', line)
                other = match and match.group(1)
                if other and other != room and other not in allowed:
                    if (room, f"{other}/{match.group(2)}") not in DOORS:
                        broken.append(f"{path}:{number}: {room} must not use {other}: {line}")
                if room in PURE and IMPURE.match(line):
                    broken.append(f"{path}:{number}: {room} is pure: {line}")
    print("\n".join(broken) or f"{files} files keep to the arrows")
    return 1 if broken or files < 10 else 0


if __name__ == "__main__":
    sys.exit(main())
