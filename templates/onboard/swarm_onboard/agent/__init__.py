"""What swarmctl runs on a host: requests in, notes and answers out. Python 3.8, standard library only.

A verb is a module in ``verbs`` with a function ``handle(request, payload, report)`` that returns a dict.
"""
