"""The static multimaster: registers the declared topics of other masters at the master of this island.

Pure values: ``config`` (parameters), ``graph`` (a master's graph), ``peer_state`` (state of a peer) and
``reconcile`` (the calls to make). ``bridge`` makes the calls; ``slave`` and ``topic`` make it a ROS node.
"""
