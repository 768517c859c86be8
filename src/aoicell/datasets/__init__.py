"""Recordings of other people's robots and our own: read, checked, written; results handed out."""
