"""The other end of a wire, when it means no good.

A robot and a twin that lie, clients that attack.
"""
