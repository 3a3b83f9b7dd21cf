"""Point clouds as objects: from measured points to an object that can be planned for."""

from fingersplit.objects.cloud.point_cloud import PointCloud
from fingersplit.objects.cloud.preparing import MIN_POINTS, check_cloud, prepare_cloud

__all__ = ["MIN_POINTS", "PointCloud", "check_cloud", "prepare_cloud"]
