"""One test a seed, until the frame of the attacks gives them."""


def pytest_generate_tests(metafunc):
    if metafunc.config.pluginmanager.has_plugin("tests.attacks"):
        return
    if hasattr(metafunc.module, "ATTACKS") and "seed" in metafunc.fixturenames:
        metafunc.parametrize("seed", range(1))
