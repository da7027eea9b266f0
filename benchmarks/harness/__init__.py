"""What measures: processes, turns, records.

arguments.py    arguments that several commands take
machine.py      folders; what figures belong to
records.py      records as files
turns.py        calls in turns, in this process
ways.py         ways to draw the same bits, in turns
rounds.py       contestants of a case in turns, processes of their own
contestants.py  who draws a case, and its process
worker.py       the other end of that process
peer_turns.py   peers beside methods
yardstick.py    external programs that print their own time
"""
