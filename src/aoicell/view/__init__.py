"""The cell in a browser while a trial runs."""

from aoicell.view.watch import watch

__all__ = ["watch"]
