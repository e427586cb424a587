"""Flutter maps and Monte-Carlo sweeps: many end states, stored so that nothing is lost."""

from aeroflutter.maps.cells import Cells, Group, SpeedPitch
from aeroflutter.maps.cluster import Cluster
from aeroflutter.maps.executors import Processes, Threads
from aeroflutter.maps.flutter_map import FlutterMap, MapOptions, MapStudy, collect, flutter_map
from aeroflutter.maps.grid import Axis, Grid
from aeroflutter.maps.runner import Progress, run
from aeroflutter.maps.store import Store, StoreFull
from aeroflutter.maps.study import Executor

__all__ = [
    "Axis",
    "Cells",
    "Cluster",
    "Executor",
    "FlutterMap",
    "Grid",
    "Group",
    "MapOptions",
    "MapStudy",
    "Processes",
    "Progress",
    "SpeedPitch",
    "Store",
    "StoreFull",
    "Threads",
    "collect",
    "flutter_map",
    "run",
]
