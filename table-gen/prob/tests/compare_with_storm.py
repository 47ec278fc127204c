"""Compares lower bounds with Storm: compare_with_storm.py FILE.drn STEPS BOUND [FILE.drn STEPS BOUND ...].

Needs `pip install stormpy`. `table-gen prob TABLE --spec SPEC --drn FILE --json` gives such a file, its steps and its
bound (`layers.participation.lower_bound`).

A bound written as `seconds:VALUE` is that of the expected seconds (`seconds_below_49_5`), with the seconds before the
first decision left away: Storm is asked for the largest expected reward of the model `seconds`, and ours must not lie
below it by more than Storm's rounding.

Storm is asked for the largest probability of failure that the adversary can reach; a chain's step is two steps there,
and one more picks the initial state. Exit code 1 where a bound differs by more than 1e-9, or lies above Storm's value
by more than Storm's own rounding.
"""

import pathlib
import sys
import time

import stormpy

DIFFERENCE_MAX = 1e-9
# Storm adds in doubles, rounded to nearest: 240 half-steps of at most 10 terms, 2^-53 each, are below 3e-13.
ROUNDING = 1e-12


def storm(path, steps):
    """Storm's lower bound over so many steps of the chain."""
    model = stormpy.build_model_from_drn(str(path))
    formula = f'Pmax=? [F<={2 * steps + 1} "failed"]'
    result = stormpy.model_checking(model, stormpy.parse_properties(formula)[0])
    return 1.0 - result.get_value(model.initial_states[0]), model


def storm_seconds(path, steps):
    """Storm's largest expected seconds over so many steps of the chain."""
    model = stormpy.build_model_from_drn(str(path))
    formula = f'R{{"seconds"}}max=? [C<={2 * steps + 1}]'
    result = stormpy.model_checking(model, stormpy.parse_properties(formula)[0])
    return result.get_value(model.initial_states[0]), model


def main(arguments):
    """Compares all instances."""
    todo = []
    while arguments:
        drn, steps, bound, *arguments = arguments
        seconds = bound.startswith("seconds:")
        todo.append((pathlib.Path(drn), int(steps), float(bound.removeprefix("seconds:")), seconds))
    if not todo:
        sys.exit("nothing to compare")
    wrong = 0
    for path, steps, bound, seconds in todo:
        start = time.monotonic()
        value, model = (storm_seconds if seconds else storm)(path, steps)
        # A probability is bounded from below, seconds from above.
        above = value - bound if seconds else bound - value
        ok = abs(value - bound) <= DIFFERENCE_MAX * max(1.0, abs(value)) and above <= ROUNDING * max(1.0, abs(value))
        wrong += not ok
        print(
            f"{path.name}: {model.nr_states} states, {model.nr_transitions} transitions, {steps} steps: "
            f"bound {bound!r}, Storm {value!r}, difference {value - bound:.2e}, "
            f"{time.monotonic() - start:.1f} s: {'agrees' if ok else 'DIFFERS'}"
        )
    sys.exit(1 if wrong else 0)


main(sys.argv[1:])
