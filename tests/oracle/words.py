"""Payloads and code words (the paper, section 2; docs/codes.md), and their correlations."""

import numpy as np


def checksum(label, bits, start):
    """CRC-3 with x^3 + x + 1: the remainder of the label, its first bit first, by long division."""
    register = start
    for place in range(bits - 1, -1, -1):
        feedback = (register >> 2 & 1) ^ (label >> place & 1)
        register = register << 1 & 0b111
        if feedback:
            register ^= 0b011
    return register


def payload(label, start=0, sync=False, bits=10):
    """The payload of a column as text: a sync bit if wanted, the number, its checksum."""
    text = format(label, f"0{bits}b") + format(checksum(label, bits, start), "03b")
    return "1" + text if sync else text


def prime_word(i, p=29, block=None):
    """Marks of word i of the prime code: one in each block, at i*j mod p."""
    j = np.arange(p)
    return i * j % p + (block or p) * j


def congruence_word(a, p=29, block=None):
    """Marks of word a of the quadratic congruence code."""
    k = np.arange(p)
    return a * (k * (k + 1) // 2) % p + (block or p) * k


def macropulse(label, word, p=29, start=0, sync=False):
    """Chips that are lit: the word for each bit that is 1, nothing for a 0."""
    lit = [place for place, bit in enumerate(payload(label, start, sync)) if bit == "1"]
    if not lit:
        return []
    return np.concatenate([prime_word(word, p) + place * p * p for place in lit]).tolist()


def chips(marks, length):
    """A word as ones and zeros."""
    word = np.zeros(length, dtype=int)
    word[np.asarray(marks, dtype=int)] = 1
    return word


def periodic(words, signs=False):
    """Correlations of all ordered pairs of words at all lags, an array (word, word, lag)."""
    words = np.asarray(words)
    rows = 1 - 2 * words if signs else words
    spectra = np.fft.rfft(rows, axis=1)
    met = [np.fft.irfft(np.conj(one) * spectra, n=rows.shape[1], axis=1) for one in spectra]
    return np.rint(np.array(met)).astype(int)


def family(name, p):
    """All words of a family as rows of chips."""
    if name == "prime":
        return [chips(prime_word(i, p), p * p) for i in range(p)]
    if name == "extended-prime":
        return [chips(prime_word(i, p, 2 * p - 1), p * (2 * p - 1)) for i in range(p)]
    if name == "quadratic-congruence":
        return [chips(congruence_word(a, p), p * p) for a in range(1, p)]
    raise ValueError(name)


def compared(name, p):
    """What `macropulse codes` prints of a family, counted from its definition."""
    words = family(name, p)
    met = periodic(words)
    off_diagonal = ~np.eye(len(words), dtype=bool)
    cross = met[off_diagonal]
    own = met[~off_diagonal][:, 1:]
    return {
        "length_chips": len(words[0]),
        "words": len(words),
        "sidelobe_periodic": int(own.max()),
        "cross_max_periodic": int(cross.max()),
        "cross_mean": float(cross.mean()),
        "cross_variance": float(cross.var()),
    }


def complexity(bits):
    """Length of the shortest linear recurrence modulo 2 that makes the bits (Berlekamp, Massey)."""
    current, previous, length, since = [1], [1], 0, 1
    for n, bit in enumerate(bits):
        taps = sum(current[i] & bits[n - i] for i in range(1, min(length, len(current) - 1) + 1))
        if (bit + taps) % 2 == 0:
            since += 1
            continue
        shifted = [0] * since + previous
        wide = max(len(current), len(shifted))
        grown = [
            (current[i] if i < len(current) else 0) ^ (shifted[i] if i < len(shifted) else 0)
            for i in range(wide)
        ]
        if 2 * length <= n:
            previous, current, length, since = current, grown, n + 1 - length, 1
        else:
            current, since = grown, since + 1
    return length


def gold(words, length=127):
    """Whether words, as lists of marks, are a Gold family: what is found of it."""
    rows = np.array([chips(word, length) for word in words])
    first, second = rows[0], rows[1]
    sums = {tuple(first ^ np.roll(second, shift)) for shift in range(length)}
    met = periodic(rows, signs=True)
    cross = met[~np.eye(len(rows), dtype=bool)]
    return {
        "words": len(rows),
        "complexity": [complexity(np.tile(row, 2).tolist()) for row in (first, second)],
        "sums_of_the_first_two": sum(tuple(row) in sums for row in rows[2:]),
        "distinct": len({tuple(row) for row in rows}),
        "cross_values": sorted(int(value) for value in np.unique(cross)),
    }
