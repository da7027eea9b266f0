"""Files that nobody meant: bytes changed, cut off, doubled; values of JSON replaced or taken out.

`TOPLEFT_MUTATIONS` is the number of mutated files of each format that the tests read: N_MUTATIONS unless set.
"""

import json
import os

N_MUTATIONS = int(os.environ.get("TOPLEFT_MUTATIONS", "80"))

WORDS = [b"0", b"-1", b"1e999", b"nan", b"inf", b"4294967295", b"99999999999999999999", b"1.5", b"", b"/", b"//", b"\0"]
JSON_VALUES = [
    None,
    True,
    -1,
    0,
    1,
    1.5,
    1e308,
    2**31,
    2**53,
    2**70,
    "",
    "x",
    [],
    {},
    [0],
    {"a": 0},
    [[]],
    "data:,",
    "../a",
]


def places_of(tree, path=()):
    """Where values stand in a JSON document."""
    rows = tree.items() if isinstance(tree, dict) else enumerate(tree)
    for key, value in rows:
        yield (*path, key)
        if isinstance(value, dict | list):
            yield from places_of(value, (*path, key))


def mutated_tree(rng, tree):
    tree = json.loads(json.dumps(tree))
    for _ in range(int(rng.integers(1, 3))):
        places = list(places_of(tree))
        *path, key = places[int(rng.integers(len(places)))]
        holder = tree
        for step in path:
            holder = holder[step]
        if rng.random() < 0.25:
            del holder[key]
        else:
            holder[key] = JSON_VALUES[int(rng.integers(len(JSON_VALUES)))]
    return tree


def mutated_bytes(rng, content):
    """Cut off, or with bytes changed, words replaced, parts doubled or taken out."""
    content = bytearray(content)
    for _ in range(int(rng.integers(1, 4))):
        if not content:
            break
        at = int(rng.integers(len(content)))
        match int(rng.integers(6)):
            case 0:
                del content[at:]
            case 1:
                content[at] = int(rng.integers(256))
            case 2:
                content[at : at + 4] = int(rng.integers(2**32)).to_bytes(4, "little")
            case 3:
                content[at:at] = content[at : at + int(rng.integers(60))]
            case 4:
                del content[at : at + int(rng.integers(1, 30))]
            case _:
                words = bytes(content).split(b" ")
                words[int(rng.integers(len(words)))] = WORDS[int(rng.integers(len(WORDS)))]
                content = bytearray(b" ".join(words))
    return bytes(content)
