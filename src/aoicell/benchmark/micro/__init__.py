"""Small benchmarks, each a ratio of things that are measured side by side."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from aoicell.benchmark.micro.calibration import bench_calibration
from aoicell.benchmark.micro.detection import bench_detection
from aoicell.benchmark.micro.hand_eye import bench_hand_eye
from aoicell.benchmark.micro.inspection import bench_inspection
from aoicell.benchmark.micro.kinhec import bench_kinhec
from aoicell.benchmark.micro.latency import bench_latency
from aoicell.benchmark.micro.localisation import bench_localisation
from aoicell.benchmark.micro.markers import bench_markers
from aoicell.benchmark.micro.optics import bench_optics
from aoicell.benchmark.micro.throughput import bench_throughput
from aoicell.benchmark.micro.touch import bench_touch

BENCHMARKS: Mapping[str, Callable[[bool], dict[str, Any]]] = MappingProxyType(
    {
        "calibration": bench_calibration,
        "detection": bench_detection,
        "hand_eye": bench_hand_eye,
        "inspection": bench_inspection,
        "kinhec": bench_kinhec,
        "latency": bench_latency,
        "localisation": bench_localisation,
        "markers": bench_markers,
        "optics": bench_optics,
        "throughput": bench_throughput,
        "touch": bench_touch,
    }
)
