"""How records are shown, and what every study has to offer.

study.py     the protocol of a study
tables.py    Markdown tables, numbers, commits
pages.py     tables between the markers of a page
charts.py    looks, axes, files; needs matplotlib
"""
