"""What a file may take: counted over all of it, and unpacked no further.

archives.py  unpacks archives into a folder of their own
budget.py    counts what a file makes of its bytes, and refuses more than its options allow
npy.py       reads arrays of NumPy, after their headers have been checked
walks.py     counts how often the nodes of a file are reached from its roots
"""
