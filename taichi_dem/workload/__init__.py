"""Work of a run, body by body and interval by interval, and how workers would share it."""

from taichi_dem.workload.record import Workload, record_workload
from taichi_dem.workload.sharing import WAYS, SharedWork, Workers

__all__ = ["WAYS", "SharedWork", "Workers", "Workload", "record_workload"]
