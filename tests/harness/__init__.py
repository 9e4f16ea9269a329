"""What tests need to start and end real processes.

Own master, own ports, own logs, nothing left behind.
"""
