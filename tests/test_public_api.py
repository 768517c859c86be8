import aoicell


def test_every_public_name_exists_and_is_documented() -> None:
    for name in set(aoicell.__all__) - {"__version__", "METHODS"}:
        assert getattr(aoicell, name).__doc__, name
    assert len(set(aoicell.__all__)) == len(aoicell.__all__)
    assert dir(aoicell) == sorted(aoicell.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    assert not hasattr(aoicell, "no_such_name")
