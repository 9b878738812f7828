# SPDX-License-Identifier: Apache-2.0
"""``python -m needleforce.rig FILE [SEED]`` writes the example recording."""

import sys

from ..errors import InputError
from ..recording import write
from .experiment import example_recording


def main(arguments: list[str]) -> int:
    """Write the example recording; returns 0 if done, 1 if it cannot be written, 2 for wrong usage."""
    if len(arguments) not in (1, 2) or not all(seed.isdigit() for seed in arguments[1:]):
        print("usage: python -m needleforce.rig FILE [SEED]", file=sys.stderr)
        return 2
    try:
        print(write(example_recording(*map(int, arguments[1:])), arguments[0]))
    except InputError as error:
        print(error, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
