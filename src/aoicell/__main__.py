"""`python -m aoicell`."""

from aoicell.cli import main

main()
