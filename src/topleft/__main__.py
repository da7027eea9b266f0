"""`python -m topleft`: the command line."""

import sys

from topleft.cli import main

sys.exit(main())
