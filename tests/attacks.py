"""Options of the attacks: a test marked ``attack`` that takes a seed is run once a seed."""


def pytest_addoption(parser):
    """How many seeds, from which on."""
    group = parser.getgroup("attacks")
    group.addoption("--attacks", type=int, default=1, metavar="N", help="seeds of each attack")
    group.addoption("--attack-seed", type=int, default=0, metavar="S", help="the first of them")


def pytest_generate_tests(metafunc):
    """One test a seed."""
    if metafunc.definition.get_closest_marker("attack") and "seed" in metafunc.fixturenames:
        first = metafunc.config.getoption("--attack-seed")
        seeds = range(first, first + metafunc.config.getoption("--attacks"))
        metafunc.parametrize("seed", seeds)
