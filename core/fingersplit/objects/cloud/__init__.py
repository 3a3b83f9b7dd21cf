"""Point clouds as objects: from measured points to the outline of an object."""

from fingersplit.objects.cloud.normals import OrientedPoints
from fingersplit.objects.cloud.outline import Outline
from fingersplit.objects.cloud.point_cloud import PointCloud
from fingersplit.objects.cloud.preparing import MIN_POINTS, check_cloud, close_cloud
from fingersplit.objects.cloud.reconstruction import lies_beside
from fingersplit.objects.cloud.unseen import hide_unseen

__all__ = [
    "MIN_POINTS",
    "OrientedPoints",
    "Outline",
    "PointCloud",
    "check_cloud",
    "close_cloud",
    "hide_unseen",
    "lies_beside",
]
