"""`python -m bench.cli`: the command `jointbench` where the script is not on the path."""

import sys

from bench.cli import main

sys.exit(main())
