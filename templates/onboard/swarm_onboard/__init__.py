"""What runs on hosts: Python 3.8 with the standard library, and ROS or pyserial where a part names them.

A host gets the parts that it needs; `nodes` has the ROS packages whose programs run them.
"""
