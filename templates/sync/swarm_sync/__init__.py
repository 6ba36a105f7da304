"""The static multimaster: brings the declared topics of other masters to the master of this island.

``config`` is what it is told, ``graph`` what a master shows, ``contact`` how a peer is doing, ``reconcile``
what has to be done: all four are values. ``bridge`` does it, ``slave`` and ``topic`` make it a ROS node.
"""
