"""Edge colouring: links of one colour share no body, so they may be visited side by side."""

import numpy as np


def edge_colours(links: np.ndarray, body_count: int) -> np.ndarray:
    """Colour of every link, (n,) from 0 on; links that share a body differ.

    links: the two bodies of each, shape (n, 2). Greedy; where that would take a new colour, one
    chain of two colours is flipped if that frees an old one. A tetrahedron has at most four
    bonds, for which five colours always suffice and four or five come out.
    """
    colours = np.full(len(links), -1, dtype=np.int32)
    at: list[dict[int, int]] = [{} for _ in range(body_count)]
    highest = -1
    for link, (i, j) in enumerate(np.asarray(links).tolist()):
        most = max(max(at[i], default=-1), max(at[j], default=-1)) + 1
        used = max(most, 1 + highest)
        free = [k for k in range(used) if k not in at[i] and k not in at[j]]
        colour = free[0] if free else _freed(links, colours, at, i, j, used)
        colours[link] = colour
        at[i][colour] = at[j][colour] = link
        # A flipped chain may have held the only link of the last colour.
        highest = max(highest, colour) if free else int(colours.max())
    return colours


def _freed(links, colours, at, i, j, used):
    """A colour made free at both bodies by flipping a chain from the second; else a new one."""
    for mine in (k for k in range(used) if k not in at[i]):
        for other in (k for k in range(used) if k not in at[j]):
            chain, end = _chain(links, at, j, mine, other)
            if end != i:
                _flip(links, colours, at, chain, mine, other)
                return mine
    return used


def _chain(links, at, body, first, second):
    """Links of two alternating colours from a body on, and the body where they end."""
    chain, colour = [], first
    while colour in at[body]:
        link = at[body][colour]
        chain.append(link)
        body = int(links[link][0] + links[link][1] - body)
        colour = first + second - colour
    return chain, body


def _flip(links, colours, at, chain, first, second):
    swapped = {first: second, second: first}
    for link in chain:
        colours[link] = swapped[int(colours[link])]
    for body in {body for link in chain for body in links[link]}:
        at[body] = {swapped.get(colour, colour): link for colour, link in at[body].items()}
