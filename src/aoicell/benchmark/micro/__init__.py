"""Small benchmarks, each a ratio of things that are measured side by side."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from aoicell.benchmark.micro.detection import bench_detection
from aoicell.benchmark.micro.optics import bench_optics
from aoicell.benchmark.micro.throughput import bench_throughput

BENCHMARKS: Mapping[str, Callable[[bool], dict[str, Any]]] = MappingProxyType(
    {"detection": bench_detection, "optics": bench_optics, "throughput": bench_throughput}
)
