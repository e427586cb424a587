"""Flutter maps and Monte-Carlo sweeps: many end states, stored so that nothing is lost."""

from aeroflutter.studies.maps.cells import Cells, Group, SpeedPitch
from aeroflutter.studies.maps.cluster import Cluster
from aeroflutter.studies.maps.executors import Processes, Threads
from aeroflutter.studies.maps.flutter_map import (
    FlutterMap,
    MapOptions,
    MapStudy,
    collect,
    flutter_map,
)
from aeroflutter.studies.maps.grid import Axis, Grid
from aeroflutter.studies.maps.runner import Progress, run
from aeroflutter.studies.maps.store import Store, StoreFull, StoreMoved
from aeroflutter.studies.maps.study import Executor

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
    "StoreMoved",
    "Threads",
    "collect",
    "flutter_map",
    "run",
]
