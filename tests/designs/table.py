"""What the scripts of this folder share: the program, and how numbers are written in docs/guide/coded-32.md."""

import sys

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "macropulse"


def share(count, of):
    """1.6·10⁻³."""
    if not count:
        return "0"
    digits, power = f"{count / of:.1e}".split("e")
    return f"{digits}·10" + str(int(power)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def number(count):
    """50 880."""
    return f"{count:,}".replace(",", " ")
