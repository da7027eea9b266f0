"""`python -m topleft`: the command line."""

import sys

from topleft._apps.cli import main

sys.exit(main())
