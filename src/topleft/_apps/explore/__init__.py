"""The explorer: a page in the browser in which triangles are moved and their pixels watched.

`page` holds the page itself: HTML, CSS and JavaScript modules.
"""
