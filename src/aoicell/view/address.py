"""The address that a window listens at, and what it means."""

import socket

from aoicell.errors import InputError

FIRST_PORT, PORTS = 8080, 20  # tried one after the other when none is asked for
LOOPBACK = ("127.0.0.1", "::1")
EVERYWHERE = {"0.0.0.0": "127.0.0.1", "::": "::1"}  # and how this computer reaches itself there


def find_free(host: str, port: int) -> tuple[str, int]:
    """A numeric address and a port that can be listened on; `port` 0: the first free one.

    Raises InputError for a name that is none of this computer's, and for a port that is taken.
    """
    try:
        family, _, _, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError, OverflowError):
        raise InputError(f"--host {host}: no such address; 127.0.0.1 is this computer") from None
    reason = ""
    for number in [port] if port else range(FIRST_PORT, FIRST_PORT + PORTS):
        with socket.socket(family, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address[0], number, *address[2:]))
            except OSError as error:
                reason = error.strerror or str(error)
            else:
                return str(address[0]), number
    if port:
        raise InputError(
            f"--port {port}: cannot listen there on {host} ({reason}); leave it out, and the "
            "first free one is taken"
        )
    raise InputError(
        f"--host {host}: cannot listen on a port from {FIRST_PORT} to {FIRST_PORT + PORTS - 1} "
        f"({reason}); name an address of this computer, or a free --port"
    )


def browser_url(host: str, port: int) -> str:
    """Where a browser on this computer finds what listens there."""
    reached = EVERYWHERE.get(host, host)
    return f"http://{f'[{reached}]' if ':' in reached else reached}:{port}/"


def invitation(host: str, port: int) -> str:
    """Where to look, and what listening on an address that others reach means."""
    url = browser_url(host, port)
    if host in LOOPBACK:
        return f"{url} shows the cell, to this computer alone; Ctrl-C ends it"
    return (
        f"{url} shows the cell; whoever reaches {host} over the network can look on and press the "
        "buttons, for there is neither password nor encryption; Ctrl-C ends it"
    )
