"""RAM of each module and of the whole application, from .mpy files and frozen."""

from __future__ import annotations

from ghst_tools import device_files, kept_memory
from ghst_tools.bench.figures import Effort, Findings, Table
from ghst_tools.bench.goals import KEPT
from ghst_tools.bench.rig import Rig, Running, control_frames
from ghst_tools.demo.aircraft import Aircraft, Devices

_LIMIT_NS = 60e9
_SENSORS_MS = 3000
_RATE_HZ = 250

# Every import statement goes through `hook`, so that a module is not charged for those that it
# imports. All that is kept between is there before.
_IMPORTS = """
import builtins, gc
real = builtins.__import__
names = {names}
kept = dict.fromkeys(names, 0)
most = dict.fromkeys(names, 0)
inner = [0] * 30
depth = 0
def hook(name, env=None, local=None, items=None, level=0):
    global depth
    for item in items or ():
        if name + "." + item in kept:
            hook(name + "." + item)
    if most.get(name) != 0:
        return real(name, env, local, items, level)
    depth += 1
    inner[depth] = 0
    gc.collect()
    before = gc.mem_alloc()
    found = real(name, env, local, items, level)
    at_most = gc.mem_alloc() - before
    gc.collect()
    took = gc.mem_alloc() - before
    kept[name] = took - inner[depth]
    most[name] = at_most - inner[depth] or -1
    depth -= 1
    inner[depth] += took
    return found
builtins.__import__ = hook
for name in names:
    hook(name)
builtins.__import__ = real
for name in names:
    print(name, kept[name], most[name], "end")
"""

_USER = f"""
import gc, time
def setup(application):
    begun = time.ticks_ms()
    told = []
    def tell(now_ms):
        if not told and time.ticks_diff(time.ticks_ms(), begun) > {_SENSORS_MS}:
            told.append(True)
            gc.collect()
            print("application", gc.mem_alloc(), "end of measurement")
    application.steps.append(tell)
"""


def _without_main(running: Running) -> None:
    """Reset the interpreter in the raw REPL: main.py is not run then, not even a frozen one."""
    console = running.board.console
    running.board.run_until(lambda: b"link: searching" in console.output)
    console.write(b"\r\x03")
    running.board.run_until(lambda: console.output.endswith(b">>> "))
    console.write(b"\x01")
    running.board.run_until(lambda: console.output.endswith(b"exit\r\n>"))
    start = len(console.output)
    console.write(b"\x04")
    running.board.run_until(lambda: console.output[start:].endswith(b"exit\r\n>"))


def _of_modules(rig: Rig, names: list[str]) -> dict[str, tuple[int, int]]:
    """Bytes kept by each module, and taken at most while it is imported."""
    running = rig.power_on()
    _without_main(running)
    printed = running.board.exec(_IMPORTS.format(names=names), _LIMIT_NS)
    found = {}
    for line in printed.splitlines():
        name, kept, most, _ = line.split()
        found[name] = (int(kept), max(0, int(most)))
    return found


def _of_application(rig: Rig) -> int:
    """Bytes in use once all sensors run."""
    running = rig.power_on({"/user.py": _USER.encode()})
    running.devices = Devices(running.board, Aircraft(), rig.defaults)
    console = running.board.console
    running.board.run_until(lambda: b"end of measurement" in console.output, _LIMIT_NS)
    return running.numbers("application")[0]


def with_nothing_connected(rig: Rig) -> int:
    """Bytes in use with the defaults, no sensor, and a link."""
    running = rig.power_on(kept_memory.meter(rig.definition))
    running.receiver(control_frames(), _RATE_HZ).start(0.0)
    return kept_memory.kept(running.board)


def modules(rig: Rig, effort: Effort, findings: Findings) -> tuple[Table, ...]:
    """RAM that each module keeps, and at most takes, from a file and frozen."""
    names = [device_files.dotted(name) for name in rig.sources]
    # As they come at the start; what is left over last.
    names.sort(key=lambda name: (name != "ghst", name != "firmware.app", name))
    if not effort.frozen:
        names = [name for name in names if name.startswith("ghst")]
    rigs = {".mpy": rig} | ({"frozen": rig.frozen} if effort.frozen else {})
    found = {kind: _of_modules(each, names) for kind, each in rigs.items()}
    columns = [f"{kind}, {what}" for kind in rigs for what in ("kept", "at most")]
    rows = [
        (name, *(f"{count}" for kind in rigs for count in found[kind][name])) for name in names
    ]
    sums = (f"{sum(kept for kept, _ in found[kind].values())}" for kind in rigs)
    rows.append(("in all", *(cell for total in sums for cell in (total, ""))))
    kept = Table(
        "RAM of each module",
        "gc.mem_alloc() before and after its import, less the modules that it imports: kept, "
        "after gc.collect(); at most, before it, that is with everything that the import left "
        "lying about. Every module there is: no board has all of them loaded.",
        ("module", *columns),
        tuple(rows),
    )
    if not effort.frozen:
        return (kept,)
    findings.kept = {kind: with_nothing_connected(each) for kind, each in rigs.items()}
    application = Table(
        "RAM of the application",
        "gc.mem_alloc() after gc.collect(), with MicroPython's own share and the /user.py that "
        "measures it, some hundred bytes. Nothing connected: the defaults, with a link, after 300 "
        f"rounds of the main loop. All sensors: {_SENSORS_MS} ms after main.py has started, with "
        "a battery, a GPS receiver, a barometer and a magnetometer connected and read; their "
        "modules are loaded then. The tests hold the limits, which are 40 and 16 times 1024.",
        ("firmware", "nothing connected", "limit", "aim", "all sensors"),
        tuple(
            (
                kind,
                f"{findings.kept[kind]}",
                *(f"{most}" for most in KEPT[kind]),
                f"{_of_application(each)}",
            )
            for kind, each in rigs.items()
        ),
    )
    return application, kept
