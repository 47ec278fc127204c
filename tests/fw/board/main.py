"""Runs scenarios on the unmodified images: `main.py FOLDER-OF-IMAGES FOLDER-OF-TABLES TAPES [SCENARIO...]`.

Exit code 1 if a check fails. What the program asked and was told goes to TAPES, for the host to repeat; signed
containers are in its folder `containers`. The deepest stack of each image goes to its file `stacks`.
"""

import concurrent.futures
import os
import struct
import sys
import time

from scenarios import SCENARIOS


class Images:
    """The images and tables by name."""

    def __init__(self, folder, tables, containers):
        self.tables, self.containers = tables, containers
        name = lambda image: os.path.join(folder, f"{image}.elf")
        self.uni, self.bi = name("holdfast"), name("holdfast-bidirectional")
        self.uni_chip, self.bi_chip = name("holdfast-ade7953"), name("holdfast-ade7953-bidirectional")

    def table(self, name):
        with open(os.path.join(self.tables, f"{name}.bin"), "rb") as file:
            return file.read()

    def container(self, name):
        with open(os.path.join(self.containers, f"{name}.hfsc"), "rb") as file:
            return file.read()


def write_tape(path, board, build):
    """What happened from the first turn of the loop on: UID, name of the build (32 bytes), items of 1 + 4 bytes."""
    with open(path, "wb") as file:
        file.write(board.uid)
        file.write(build.encode().ljust(32, b"\0"))
        file.write(b"".join(kind + struct.pack("<I", value) for kind, value in board.tape))


def play(name, images, tapes):
    started = time.process_time()
    try:
        outcome = SCENARIOS[name](images)
        runs = list(outcome) if hasattr(outcome, "__next__") else [outcome]
    except Exception as error:  # A scenario that cannot go on has failed.
        return name, 0, [f"it stops: {error!r}"], 0.0, 0.0, []
    for n, run in enumerate(runs):
        # The host repeats runs of the product with its own table, from their first start on.
        if tapes and len(run.board.resets) == 1 and run.board.repeatable and run.identity():
            path = os.path.join(tapes, f"{name}-{n}.{run.board.image}.tape")
            write_tape(path, run.board, run.identity().build)
    failed = [line for run in runs for line in run.failed]
    seconds = sum(run.board.us for run in runs) * 1e-6
    stacks = [(run.board.image, run.board.stack()) for run in runs]
    return name, sum(run.passed for run in runs), failed, seconds, time.process_time() - started, stacks


def main(folder, tables, tapes, *wanted):
    unknown = set(wanted) - set(SCENARIOS)
    if unknown:
        print(f"no such scenario: {', '.join(sorted(unknown))}; allowed: {', '.join(SCENARIOS)}")
        return 2
    names = list(wanted) or list(SCENARIOS)
    images = Images(folder, tables, os.path.join(tapes, "containers"))
    bad, deepest = 0, {}
    # The longest first.
    with concurrent.futures.ProcessPoolExecutor(os.cpu_count()) as pool:
        for name, passed, failed, seconds, cpu, stacks in pool.map(play, names, [images] * len(names), [tapes] * len(names)):
            print(f"{name}: {passed} checks hold, {len(failed)} do not; {seconds:.0f} s of the board in {cpu:.1f} s")
            for line in failed:
                print(f"  {line}")
            bad += bool(failed)
            for image, stack in stacks:
                deepest[image] = max(deepest.get(image, 0), stack)
    with open(os.path.join(tapes, "stacks"), "w") as file:
        file.writelines(f"{image} {deepest[image]}\n" for image in sorted(deepest))
    print(f"board: {len(names) - bad} of {len(names)} scenarios hold")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
