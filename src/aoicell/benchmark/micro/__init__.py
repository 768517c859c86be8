"""Small benchmarks, each a ratio of things that are measured side by side."""
