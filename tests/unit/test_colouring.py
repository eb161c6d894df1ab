"""Colours of bonds: links of one colour share no body."""

import numpy as np
import pytest

from taichi_dem import PAPER_BLOCK, read_mesh
from taichi_dem.mesh.topology import edge_colours, topology_of

#: A tetrahedron has four faces, so no body has more links.
DEGREE = 4


def random_links(random, body_count, tries):
    """Links of a random graph without doubles in which no body has more than DEGREE."""
    degree, links = [0] * body_count, {}
    for i, j in np.sort(random.integers(0, body_count, (tries, 2)), axis=1).tolist():
        if i != j and (i, j) not in links and max(degree[i], degree[j]) < DEGREE:
            degree[i], degree[j] = degree[i] + 1, degree[j] + 1
            links[i, j] = None
    return list(links)


def is_proper(links, colours):
    """Whether no body has two links of one colour."""
    links, colours = np.asarray(links), np.asarray(colours)
    seen = np.concatenate([1000 * links[:, 0] + colours, 1000 * links[:, 1] + colours])
    return len(np.unique(seen)) == len(seen)


@pytest.fixture(scope="module")
def graphs():
    """Random graphs, from a few links to as many as there can be, as (body_count, links)."""
    random = np.random.default_rng(0)
    sizes = [(int(n), int(t) * int(n)) for n, t in random.integers([5, 1], [40, 12], (150, 2))]
    listed = [(n, random_links(random, n, tries)) for n, tries in sizes]
    return [(n, links) for n, links in listed if links]


def test_links_of_a_colour_share_no_body(graphs):
    """At most five colours for four links a body (Vizing), none left out."""
    most = 0
    for body_count, links in graphs:
        colours = edge_colours(links, body_count)
        assert is_proper(links, colours)
        assert sorted(set(colours.tolist())) == list(range(colours.max() + 1))
        most = max(most, colours.max() + 1)
    assert most == 5


def test_the_block_of_the_paper_takes_five_colours_at_most():
    mesh = read_mesh(PAPER_BLOCK)
    top = topology_of(mesh)
    links = np.stack([top.master, top.slave], axis=1)
    colours = edge_colours(links, mesh.body_count)
    assert is_proper(links, colours)
    assert DEGREE <= colours.max() + 1 <= 5
