"""Help that several test modules share."""
