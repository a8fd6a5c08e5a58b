"""`python -m tarsus.cli` is `tarsus`."""

import sys

from tarsus.cli import main

sys.exit(main())
