"""Where a window listens, and what is said about it."""

import socket

import pytest

from aoicell.errors import InputError
from aoicell.view.address import FIRST_PORT, browser_url, find_free, invitation


def test_the_first_free_port_is_taken() -> None:
    host, port = find_free("127.0.0.1", 0)
    assert host == "127.0.0.1"
    with socket.create_server((host, port)):
        _, next_port = find_free("127.0.0.1", 0)
    assert FIRST_PORT <= port < next_port


def test_a_name_becomes_an_address() -> None:
    assert find_free("localhost", 0)[0] in ("127.0.0.1", "::1")


def test_a_port_that_is_taken_is_refused() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        with pytest.raises(InputError, match=f"--port {port}.*in use.*leave it out"):
            find_free("127.0.0.1", port)


@pytest.mark.parametrize("host", ["no.such.host.invalid", "300.1.1.1", "a" * 70])
def test_an_unknown_host_is_refused(host: str) -> None:
    with pytest.raises(InputError, match=r"--host.*no such address"):
        find_free(host, 0)


def test_an_address_of_another_computer_is_refused() -> None:
    with pytest.raises(InputError, match=r"--host 192\.0\.2\.1.*address of this computer"):
        find_free("192.0.2.1", 0)  # for documentation: nobody's


def test_urls_are_for_a_browser_on_this_computer() -> None:
    assert browser_url("127.0.0.1", 8081) == "http://127.0.0.1:8081/"
    assert browser_url("0.0.0.0", 80) == "http://127.0.0.1:80/"
    assert browser_url("::", 80) == "http://[::1]:80/"


def test_the_invitation_warns_of_others_unless_there_are_none() -> None:
    assert "this computer alone" in invitation("127.0.0.1", 8080)
    warning = invitation("0.0.0.0", 8080)
    assert "whoever reaches 0.0.0.0" in warning
    assert "password" in warning
    assert "alone" not in warning
