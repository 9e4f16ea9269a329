"""How the tests are run.

What may run beside what, what may be repeated, and how late the machine is.
"""
